/* All that the firmware wants of the hardware. Nothing here may block.
   The firmware itself is single-threaded: call board_receive and board_tick from one loop, and let interrupts only fill
   a receive buffer and count milliseconds. chars may be wider than 8 bits (they have 16 on a C28x): nothing in the
   portable files needs uint8_t, floating point or the heap. */
#ifndef HAL_H
#define HAL_H

#include <stdint.h>

#define SWITCH_LOW 1u   /* end switch at the low end is pressed */
#define SWITCH_HIGH 2u  /* at the high end */
#define SWITCH_HOME 4u  /* reference switch; may be one of the two */

/* Time since power-up, us; wraps around after 71 minutes. */
uint32_t hal_micros(void);

/* Encoder since power-up, nm or urad. */
int32_t hal_position(int axis);

/* The SWITCH_ bits that are pressed. */
unsigned hal_switches(int axis);

/* Velocity that the motor's own speed loop must follow from now on, nm/s or urad/s; 0 holds the axis. */
void hal_drive(int axis, int32_t velocity);

/* The newest reading of the load cell, counts. */
int32_t hal_load_cell(void);

/* Queue a line for sending; all of it or, where there is no room, nothing. */
void hal_send(const char *text, unsigned length);

#endif
