/* One axis: ramp of its velocity, travel, homing, stall. Whole numbers, nm and nm/s or urad and urad/s. */
#ifndef MOTION_H
#define MOTION_H

#include "config.h"
#include <stdbool.h>
#include <stdint.h>

#define HISTORY 16  /* ticks over which the encoder's velocity is taken */

typedef enum { HOME_NONE, HOME_SEEK, HOME_LEAVE, HOME_CLEAR } Homing;

typedef struct {
    const AxisConfig *config;
    int index;
    int32_t zero;                    /* encoder at the reference position */
    int32_t target, setpoint;        /* velocity wanted, and what the ramp allows now */
    int32_t history[HISTORY];        /* encoder at the last ticks */
    unsigned newest;
    int32_t followed_from;           /* encoder where the stall check began */
    int64_t commanded;               /* travel commanded since then, thousandths of nm or urad */
    int64_t sought;                  /* travel of the homing so far */
    Homing homing;
    bool is_homed, is_stalled, has_failed_homing;
} Motion;

void motion_start(Motion *motion, int index);
void motion_tick(Motion *motion);                     /* once a millisecond */
void motion_target(Motion *motion, int32_t velocity); /* um/s or mrad/s, within the axis's speed */
void motion_stop(Motion *motion);                     /* also ends homing and forgives a stall */
void motion_home(Motion *motion);
int32_t motion_position(const Motion *motion);        /* from the reference position */
int32_t motion_velocity(const Motion *motion);        /* by the encoder */
int motion_at_limit(const Motion *motion);            /* -1, 0, 1 */
bool motion_is_wanted(const Motion *motion);          /* whether a command or homing wants it to move */

#endif
