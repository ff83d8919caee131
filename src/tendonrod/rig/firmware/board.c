#include "board.h"
#include "hal.h"
#include <stddef.h>
#include <string.h>

/* A command's action: reads its arguments, checks all of them, and only then acts and writes its answer. NULL when done,
   else the code of the error, and nothing has changed. */
typedef const char *(*Action)(Board *board, const char *arguments, LineWriter *answer);

static void send_error(Board *board, LineWriter *answer, const char *code)
{
    write_text(answer, " ERR ");
    write_text(answer, code);
    write_seal(answer);
    hal_send(answer->text, answer->length);
    board->errors++;
}

/* A line whose sequence number cannot be trusted. */
static void refuse(Board *board, const char *code)
{
    LineWriter answer = {.length = 0};
    write_text(&answer, "<-");
    send_error(board, &answer, code);
}

static bool is_homing(const Board *board)
{
    return board->axes[0].homing || board->axes[1].homing || board->axes[2].homing;
}

static bool is_moving(const Board *board)
{
    for (int i = 0; i < AXES; i++)
        if (motion_is_wanted(&board->axes[i]) || board->axes[i].setpoint != 0)
            return true;
    return false;
}

static void stop_all(Board *board)
{
    for (int i = 0; i < AXES; i++)
        motion_stop(&board->axes[i]);
}

static uint32_t flags_of(const Motion *axis)
{
    int limit = motion_at_limit(axis);
    return (axis->is_homed ? FLAG_HOMED : 0) | (limit < 0 ? FLAG_LOW : 0) | (limit > 0 ? FLAG_HIGH : 0)
           | (axis->is_stalled ? FLAG_STALLED : 0) | (axis->homing ? FLAG_HOMING : 0)
           | (axis->has_failed_homing ? FLAG_HOME_FAILED : 0);
}

static void write_state(const Board *board, LineWriter *answer)
{
    uint32_t flags = board->is_timed_out ? FLAG_WATCHDOG : 0;
    write_unsigned(answer, hal_micros());
    for (int i = 0; i < AXES; i++)
        write_number(answer, motion_position(&board->axes[i]));
    for (int i = 0; i < AXES; i++)
        write_number(answer, motion_velocity(&board->axes[i]));
    for (int i = 0; i < AXES; i++)
        flags |= flags_of(&board->axes[i]) << i;
    write_number(answer, hal_load_cell());
    write_text(answer, " ");
    write_hex(answer, flags, 6);
    write_unsigned(answer, board->done);
}

static const char *hello(Board *board, const char *arguments, LineWriter *answer)
{
    if (*arguments)
        return "SYNTAX";
    stop_all(board);
    board->is_greeted = true;
    board->is_timed_out = false;
    write_text(answer, " ");
    write_text(answer, board->firmware);
    write_text(answer, " " VERSION);
    write_number(answer, board->protocol);
    return NULL;
}

static const char *limits(Board *board, const char *arguments, LineWriter *answer)
{
    if (*arguments)
        return "SYNTAX";
    for (int i = 0; i < AXES; i++) {
        write_number(answer, axis_config[i].low);
        write_number(answer, axis_config[i].high);
        write_number(answer, axis_config[i].speed);
        write_number(answer, axis_config[i].acceleration);
    }
    write_number(answer, ADC_LOW);
    write_number(answer, ADC_HIGH);
    write_unsigned(answer, board->watchdog);
    return NULL;
}

static const char *ping(Board *board, const char *arguments, LineWriter *answer)
{
    (void)board, (void)answer;
    return *arguments ? "SYNTAX" : NULL;
}

static const char *read_state(Board *board, const char *arguments, LineWriter *answer)
{
    if (*arguments)
        return "SYNTAX";
    write_state(board, answer);
    return NULL;
}

static const char *stop(Board *board, const char *arguments, LineWriter *answer)
{
    if (*arguments)
        return "SYNTAX";
    stop_all(board);
    board->is_timed_out = false;
    board->done = board->sequence;
    write_state(board, answer);
    return NULL;
}

static const char *home(Board *board, const char *arguments, LineWriter *answer)
{
    int32_t axis;
    if (!read_number(&arguments, &axis) || *arguments)
        return "SYNTAX";
    if (axis < 1 || axis > AXES)
        return "RANGE";
    if (board->is_timed_out)
        return "WATCHDOG";
    if (is_moving(board))
        return "BUSY";
    motion_home(&board->axes[axis - 1]);
    board->done = board->sequence;
    board->fed = hal_micros();
    write_state(board, answer);
    return NULL;
}

