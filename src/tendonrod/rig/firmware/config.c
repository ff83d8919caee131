/* Numbers of the emulated bench, chosen for it; a real bench needs its own (the paper gives none). The screw is homed
   where the tendon is slack (positive pays out), translation where the robot is withdrawn: homing never adds tension. */
#include "config.h"

const AxisConfig axis_config[AXES] = {
    {-65000, 0, 2000, 100000, 2000, 300, 200},
    {0, 65000, 10000, 400000, -4000, 300, 200},
    {-15000, 15000, 3000, 100000, -1000, 50, 100},
};
