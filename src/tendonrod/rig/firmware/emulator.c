/* The board in a process of its own, on a pseudo-terminal in real time, or from standard input in simulated time.

   emulator [--stdio] [--homed] [--jam AXIS] [--dead AXIS] [--stuck AXIS] [--encoder N] [--clock US] [--mute]
            [--watchdog MS] [--firmware NAME] [--protocol N] [--noise N SEED] [--rehearsal]

   On a pseudo-terminal the first line of standard output is its name; the process ends when its standard input does.
   SIGUSR1 restarts the board. --stdio: a millisecond passes with every newline, and a last line on standard error tells
   what was moved. --homed: the axes begin homed, in mid-travel, the tendon just taut. --dead, --stuck: the
   axis's reference switch is never, always pressed. --encoder: what all show at power-up. --clock: what it shows then,
   with --stdio. --noise: one byte in N, either way, has a bit flipped. --rehearsal: the tendon is ExoNav 1's, nearly taut
   at the references. */
#define _DEFAULT_SOURCE
#define _XOPEN_SOURCE 600
#include "board.h"
#include "hal.h"
#include "hal_emulator.h"
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#define LONGEST_PAUSE 1000u  /* ticks made up for after the process was held up; more are left out */

static Board board;
static int line = STDOUT_FILENO;
static unsigned long noise_every, noise_state;
static bool is_mute;
static const char *firmware = FIRMWARE;
static int protocol = PROTOCOL, jammed = -1, dead = -1, stuck = -1, watchdog_ms = WATCHDOG_US / 1000;
static int32_t encoder;
static uint32_t clock_at;
static volatile sig_atomic_t wants_restart;

static unsigned long chance(void)
{
    noise_state = (noise_state * 1103515245ul + 12345ul) & 0x7FFFFFFFul;
    return noise_state >> 8;
}

static char disturbed(char byte)
{
    if (noise_every == 0 || chance() % noise_every != 0)
        return byte;
    return (char)((unsigned char)byte ^ (1u << (chance() % 8u)));
}

static void send_out(const char *text, unsigned length)
{
    char copy[ANSWER_LONGEST];
    for (unsigned i = 0; i < length; i++)
        copy[i] = disturbed(text[i]);
    if (!is_mute && write(line, copy, length) < 0)
        return;  /* nobody listens: the answer is lost, as on a wire */
}

static void start(void)
{
    board_start(&board);
    board.firmware = firmware;
    board.protocol = protocol;
    board.watchdog = (uint32_t)watchdog_ms * 1000u;
    plant.jammed = jammed;
    plant.dead = dead;
    plant.stuck = stuck;
}

static void assume_homed(void)
{
    static const double middle[AXES] = {-30e6, 30e6, 0.0};
    for (int i = 0; i < AXES; i++) {
        plant.position[i] = plant.powered_at[i] = middle[i];
        motion_start(&board.axes[i], i);
        board.axes[i].zero = (int32_t)((uint32_t)plant.encoder - (uint32_t)(int32_t)middle[i]);
        board.axes[i].is_homed = true;
    }
}

static void tick(void)
{
    plant_advance();
    board_tick(&board);
}

static int run_stdio(void)
{
    int byte;
    while ((byte = getchar()) != EOF) {
        board_receive(&board, disturbed((char)byte));
        if (byte == '\n') {
            plant.micros += TICK_US;
            tick();
        }
    }
    fprintf(stderr, "moves %lu errors %lu travelled %.0f %.0f %.0f\n", (unsigned long)board.moves,
            (unsigned long)board.errors, plant.travelled[0], plant.travelled[1], plant.travelled[2]);
    return 0;
}

static int open_terminal(void)
{
    struct termios raw;
    int master = posix_openpt(O_RDWR | O_NOCTTY), slave;
    if (master < 0 || grantpt(master) < 0 || unlockpt(master) < 0)
        return -1;
    slave = open(ptsname(master), O_RDWR | O_NOCTTY);
    if (slave < 0 || tcgetattr(slave, &raw) < 0)
        return -1;
    cfmakeraw(&raw);
    if (tcsetattr(slave, TCSANOW, &raw) < 0 || fcntl(master, F_SETFL, O_NONBLOCK) < 0)
        return -1;
    printf("%s\n", ptsname(master));
    fflush(stdout);
    close(slave);
    return master;
}

