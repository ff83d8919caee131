#include "motion.h"
#include "hal.h"

#define NEAR 5000  /* nm or urad: an axis this close to the end of its travel is at its limit */

static int64_t magnitude(int64_t value) { return value < 0 ? -value : value; }

static int sign(int64_t value) { return (value > 0) - (value < 0); }

/* Encoders count modulo 2**32: a difference is right as long as it is itself below 2**31, 2.1 m or 341 turns. */
static int32_t difference(int32_t later, int32_t earlier) { return (int32_t)((uint32_t)later - (uint32_t)earlier); }

void motion_start(Motion *motion, int index)
{
    int32_t encoder = hal_position(index);
    *motion = (Motion){.config = &axis_config[index], .index = index, .zero = encoder, .followed_from = encoder};
    for (int i = 0; i < HISTORY; i++)
        motion->history[i] = encoder;
    hal_drive(index, 0);
}

int32_t motion_position(const Motion *motion) { return difference(hal_position(motion->index), motion->zero); }

int32_t motion_velocity(const Motion *motion)
{
    int64_t travel = difference(motion->history[motion->newest], motion->history[(motion->newest + 1) % HISTORY]);
    return (int32_t)(travel * 1000 / (HISTORY - 1));
}

/* Travel that is left in a direction; an axis that is not homed does not know its own. */
static int64_t room(const Motion *motion, int direction)
{
    int64_t position = motion_position(motion);
    return direction > 0 ? motion->config->high * (int64_t)1000 - position : position - motion->config->low * (int64_t)1000;
}

int motion_at_limit(const Motion *motion)
{
    unsigned pressed = hal_switches(motion->index);
    if ((pressed & SWITCH_LOW) || (motion->is_homed && room(motion, -1) <= NEAR))
        return -1;
    return (pressed & SWITCH_HIGH) || (motion->is_homed && room(motion, 1) <= NEAR);
}

/* Twice the braking distance must fit, so that the lag of the motor's own loop does too. v2 <= a (d - v dt). */
static bool can_brake(const Motion *motion, int32_t velocity)
{
    int64_t left = room(motion, sign(velocity)) - magnitude(velocity) / 1000;
    return left > 0 && (int64_t)velocity * velocity <= motion->config->acceleration * (int64_t)1000 * left;
}

/* One tick's change towards a velocity: an acceleration in um/s2 is the same number of nm/s per millisecond. */
static int32_t ramped(const Motion *motion, int32_t velocity)
{
    int32_t step = motion->config->acceleration, change = velocity - motion->setpoint;
    return motion->setpoint + (change > step ? step : change < -step ? -step : change);
}

static bool is_against_switch(const Motion *motion, int32_t velocity)
{
    unsigned pressed = hal_switches(motion->index);
    return (velocity < 0 && (pressed & SWITCH_LOW)) || (velocity > 0 && (pressed & SWITCH_HIGH));
}

static void ramp(Motion *motion)
{
    int32_t wanted = ramped(motion, motion->is_stalled ? 0 : motion->target);
    if (motion->is_homed && wanted != 0 && !can_brake(motion, wanted))
        wanted = sign(wanted) == sign(motion->setpoint) ? ramped(motion, 0) : 0;
    motion->setpoint = wanted;
    if (is_against_switch(motion, motion->setpoint))
        motion->setpoint = 0;
}

static void follow_anew(Motion *motion)
{
    motion->commanded = 0;
    motion->followed_from = hal_position(motion->index);
}

/* Over each stretch of commanded travel the encoder must have gone a quarter of it, in the same direction. */
static void check_stall(Motion *motion)
{
    int64_t gone;
    motion->commanded += motion->setpoint;
    if (magnitude(motion->commanded) < motion->config->follow * (int64_t)1000000)
        return;
    gone = (int64_t)difference(hal_position(motion->index), motion->followed_from) * sign(motion->commanded);
    motion->is_stalled = motion->is_stalled || 4 * gone < motion->config->follow * (int64_t)1000;
    follow_anew(motion);
}

static void fail_homing(Motion *motion)
{
    motion->homing = HOME_NONE;
    motion->target = 0;
    motion->has_failed_homing = true;
}

/* Seek the switch, leave it slowly: the reference is where it lets go; clear it by the back-off, and stop. */
static void advance_homing(Motion *motion)
{
    bool is_pressed = hal_switches(motion->index) & SWITCH_HOME;
    int32_t inward = -motion->config->home_velocity * 1000;
    motion->sought += magnitude(motion->setpoint) / 1000;
    if (motion->is_stalled || motion->sought > 2000 * ((int64_t)motion->config->high - motion->config->low)) {
        fail_homing(motion);
    } else if (motion->homing == HOME_SEEK && is_pressed) {
        motion->homing = HOME_LEAVE;
        motion->target = inward / 4;
    } else if (motion->homing == HOME_LEAVE && !is_pressed) {
        motion->homing = HOME_CLEAR;
        motion->zero = hal_position(motion->index);
        motion->target = inward / 2;
    } else if (motion->homing == HOME_CLEAR && magnitude(motion_position(motion)) >= motion->config->backoff * 1000) {
        motion->target = 0;
        motion->is_homed = motion->setpoint == 0;
        motion->homing = motion->is_homed ? HOME_NONE : HOME_CLEAR;
    } else if (is_against_switch(motion, motion->target)) {
        fail_homing(motion);  /* it stands there for good: the reference switch is dead, or never lets go */
    }
}

void motion_tick(Motion *motion)
{
    motion->newest = (motion->newest + 1) % HISTORY;
    motion->history[motion->newest] = hal_position(motion->index);
    if (motion->homing != HOME_NONE)
        advance_homing(motion);
    check_stall(motion);
    ramp(motion);
    hal_drive(motion->index, motion->setpoint);
}

void motion_target(Motion *motion, int32_t velocity) { motion->target = velocity * 1000; }

void motion_stop(Motion *motion)
{
    motion->target = 0;
    motion->homing = HOME_NONE;
    motion->is_stalled = motion->has_failed_homing = false;
    follow_anew(motion);
}

void motion_home(Motion *motion)
{
    motion_stop(motion);
    motion->is_homed = false;
    motion->sought = 0;
    motion->homing = HOME_SEEK;
    motion->target = motion->config->home_velocity * 1000;
}

bool motion_is_wanted(const Motion *motion) { return motion->target != 0 || motion->homing != HOME_NONE; }
