#include "hal_emulator.h"
#include "hal.h"
#include <math.h>

#define TURN 6283185.307  /* urad */
#define LAG_MS 4.0  /* of the motors' speed loops */

Plant plant;
void (*plant_output)(const char *text, unsigned length);

static const double resolution[AXES] = {20.0, 20.0, 40.0};  /* of the encoders */

void plant_start(void)
{
    static const double at[AXES] = {-1e6, 2e6, 0.2e6};
    plant = (Plant){.jammed = -1, .dead = -1, .stuck = -1, .noise = 1u};
    for (int i = 0; i < AXES; i++)
        plant.position[i] = plant.powered_at[i] = at[i];
}

void plant_rehearse(void)
{
    plant.is_rehearsal = 1;
    plant.position[0] = plant.powered_at[0] = 2.5e6;
}

void plant_advance(void)
{
    for (int i = 0; i < AXES; i++) {
        double step;
        plant.velocity[i] += (plant.driven[i] - plant.velocity[i]) / LAG_MS;
        step = i == plant.jammed ? 0.0 : plant.velocity[i] * 1e-3;
        plant.position[i] += step;
        plant.travelled[i] += fabs(step);
    }
}

uint32_t hal_micros(void) { return plant.micros; }

int32_t hal_position(int axis)
{
    double travel = floor((plant.position[axis] - plant.powered_at[axis]) / resolution[axis]) * resolution[axis];
    return (int32_t)((uint32_t)plant.encoder + (uint32_t)(int64_t)travel);
}

/* The screw's reference is the end where the tendon is slack, or where its travel goes on beyond that, a cam that is
   pressed from zero down; that of translation is where the robot is withdrawn, that of rotation a mark which a third of
   every turn covers. End switches stand a millimetre beyond the travel. */
static unsigned whole_switches(int axis)
{
    double at = plant.position[axis];
    double low = axis_config[axis].low * 1e3 - 1e6, high = axis_config[axis].high * 1e3 + 1e6;
    if (axis == 0 && axis_config[0].high > 0)
        return (at <= 0.0 ? SWITCH_HOME : 0u) | (at <= low ? SWITCH_LOW : 0u) | (at >= high ? SWITCH_HIGH : 0u);
    if (axis == 0)
        return (at >= 0.0 ? SWITCH_HIGH | SWITCH_HOME : 0u) | (at <= low ? SWITCH_LOW : 0u);
    if (axis == 1)
        return (at <= 0.0 ? SWITCH_LOW | SWITCH_HOME : 0u) | (at >= high ? SWITCH_HIGH : 0u);
    return at - TURN * ceil(at / TURN) > -2.1e6 ? SWITCH_HOME : 0u;
}

unsigned hal_switches(int axis)
{
    unsigned pressed = whole_switches(axis);
    return axis == plant.dead ? pressed & ~SWITCH_HOME : axis == plant.stuck ? pressed | SWITCH_HOME : pressed;
}

void hal_drive(int axis, int32_t velocity) { plant.driven[axis] = velocity; }

/* Sum of twelve uniform numbers, less their mean: close to a normal one of unit variance. */
static double noise(void)
{
    double sum = -6.0;
    for (int i = 0; i < 12; i++) {
        plant.noise = plant.noise * 1664525u + 1013904223u;
        sum += plant.noise / 4294967296.0;
    }
    return sum;
}

static double tension(void)
{
    double stretch = plant.position[1] - plant.position[0] - (plant.is_rehearsal ? REHEARSED_SLACK : SLACK);
    if (stretch <= 0.0)
        return 0.0;
    if (!plant.is_rehearsal)
        return STIFFNESS * stretch;
    return stretch / (TENDON_GIVES + ROBOT_GIVES * fmax(plant.position[1], 0.0) / ROBOT_LENGTH);
}

int32_t hal_load_cell(void)
{
    double counts = COUNTS_AT_ZERO + COUNTS_PER_NEWTON * tension() + 1.5 * noise();
    return (int32_t)fmax(ADC_LOW, fmin(ADC_HIGH, floor(counts)));
}

void hal_send(const char *text, unsigned length) { plant_output(text, length); }
