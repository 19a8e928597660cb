// SPDX-License-Identifier: Apache-2.0
#include <string.h>

#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "stereo/geometry/calibration.h"
#include "stereo/geometry/calibration_grammar.h"
#include "stereo/geometry/calibration_text.h"

static void put_numbers(struct calibration_writer *writer, const struct calibration_field *field,
                        struct calibration *calibration) {
    for (int i = 0; i < field->count; i++) {
        calibration_put_number(writer, field->decimals,
                               calibration_grammar_value(field, i, calibration));
    }
}

static void put_window(struct calibration_writer *writer, const struct calibration_field *field,
                       const struct calibration_window *window) {
    if (window->skip == 0) {
        calibration_put_value(writer, CALIBRATION_GRAMMAR_UNKNOWN);
        return;
    }
    calibration_put_number(writer, field->decimals, window->column_px);
    calibration_put_number(writer, field->decimals, window->row_px);
    calibration_put_number(writer, field->decimals, window->skip);
}

static void put_axis(struct calibration_writer *writer, const struct calibration_field *field,
                     const struct calibration_axis *axis) {
    if (axis->kind == CALIBRATION_AXIS_KNOWN) {
        calibration_put_number(writer, field->decimals, axis->mean);
        calibration_put_number(writer, field->decimals, axis->spread);
    } else {
        calibration_put_value(writer, axis->kind == CALIBRATION_AXIS_NONE
                                          ? CALIBRATION_GRAMMAR_NO_AXIS
                                          : CALIBRATION_GRAMMAR_UNKNOWN);
    }
}

static void put_field(struct calibration_writer *writer, const struct calibration_field *field,
                      struct calibration *calibration) {
    calibration_put(writer, field->name);
    switch (field->kind) {
        case CALIBRATION_FIELD_ID:
            calibration_put_value(writer, calibration->id);
            break;
        case CALIBRATION_FIELD_DATE:
            calibration_put_known(writer, calibration->date);
            break;
        case CALIBRATION_FIELD_NOTE:
            if (calibration->note[0] != '\0') {
                calibration_put_value(writer, calibration->note);
            }
            break;
        case CALIBRATION_FIELD_FLAG:
            calibration_put_value(writer,
                                  *calibration_grammar_flag(field, calibration) ? "yes" : "no");
            break;
        case CALIBRATION_FIELD_LENS:
            calibration_put_value(writer,
                                  lens_kind_name(*calibration_grammar_lens(field, calibration)));
            break;
        case CALIBRATION_FIELD_INTEGERS:
        case CALIBRATION_FIELD_DECIMALS:
            put_numbers(writer, field, calibration);
            break;
        case CALIBRATION_FIELD_NAME:
            calibration_put_known(writer, calibration_grammar_name(field, calibration));
            break;
        case CALIBRATION_FIELD_WINDOW:
            put_window(writer, field, calibration_grammar_window(field, calibration));
            break;
        case CALIBRATION_FIELD_AXIS:
            put_axis(writer, field, calibration_grammar_axis(field, calibration));
            break;
    }
    calibration_put(writer, "\n");
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
    struct calibration_writer writer = {text, size_bytes, 0};
    const int version = calibration_grammar_version(&rounded);
    const char digit[3] = {(char)('0' + version), '\n', '\0'};
    calibration_put(&writer, CALIBRATION_GRAMMAR_MAGIC);
    calibration_put(&writer, digit);
    int count;
    const struct calibration_field *fields = calibration_grammar_fields(&count);
    count = calibration_grammar_count(version);
    for (int i = 0; i < count; i++) {
        put_field(&writer, &fields[i], &rounded);
    }
    INVARIANT(writer.length < CALIBRATION_TEXT_MAX_BYTES);
    return calibration_put_crc(&writer);
}

uint32_t calibration_crc(const struct calibration *calibration) {
    char text[CALIBRATION_TEXT_MAX_BYTES];
    const int length = calibration_print(calibration, text, sizeof text);
    static const size_t crc_line_bytes = sizeof CALIBRATION_GRAMMAR_CRC " 01234567\n" - 1;
    INVARIANT(length > (int)crc_line_bytes);
    return crc_update(0, text, (size_t)length - crc_line_bytes);
}
