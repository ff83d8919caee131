/* The emulated bench behind hal.h: three axes and a load cell, for tests without hardware. */
#ifndef HAL_EMULATOR_H
#define HAL_EMULATOR_H

#include "config.h"
#include <stdint.h>

#define STIFFNESS 0.3e-6     /* N/nm of tendon and robot together: 0.3 N/mm, ExoNav-1 at 0.7 N */
#define SLACK 60e6           /* nm of tendon that hang loose when screw and robot stand at their references */

/* For rehearsals, ExoNav 1 in the hand: nearly taut at the references, softer the further out. The tendon itself, 0.3 m
   of 0.1 mm nitinol, gives 0.51 mm/N; with all of the robot, 75.4 mm, it is the 3.3 mm/N of above. */
#define REHEARSED_SLACK 0.2e6
#define TENDON_GIVES 0.51e6  /* nm/N */
#define ROBOT_GIVES 2.8e6    /* nm/N, of the whole robot; in proportion to what is out */
#define ROBOT_LENGTH 75.4e6  /* nm */
#define COUNTS_PER_NEWTON 1349.0
#define COUNTS_AT_ZERO 32768.0

typedef struct {
    double position[AXES], velocity[AXES];   /* true ones, nm and nm/s or urad and urad/s */
    double driven[AXES];                     /* what hal_drive asked for */
    double powered_at[AXES];                 /* where the encoders began to count */
    double travelled[AXES];                  /* sum of all movement, either way */
    int jammed;                              /* axis that does not move, -1 for none */
    int dead, stuck;                         /* axis whose reference switch is never, always pressed, -1 for none */
    int32_t encoder;                         /* what the encoders showed at power-up */
    uint32_t micros, noise;
    int is_rehearsal;                        /* the tendon is ExoNav's, see above */
} Plant;

extern Plant plant;

void plant_start(void);
void plant_advance(void);  /* by one tick; time itself is the caller's */
void plant_rehearse(void); /* ExoNav's tendon; screw and robot begin a few millimetres from their references, slack */

/* Where hal_send writes. */
extern void (*plant_output)(const char *text, unsigned length);

#endif
