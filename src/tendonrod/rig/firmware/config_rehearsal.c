/* Numbers of an emulated bench of ExoNav 1, to rehearse a bench on: like the virtual bench's where that has any, chosen
   where not. The screw is homed where the tendon is nearly taut on a withdrawn robot, and pays out from there. */
#include "config.h"

const AxisConfig axis_config[AXES] = {
    {-20000, 100000, 3000, 100000, -3000, 300, 200},
    {0, 80000, 10000, 400000, -8000, 300, 200},
    {-15000, 15000, 3000, 100000, -2000, 50, 100},
};
