// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/calibration_text.h"

#include <string.h>

#include "core/crc.h"
#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"
#include "stereo/geometry/calibration_grammar.h"

int calibration_refuse(struct calibration_reader *reader, int code, const char *field,
                       const char *reason) {
    INVARIANT(code < 0 && field != NULL && reason != NULL);
    reader->fault.line = reader->line;
    reader->fault.field = field;
    reader->fault.reason = reason;
    return code;
}

bool calibration_span_is(struct calibration_span span, const char *word) {
    INVARIANT(span.text != NULL && word != NULL);
    return span.length == strlen(word) && memcmp(span.text, word, span.length) == 0;
}

int calibration_next_line(struct calibration_reader *reader, struct calibration_span *line) {
    INVARIANT(reader->position <= reader->length);
    reader->line++;
    const char *begin = reader->text + reader->position;
    const size_t left = reader->length - reader->position;
    if (left == 0) {
        return calibration_refuse(reader, ERROR_MISSING, "", "unexpected end of the text");
    }
    size_t length = 0;
    for (; length < left && begin[length] != '\n'; length++) {
        const char c = begin[length];
        if (c == '\r') {
            return calibration_refuse(reader, ERROR_SYNTAX, "",
                                      "lines must end in LF, not CR LF (convert the line ends)");
        }
        if (c < ' ' || c > '~') {
            return calibration_refuse(reader, ERROR_SYNTAX, "",
                                      "only printable ASCII characters are allowed");
        }
    }
    if (length == left) {
        return calibration_refuse(reader, ERROR_SYNTAX, "", "the last line has no line feed");
    }
    *line = (struct calibration_span){begin, length};
    reader->position += length + 1;
    return ERROR_OK;
}

struct calibration_span calibration_cut_word(struct calibration_span *rest, bool *more) {
    size_t length = 0;
    while (length < rest->length && rest->text[length] != ' ') {
        length++;
    }
    const struct calibration_span word = {rest->text, length};
    *more = length < rest->length;
    const size_t cut = *more ? length + 1 : length;
    rest->text += cut;
    rest->length -= cut;
    return word;
}

int calibration_copy_text(struct calibration_reader *reader, const char *field,
                          struct calibration_span value, char *target, size_t size) {
    INVARIANT(size > 0 && target != NULL);
    if (value.length >= size) {
        return calibration_refuse(reader, ERROR_SYNTAX, field, "the text is too long");
    }
    memcpy(target, value.text, value.length);
    memset(target + value.length, 0, size - value.length);
    return ERROR_OK;
}

int calibration_parse_decimal(struct calibration_reader *reader, const char *field,
                              struct calibration_span word, int decimals, int64_t min, int64_t max,
                              double *value) {
    INVARIANT(decimals >= 0 && min <= max);
    int64_t scaled;
    const int code = decimal_parse(word.text, word.length, decimals, &scaled);
    if (code == ERROR_SYNTAX) {
        return calibration_refuse(reader, code, field,
                                  "not a number with the field's fixed count of decimals");
    }
    if (code != ERROR_OK) {
        return calibration_refuse(reader, ERROR_RANGE, field, "");
    }
    *value = decimal_to_double(scaled, decimals);
    return *value < (double)min || *value > (double)max
               ? calibration_refuse(reader, ERROR_RANGE, field, "")
               : ERROR_OK;
}

// Eight lower-case hexadecimal digits.
static bool parse_hex(struct calibration_span word, uint32_t *value) {
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

int calibration_parse_crc(struct calibration_reader *reader, struct calibration_span *name) {
    INVARIANT(reader->position <= reader->length);
    *name = (struct calibration_span){"", 0};
    const uint32_t crc = crc_update(0, reader->text, reader->position);
    struct calibration_span rest;
    const int code = calibration_next_line(reader, &rest);
    if (code != ERROR_OK) {
        reader->fault.field = CALIBRATION_GRAMMAR_CRC;
        return code;
    }
    bool more;
    const struct calibration_span word = calibration_cut_word(&rest, &more);
    if (!calibration_span_is(word, CALIBRATION_GRAMMAR_CRC)) {
        *name = word;
        return calibration_refuse(reader, ERROR_MISSING, CALIBRATION_GRAMMAR_CRC,
                                  "the field is missing here");
    }
    uint32_t stated;
    if (!more || !parse_hex(rest, &stated)) {
        return calibration_refuse(reader, ERROR_SYNTAX, CALIBRATION_GRAMMAR_CRC,
                                  "must be eight lower-case hexadecimal digits");
    }
    if (reader->position != reader->length) {
        return calibration_refuse(reader, ERROR_SYNTAX, CALIBRATION_GRAMMAR_CRC,
                                  "text after the checksum");
    }
    if (stated != crc) {
        reader->fault.crc = crc;
        return calibration_refuse(reader, ERROR_CRC, CALIBRATION_GRAMMAR_CRC, "");
    }
    return ERROR_OK;
}

void calibration_put(struct calibration_writer *writer, const char *word) {
    INVARIANT(writer->text != NULL || writer->size == 0);
    const size_t length = strlen(word);
    if (writer->length + length < writer->size) {
        memcpy(writer->text + writer->length, word, length + 1);
    }
    writer->length += length;
}

void calibration_put_value(struct calibration_writer *writer, const char *word) {
    calibration_put(writer, " ");
    calibration_put(writer, word);
}

void calibration_put_known(struct calibration_writer *writer, const char *text) {
    calibration_put_value(writer, text[0] != '\0' ? text : CALIBRATION_GRAMMAR_UNKNOWN);
}

void calibration_put_number(struct calibration_writer *writer, int decimals, double value) {
    int64_t scaled;
    const int code = decimal_from_double(value, decimals, &scaled);
    INVARIANT(code == ERROR_OK);  // the ranges of the grammar fit
    char text[DECIMAL_TEXT_BYTES];
    decimal_print(scaled, decimals, text);
    calibration_put_value(writer, text);
}

int calibration_put_crc(struct calibration_writer *writer) {
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
    calibration_put(writer, CALIBRATION_GRAMMAR_CRC);
    calibration_put_value(writer, digits);
    calibration_put(writer, "\n");
    return writer->length < writer->size ? (int)writer->length : ERROR_BUFFER;
}