static uint32_t now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (uint32_t)((uint64_t)time.tv_sec * 1000000u + (uint64_t)time.tv_nsec / 1000u);
}

static void receive(void)
{
    char bytes[512];
    ssize_t count = read(line, bytes, sizeof bytes);
    plant.micros = now();
    for (ssize_t i = 0; i < count; i++)
        board_receive(&board, disturbed(bytes[i]));
}

/* Input before ticks: a process that was held up must not let the watchdog bite on commands that wait to be read. */
static int run_terminal(void)
{
    struct pollfd sources[2] = {{.fd = line, .events = POLLIN}, {.fd = STDIN_FILENO, .events = POLLIN}};
    uint32_t ticked = now();
    for (;;) {
        char ignored[64];
        poll(sources, 2, 1);
        if (sources[0].revents & POLLIN)
            receive();
        else if (sources[0].revents)
            usleep(TICK_US);  /* nobody has opened the terminal */
        if (sources[1].revents && read(STDIN_FILENO, ignored, sizeof ignored) <= 0)
            return 0;
        plant.micros = now();
        if (plant.micros - ticked > LONGEST_PAUSE * TICK_US)
            ticked = plant.micros - LONGEST_PAUSE * TICK_US;
        for (; plant.micros - ticked >= TICK_US; ticked += TICK_US)
            tick();
        if (wants_restart) {
            wants_restart = 0;
            start();
        }
    }
}

static void ask_restart(int signal) { wants_restart = signal; }

static int usage(const char *word)
{
    fprintf(stderr, "emulator: cannot use %s\n", word);
    return 2;
}

int main(int count, char **words)
{
    bool is_homed = false, is_stdio = false, is_rehearsal = false;
    plant_output = send_out;
    for (int i = 1; i < count; i++) {
        const char *word = words[i];
        if (strcmp(word, "--stdio") == 0)
            is_stdio = true;
        else if (strcmp(word, "--homed") == 0)
            is_homed = true;
        else if (strcmp(word, "--mute") == 0)
            is_mute = true;
        else if (strcmp(word, "--rehearsal") == 0)
            is_rehearsal = true;
        else if (strcmp(word, "--jam") == 0 && i + 1 < count)
            jammed = atoi(words[++i]) - 1;
        else if (strcmp(word, "--dead") == 0 && i + 1 < count)
            dead = atoi(words[++i]) - 1;
        else if (strcmp(word, "--stuck") == 0 && i + 1 < count)
            stuck = atoi(words[++i]) - 1;
        else if (strcmp(word, "--encoder") == 0 && i + 1 < count)
            encoder = (int32_t)atol(words[++i]);
        else if (strcmp(word, "--clock") == 0 && i + 1 < count)
            clock_at = (uint32_t)strtoul(words[++i], NULL, 10);
        else if (strcmp(word, "--firmware") == 0 && i + 1 < count)
            firmware = words[++i];
        else if (strcmp(word, "--protocol") == 0 && i + 1 < count)
            protocol = atoi(words[++i]);
        else if (strcmp(word, "--watchdog") == 0 && i + 1 < count)
            watchdog_ms = atoi(words[++i]);
        else if (strcmp(word, "--noise") == 0 && i + 2 < count)
            noise_every = strtoul(words[++i], NULL, 10), noise_state = strtoul(words[++i], NULL, 10);
        else
            return usage(word);
    }
    plant_start();
    if (is_rehearsal)
        plant_rehearse();
    plant.encoder = encoder;
    plant.micros = clock_at;
    start();
    if (is_homed)
        assume_homed();
    if (is_stdio)
        return run_stdio();
    signal(SIGUSR1, ask_restart);
    line = open_terminal();
    return line < 0 ? usage("a pseudo-terminal") : run_terminal();
}
