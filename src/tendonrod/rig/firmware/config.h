/* What differs from bench to bench: identity, travel, speeds, watchdog. config.c holds the numbers. */
#ifndef CONFIG_H
#define CONFIG_H

#include <stdint.h>

#define FIRMWARE "tendonrod-bench"
#define VERSION "1.0.0"
#define PROTOCOL 1

#define AXES 3              /* 0 lead screw, 1 translation, 2 rotation */
#define TICK_US 1000        /* the HAL calls board_tick this often; motion.c counts on one millisecond */
#define WATCHDOG_US 100000  /* without a command for this long, axes that move are stopped */
#define ADC_LOW 0           /* load-cell counts at and beyond these are saturated */
#define ADC_HIGH 65535

/* Units: um, um/s, um/s2 for the linear axes; mrad, mrad/s, mrad/s2 for rotation. Inside, everything is a thousandth of
   these, so that an axis of either kind is the same code. */
typedef struct {
    int32_t low, high;      /* travel, from the reference position */
    int32_t speed;          /* largest */
    int32_t acceleration;   /* of every change of speed, stops included */
    int32_t home_velocity;  /* towards the reference switch, signed */
    int32_t backoff;        /* how far homing leaves the switch */
    int32_t follow;         /* stalled when the encoder shows less than a quarter of this much commanded travel */
} AxisConfig;

extern const AxisConfig axis_config[AXES];

#endif
