#include "hal_emulator.h"
#include "hal.h"
#include <math.h>

#define LAG_MS 4.0  /* of the motors' speed loops */

Plant plant;
void (*plant_output)(const char *text, unsigned length);

static const double resolution[AXES] = {20.0, 20.0, 40.0};  /* of the encoders */

void plant_start(void)
{
    static const double at[AXES] = {-1e6, 2e6, 0.2e6};
    plant = (Plant){.jammed = -1, .noise = 1u};
    for (int i = 0; i < AXES; i++)
        plant.position[i] = plant.powered_at[i] = at[i];
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
    return (int32_t)(floor((plant.position[axis] - plant.powered_at[axis]) / resolution[axis]) * resolution[axis]);
}

/* The screw's reference is the end where the tendon is slack, that of translation where the robot is withdrawn, that of
   rotation a mark which a third of a turn covers. End switches stand a millimetre beyond the travel. */
unsigned hal_switches(int axis)
{
    double at = plant.position[axis];
    double low = axis_config[axis].low * 1e3 - 1e6, high = axis_config[axis].high * 1e3 + 1e6;
    if (axis == 0)
        return (at >= 0.0 ? SWITCH_HIGH | SWITCH_HOME : 0u) | (at <= low ? SWITCH_LOW : 0u);
    if (axis == 1)
        return (at <= 0.0 ? SWITCH_LOW | SWITCH_HOME : 0u) | (at >= high ? SWITCH_HIGH : 0u);
    return at <= 0.0 && at > -2.1e6 ? SWITCH_HOME : 0u;
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

int32_t hal_load_cell(void)
{
    double stretch = plant.position[1] - plant.position[0] - SLACK;
    double counts = COUNTS_AT_ZERO + COUNTS_PER_NEWTON * STIFFNESS * (stretch > 0.0 ? stretch : 0.0) + 1.5 * noise();
    return (int32_t)fmax(ADC_LOW, fmin(ADC_HIGH, floor(counts)));
}

void hal_send(const char *text, unsigned length) { plant_output(text, length); }
