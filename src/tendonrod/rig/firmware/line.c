#include "line.h"

uint16_t crc16(const char *text, unsigned length)
{
    uint_fast16_t crc = 0xFFFFu;
    for (unsigned i = 0; i < length; i++) {
        crc ^= (uint_fast16_t)(((unsigned)text[i] & 0xFFu) << 8);
        for (int bit = 0; bit < 8; bit++)
            crc = ((crc & 0x8000u) ? (crc << 1) ^ 0x1021u : crc << 1) & 0xFFFFu;
    }
    return (uint16_t)crc;
}

static void begin(LineReader *reader)
{
    reader->length = 0;
    reader->is_broken = reader->is_too_long = false;
}

static LineResult finish(LineReader *reader)
{
    bool is_empty = reader->length == 0 && !reader->is_broken;
    bool is_framed = reader->text[0] == '>' && !reader->is_broken;
    bool is_too_long = reader->is_too_long;
    reader->text[reader->length] = '\0';
    if (is_empty)
        return LINE_PENDING;  /* a newline by itself: how a host clears what noise has left here */
    if (is_too_long)
        return LINE_LENGTH;
    return is_framed ? LINE_READY : LINE_FRAME;
}

LineResult line_receive(LineReader *reader, char byte)
{
    unsigned code = (unsigned)byte & 0xFFu;
    if (code == '\n') {
        LineResult result = finish(reader);
        if (result != LINE_READY)
            begin(reader);
        return result;
    }
    if (code == '>')  /* always a new line: a command is heard whatever noise came before it */
        begin(reader);
    if (code < 0x20u || code > 0x7Eu)
        reader->is_broken = true;
    else if (reader->length < LINE_LONGEST)
        reader->text[reader->length++] = (char)code;
    else
        reader->is_too_long = true;
    return LINE_PENDING;
}

static int hex_digit(char letter)
{
    if (letter >= '0' && letter <= '9')
        return letter - '0';
    return letter >= 'A' && letter <= 'F' ? letter - 'A' + 10 : -1;
}

bool line_unseal(LineReader *reader)
{
    unsigned length = reader->length;
    uint_fast16_t told = 0;
    begin(reader);  /* the text stays until the next byte comes */
    if (length < 6 || reader->text[length - 5] != '*')
        return false;
    for (unsigned i = length - 4; i < length; i++) {
        int digit = hex_digit(reader->text[i]);
        if (digit < 0)
            return false;
        told = (told << 4) | (uint_fast16_t)digit;
    }
    reader->text[length - 5] = '\0';
    return told == crc16(reader->text, length - 5);
}

bool read_number(const char **at, int32_t *value)
{
    const char *text = *at;
    bool is_negative;
    int32_t number = 0;
    int digits = 0;
    if (*text++ != ' ')
        return false;
    is_negative = *text == '-';
    text += is_negative;
    if (*text == '0' && (is_negative || (text[1] >= '0' && text[1] <= '9')))
        return false;
    for (; *text >= '0' && *text <= '9'; text++) {
        if (++digits > 9)
            return false;
        number = number * 10 + (*text - '0');
    }
    *at = text;
    *value = is_negative ? -number : number;
    return digits > 0;
}

static void put(LineWriter *writer, char letter)
{
    if (writer->length < ANSWER_LONGEST)
        writer->text[writer->length++] = letter;
}

void write_text(LineWriter *writer, const char *text)
{
    while (*text)
        put(writer, *text++);
}

void write_decimal(LineWriter *writer, uint32_t value)
{
    char digits[10];
    int count = 0;
    do
        digits[count++] = (char)('0' + (int)(value % 10u));
    while (value /= 10u);
    while (count > 0)
        put(writer, digits[--count]);
}

void write_unsigned(LineWriter *writer, uint32_t value)
{
    put(writer, ' ');
    write_decimal(writer, value);
}

void write_number(LineWriter *writer, int32_t value)
{
    put(writer, ' ');
    if (value < 0)
        put(writer, '-');
    write_decimal(writer, value < 0 ? 0u - (uint32_t)value : (uint32_t)value);
}

void write_hex(LineWriter *writer, uint32_t value, int digits)
{
    while (digits-- > 0)
        put(writer, "0123456789ABCDEF"[(value >> (4 * digits)) & 0xFu]);
}

void write_seal(LineWriter *writer)
{
    uint16_t crc = crc16(writer->text, writer->length);
    put(writer, '*');
    write_hex(writer, crc, 4);
    put(writer, '\n');
}
