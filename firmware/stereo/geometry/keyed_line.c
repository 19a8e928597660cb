// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/keyed_line.h"

#include <string.h>

#include "core/crc.h"
#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"

int keyed_refuse(struct keyed_reader *reader, int code, const char *field, const char *reason) {
    INVARIANT(code < 0 && field != NULL && reason != NULL);
    reader->fault.line = reader->line;
    reader->fault.field = field;
    reader->fault.reason = reason;
    return code;
}

bool keyed_span_is(struct keyed_span span, const char *word) {
    INVARIANT(span.text != NULL && word != NULL);
    return span.length == strlen(word) && memcmp(span.text, word, span.length) == 0;
}

int keyed_next_line(struct keyed_reader *reader, struct keyed_span *line) {
    INVARIANT(reader->position <= reader->length);
    reader->line++;
    const char *begin = reader->text + reader->position;
    const size_t left = reader->length - reader->position;
    if (left == 0) {
        return keyed_refuse(reader, ERROR_MISSING, "", "unexpected end of the text");
    }
    size_t length = 0;
    for (; length < left && begin[length] != '\n'; length++) {
        const char c = begin[length];
        if (c == '\r') {
            return keyed_refuse(reader, ERROR_SYNTAX, "",
                                "lines must end in LF, not CR LF (convert the line ends)");
        }
        if (c < ' ' || c > '~') {
            return keyed_refuse(reader, ERROR_SYNTAX, "",
                                "only printable ASCII characters are allowed");
        }
    }
    if (length == left) {
        return keyed_refuse(reader, ERROR_SYNTAX, "", "the last line has no line feed");
    }
    *line = (struct keyed_span){begin, length};
    reader->position += length + 1;
    return ERROR_OK;
}

struct keyed_span keyed_cut_word(struct keyed_span *rest, bool *more) {
    size_t length = 0;
    while (length < rest->length && rest->text[length] != ' ') {
        length++;
    }
    const struct keyed_span word = {rest->text, length};
    *more = length < rest->length;
    const size_t cut = *more ? length + 1 : length;
    rest->text += cut;
    rest->length -= cut;
    return word;
}

int keyed_copy_text(struct keyed_reader *reader, const char *field, struct keyed_span value,
                    char *target, size_t size) {
    INVARIANT(size > 0 && target != NULL);
    if (value.length >= size) {
        return keyed_refuse(reader, ERROR_SYNTAX, field, "the text is too long");
    }
    memcpy(target, value.text, value.length);
    memset(target + value.length, 0, size - value.length);
    return ERROR_OK;
}

int keyed_parse_number(struct keyed_reader *reader, const char *name, struct keyed_span *values,
                       bool *more, int decimals, int64_t min, int64_t max, double *value) {
    INVARIANT(decimals >= 0 && min <= max);
    if (!*more) {
        return keyed_refuse(reader, ERROR_SYNTAX, name, "too few values");
    }
    const struct keyed_span word = keyed_cut_word(values, more);
    int64_t scaled;
    const int code = decimal_parse(word.text, word.length, decimals, &scaled);
    if (code == ERROR_SYNTAX) {
        return keyed_refuse(reader, code, name,
                            "not a number with the field's fixed count of decimals");
    }
    if (code != ERROR_OK) {
        return keyed_refuse(reader, ERROR_RANGE, name, "");
    }
    *value = decimal_to_double(scaled, decimals);
    return *value < (double)min || *value > (double)max
               ? keyed_refuse(reader, ERROR_RANGE, name, "")
               : ERROR_OK;
}

// Eight lower-case hexadecimal digits.
static bool parse_hex(struct keyed_span word, uint32_t *value) {
    if (word.length != 8) {
        return false;
    }
    uint32_t sum = 0;
    for (size_t i = 0; i < word.length; i++) {
        const char c = word.text[i];
        if (c >= '0' && c <= '9') {
            sum = sum << 4 | (uint32_t)(c - '0');
        } else if (c >= 'a' && c <= 'f') {
            sum = sum << 4 | (uint32_t)(c - 'a' + 10);
        } else {
            return false;
        }
    }
    *value = sum;
    return true;
}

int keyed_parse_crc(struct keyed_reader *reader, struct keyed_span *name) {
    INVARIANT(reader->position <= reader->length);
    *name = (struct keyed_span){"", 0};
    const uint32_t crc = crc_update(0, reader->text, reader->position);
    struct keyed_span rest;
    const int code = keyed_next_line(reader, &rest);
    if (code != ERROR_OK) {
        reader->fault.field = KEYED_LINE_CRC;
        return code;
    }
    bool more;
    const struct keyed_span word = keyed_cut_word(&rest, &more);
    if (!keyed_span_is(word, KEYED_LINE_CRC)) {
        *name = word;
        return keyed_refuse(reader, ERROR_MISSING, KEYED_LINE_CRC, "the field is missing here");
    }
    uint32_t stated;
    if (!more || !parse_hex(rest, &stated)) {
        return keyed_refuse(reader, ERROR_SYNTAX, KEYED_LINE_CRC,
                            "must be eight lower-case hexadecimal digits");
    }
    if (reader->position != reader->length) {
        return keyed_refuse(reader, ERROR_SYNTAX, KEYED_LINE_CRC, "text after the checksum");
    }
    if (stated != crc) {
        reader->fault.crc = crc;
        return keyed_refuse(reader, ERROR_CRC, KEYED_LINE_CRC, "");
    }
    return ERROR_OK;
}

void keyed_put(struct keyed_writer *writer, const char *word) {
    INVARIANT(writer->text != NULL || writer->size == 0);
    const size_t length = strlen(word);
    if (writer->length + length < writer->size) {
        memcpy(writer->text + writer->length, word, length + 1);
    }
    writer->length += length;
}

void keyed_put_value(struct keyed_writer *writer, const char *word) {
    keyed_put(writer, " ");
    keyed_put(writer, word);
}

void keyed_put_known(struct keyed_writer *writer, const char *text) {
    keyed_put_value(writer, text[0] != '\0' ? text : KEYED_LINE_UNKNOWN);
}

void keyed_put_number(struct keyed_writer *writer, int decimals, double value) {
    int64_t scaled;
    const int code = decimal_from_double(value, decimals, &scaled);
    INVARIANT(code == ERROR_OK);  // the ranges of the grammar fit
    char text[DECIMAL_TEXT_BYTES];
    decimal_print(scaled, decimals, text);
    keyed_put_value(writer, text);
}

int keyed_put_crc(struct keyed_writer *writer) {
    if (writer->length >= writer->size) {
        return ERROR_BUFFER;
    }
    const uint32_t crc = crc_update(0, writer->text, writer->length);
    char digits[9];
    for (int i = 0; i < 8; i++) {
        digits[i] = "0123456789abcdef"[crc >> (28 - 4 * i) & 15];
    }
    digits[8] = '\0';
    INVARIANT(writer->text[writer->length - 1] == '\n');
    keyed_put(writer, KEYED_LINE_CRC);
    keyed_put_value(writer, digits);
    keyed_put(writer, "\n");
    return writer->length < writer->size ? (int)writer->length : ERROR_BUFFER;
}
