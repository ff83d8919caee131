/* The emulated bench behind hal.h: three axes and a load cell, for tests without hardware. */
#ifndef HAL_EMULATOR_H
#define HAL_EMULATOR_H

#include "config.h"
#include <stdint.h>

#define STIFFNESS 0.3e-6     /* N/nm of tendon and robot together: 0.3 N/mm, ExoNav-1 at 0.7 N */
#define SLACK 60e6           /* nm of tendon that hang loose when screw and robot stand at their references */
#define COUNTS_PER_NEWTON 1349.0
#define COUNTS_AT_ZERO 32768.0

typedef struct {
    double position[AXES], velocity[AXES];   /* true ones, nm and nm/s or urad and urad/s */
    double driven[AXES];                     /* what hal_drive asked for */
    double powered_at[AXES];                 /* where the encoders began to count */
    double travelled[AXES];                  /* sum of all movement, either way */
    int jammed;                              /* axis that does not move, -1 for none */
    uint32_t micros, noise;
} Plant;

extern Plant plant;

void plant_start(void);
void plant_advance(void);  /* by one tick; time itself is the caller's */

/* Where hal_send writes. */
extern void (*plant_output)(const char *text, unsigned length);

#endif
