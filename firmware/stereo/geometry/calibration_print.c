// SPDX-License-Identifier: Apache-2.0
#include <string.h>

#include "core/crc.h"
#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"
#include "stereo/geometry/calibration.h"
#include "stereo/geometry/calibration_grammar.h"

struct writer {
    char *text;
    size_t size, length;  // `length` keeps counting when the text is full
};

static void put(struct writer *writer, const char *word) {
    const size_t length = strlen(word);
    if (writer->length + length < writer->size) {
        memcpy(writer->text + writer->length, word, length + 1);
    }
    writer->length += length;
}

static void put_value(struct writer *writer, const char *word) {
    put(writer, " ");
    put(writer, word);
}

static void put_known(struct writer *writer, const char *text) {
    put_value(writer, text[0] != '\0' ? text : CALIBRATION_GRAMMAR_UNKNOWN);
}

static void put_number(struct writer *writer, const struct calibration_field *field, double value) {
    int64_t scaled;
    const int code = decimal_from_double(value, field->decimals, &scaled);
    INVARIANT(code == ERROR_OK);  // the ranges of the grammar fit
    char text[DECIMAL_TEXT_BYTES];
    decimal_print(scaled, field->decimals, text);
    put_value(writer, text);
}

static void put_numbers(struct writer *writer, const struct calibration_field *field,
                        struct calibration *calibration) {
    for (int i = 0; i < field->count; i++) {
        put_number(writer, field, calibration_grammar_value(field, i, calibration));
    }
}

static void put_window(struct writer *writer, const struct calibration_field *field,
                       const struct calibration_window *window) {
    if (window->skip == 0) {
        put_value(writer, CALIBRATION_GRAMMAR_UNKNOWN);
        return;
    }
    put_number(writer, field, window->column_px);
    put_number(writer, field, window->row_px);
    put_number(writer, field, window->skip);
}

static void put_axis(struct writer *writer, const struct calibration_field *field,
                     const struct calibration_axis *axis) {
    if (axis->kind == CALIBRATION_AXIS_KNOWN) {
        put_number(writer, field, axis->mean);
        put_number(writer, field, axis->spread);
    } else {
        put_value(writer, axis->kind == CALIBRATION_AXIS_NONE ? CALIBRATION_GRAMMAR_NO_AXIS
                                                              : CALIBRATION_GRAMMAR_UNKNOWN);
    }
}

static void put_field(struct writer *writer, const struct calibration_field *field,
                      struct calibration *calibration) {
    put(writer, field->name);
    switch (field->kind) {
        case CALIBRATION_FIELD_ID:
            put_value(writer, calibration->id);
            break;
        case CALIBRATION_FIELD_DATE:
            put_known(writer, calibration->date);
            break;
        case CALIBRATION_FIELD_NOTE:
            if (calibration->note[0] != '\0') {
                put_value(writer, calibration->note);
            }
            break;
        case CALIBRATION_FIELD_FLAG:
            put_value(writer, calibration->rectified ? "yes" : "no");
            break;
        case CALIBRATION_FIELD_INTEGERS:
        case CALIBRATION_FIELD_DECIMALS:
            put_numbers(writer, field, calibration);
            break;
        case CALIBRATION_FIELD_NAME:
            put_known(writer, calibration_grammar_name(field, calibration));
            break;
        case CALIBRATION_FIELD_WINDOW:
            put_window(writer, field, calibration_grammar_window(field, calibration));
            break;
        case CALIBRATION_FIELD_AXIS:
            put_axis(writer, field, calibration_grammar_axis(field, calibration));
            break;
    }
    put(writer, "\n");
}

int calibration_print(const struct calibration *calibration, char *text, size_t size_bytes) {
    struct calibration rounded = *calibration;
    int code = calibration_round(&rounded);
    if (code == ERROR_OK) {
        code = calibration_validate(&rounded, NULL);
    }
    if (code != ERROR_OK) {
        return code;
    }
    struct writer writer = {text, size_bytes, 0};
    put(&writer, rounded.has_origin ? CALIBRATION_GRAMMAR_FIRST_LINE_2 "\n"
                                    : CALIBRATION_GRAMMAR_FIRST_LINE "\n");
    int count;
    const struct calibration_field *fields = calibration_grammar_fields(&count);
    count = calibration_grammar_count(rounded.has_origin ? 2 : 1);
    for (int i = 0; i < count; i++) {
        put_field(&writer, &fields[i], &rounded);
    }
    INVARIANT(writer.length < CALIBRATION_TEXT_MAX_BYTES);
    if (writer.length >= size_bytes) {
        return ERROR_BUFFER;
    }
    const uint32_t crc = crc_update(0, text, writer.length);
    char digits[9];
    for (int i = 0; i < 8; i++) {
        digits[i] = "0123456789abcdef"[crc >> (28 - 4 * i) & 15];
    }
    digits[8] = '\0';
    put(&writer, CALIBRATION_GRAMMAR_CRC);
    put_value(&writer, digits);
    put(&writer, "\n");
    return writer.length < size_bytes ? (int)writer.length : ERROR_BUFFER;
}

uint32_t calibration_crc(const struct calibration *calibration) {
    char text[CALIBRATION_TEXT_MAX_BYTES];
    const int length = calibration_print(calibration, text, sizeof text);
    static const size_t crc_line_bytes = sizeof CALIBRATION_GRAMMAR_CRC " 01234567\n" - 1;
    INVARIANT(length > (int)crc_line_bytes);
    return crc_update(0, text, (size_t)length - crc_line_bytes);
}
