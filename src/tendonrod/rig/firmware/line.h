/* Lines: framing of what comes in, writing of what goes out, checksum and numbers of both. */
#ifndef LINE_H
#define LINE_H

#include <stdbool.h>
#include <stdint.h>

#define LINE_LONGEST 64     /* characters of a command before its newline */
#define ANSWER_LONGEST 256  /* characters of an answer, newline included */

typedef enum { LINE_PENDING, LINE_READY, LINE_FRAME, LINE_LENGTH } LineResult;

typedef struct {
    char text[LINE_LONGEST + 1];
    unsigned length;
    bool is_broken, is_too_long;
} LineReader;

typedef struct {
    char text[ANSWER_LONGEST];
    unsigned length;
} LineWriter;

/* CRC-16/CCITT-FALSE: polynomial 0x1021, initial value 0xFFFF; 0x29B1 for "123456789". */
uint16_t crc16(const char *text, unsigned length);

/* Take one byte. LINE_READY: text holds a line, without newline; the other results but LINE_PENDING end a bad one. */
LineResult line_receive(LineReader *reader, char byte);

/* Whether the line ends in the right checksum, which is cut off. */
bool line_unseal(LineReader *reader);

/* Read a space and a whole number of at most nine digits in its only form: no plus, no leading zero, no minus zero. */
bool read_number(const char **at, int32_t *value);

void write_text(LineWriter *writer, const char *text);
void write_decimal(LineWriter *writer, uint32_t value);
void write_unsigned(LineWriter *writer, uint32_t value);  /* after a space */
void write_number(LineWriter *writer, int32_t value);     /* the same, with its sign */
void write_hex(LineWriter *writer, uint32_t value, int digits);
void write_seal(LineWriter *writer);  /* checksum and newline */

#endif
