/* The board: commands in, answers out, watchdog. Protocol: docs/bench_protocol.rst of tendonrod. */
#ifndef BOARD_H
#define BOARD_H

#include "line.h"
#include "motion.h"

/* Bits of the state's flags; those of an axis are FLAG_... << axis. */
#define FLAG_HOMED 0x1ul
#define FLAG_LOW 0x8ul
#define FLAG_HIGH 0x40ul
#define FLAG_STALLED 0x200ul
#define FLAG_HOMING 0x1000ul
#define FLAG_HOME_FAILED 0x8000ul
#define FLAG_WATCHDOG 0x40000ul

typedef struct {
    const char *firmware;
    int protocol;
    uint32_t watchdog;       /* us */
    LineReader reader;
    Motion axes[AXES];
    uint32_t fed;            /* when the watchdog was last satisfied, us */
    uint16_t sequence;       /* of the newest valid command */
    uint16_t done;           /* of the newest MOVE, HOME or STOP that was carried out */
    bool is_greeted, is_timed_out;
    uint32_t moves, errors;  /* MOVEs carried out and lines refused since power-up */
} Board;

void board_start(Board *board);
void board_receive(Board *board, char byte);
void board_tick(Board *board);

#endif