static const char *refusal_of_move(const Board *board, const int32_t velocity[AXES])
{
    for (int i = 0; i < AXES; i++) {
        if (velocity[i] > axis_config[i].speed || velocity[i] < -axis_config[i].speed)
            return "RANGE";
        if (velocity[i] != 0 && !board->axes[i].is_homed)
            return "HOME";
    }
    if (board->is_timed_out)
        return "WATCHDOG";
    return is_homing(board) ? "BUSY" : NULL;
}

static const char *move(Board *board, const char *arguments, LineWriter *answer)
{
    int32_t velocity[AXES];
    const char *refusal;
    for (int i = 0; i < AXES; i++)
        if (!read_number(&arguments, &velocity[i]))
            return "SYNTAX";
    if (*arguments)
        return "SYNTAX";
    refusal = refusal_of_move(board, velocity);
    if (refusal)
        return refusal;
    for (int i = 0; i < AXES; i++)
        motion_target(&board->axes[i], velocity[i]);
    board->done = board->sequence;
    board->fed = hal_micros();
    board->moves++;
    write_state(board, answer);
    return NULL;
}

static const struct {
    const char *name;
    Action action;
} commands[] = {
    {"HELLO", hello}, {"LIMITS", limits}, {"HOME", home}, {"MOVE", move},
    {"READ", read_state}, {"STOP", stop}, {"PING", ping},
};

/* The action that a text names, which is moved on to its arguments; NULL where there is none. */
static Action find_action(const char **text)
{
    size_t length = strcspn(*text, " ");
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++)
        if (strlen(commands[i].name) == length && strncmp(*text, commands[i].name, length) == 0) {
            *text += length;
            return commands[i].action;
        }
    return NULL;
}

/* ">SEQ " with SEQ in its only form; text is moved on to the command's name. */
static bool read_sequence(char *line, const char **text, int32_t *sequence)
{
    line[0] = ' ';  /* so that the number begins as every other does */
    *text = line;
    return read_number(text, sequence) && *sequence >= 0 && *sequence <= 65535 && *(*text)++ == ' ';
}

/* Newer than the last one, modulo 65536; HELLO begins anew with any. */
static bool is_new(const Board *board, uint16_t sequence)
{
    uint16_t ahead = (uint16_t)((sequence - board->sequence) & 0xFFFF);
    return ahead >= 1 && ahead <= 32767;
}

static const char *perform(Board *board, const char *text, uint16_t sequence, LineWriter *answer)
{
    Action action = find_action(&text);
    if (action != hello && !board->is_greeted)
        return "HELLO";
    if (action != hello && !is_new(board, sequence))
        return "SEQUENCE";
    if (action == NULL)
        return "COMMAND";
    board->sequence = sequence;
    if (is_homing(board))
        board->fed = hal_micros();  /* the host that waits for homing only reads; elsewhere nothing but MOVE will do */
    return action(board, text, answer);
}

static void answer_line(Board *board)
{
    LineWriter answer = {.length = 0};
    const char *text, *error;
    int32_t sequence;
    unsigned before;
    if (!line_unseal(&board->reader)) {
        refuse(board, "CRC");
        return;
    }
    if (!read_sequence(board->reader.text, &text, &sequence)) {
        refuse(board, "SYNTAX");
        return;
    }
    write_text(&answer, "<");
    write_decimal(&answer, (uint32_t)sequence);
    before = answer.length;
    write_text(&answer, " OK");
    error = perform(board, text, (uint16_t)sequence, &answer);
    if (error) {
        answer.length = before;
        send_error(board, &answer, error);
        return;
    }
    write_seal(&answer);
    hal_send(answer.text, answer.length);
}

void board_start(Board *board)
{
    *board = (Board){.firmware = FIRMWARE, .protocol = PROTOCOL, .watchdog = WATCHDOG_US};
    for (int i = 0; i < AXES; i++)
        motion_start(&board->axes[i], i);
}

void board_receive(Board *board, char byte)
{
    switch (line_receive(&board->reader, byte)) {
    case LINE_READY: answer_line(board); break;
    case LINE_FRAME: refuse(board, "FRAME"); break;
    case LINE_LENGTH: refuse(board, "LENGTH"); break;
    case LINE_PENDING: break;
    }
}

void board_tick(Board *board)
{
    bool is_wanted = false;
    for (int i = 0; i < AXES; i++)
        is_wanted = is_wanted || motion_is_wanted(&board->axes[i]);
    if (is_wanted && hal_micros() - board->fed > board->watchdog) {
        stop_all(board);
        board->is_timed_out = true;
    }
    for (int i = 0; i < AXES; i++)
        motion_tick(&board->axes[i]);
}
