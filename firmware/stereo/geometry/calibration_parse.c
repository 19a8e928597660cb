// SPDX-License-Identifier: Apache-2.0
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "stereo/geometry/calibration.h"
#include "stereo/geometry/calibration_grammar.h"
#include "stereo/geometry/calibration_text.h"

// The line has another name than the expected one: reports the most likely mistake.
static int refuse_name(struct calibration_reader *reader, struct calibration_span name,
                       const char *expected) {
    int count;
    const struct calibration_field *fields = calibration_grammar_fields(&count);
    bool before = true;  // until the expected field is met
    for (int i = 0; i < count; i++) {
        if (strcmp(fields[i].name, expected) == 0) {
            before = false;
        }
        if (calibration_span_is(name, fields[i].name)) {
            return before ? calibration_refuse(reader, ERROR_DUPLICATE, fields[i].name,
                                               "duplicate field")
                          : calibration_refuse(reader, ERROR_MISSING, expected,
                                               "the field is missing here, or out of order");
        }
    }
    if (calibration_span_is(name, CALIBRATION_GRAMMAR_CRC)) {
        return calibration_refuse(reader, ERROR_MISSING, expected, "the field is missing here");
    }
    return calibration_refuse(reader, ERROR_SYNTAX, expected,
                              "found another field here (this one was expected)");
}

// Parses all values of a field; `more`: whether the name was followed by a blank.
static int parse_values(struct calibration_reader *reader, const struct calibration_field *field,
                        struct calibration_span rest, bool more,
                        double values[CALIBRATION_FIELD_MAX_COUNT]) {
    for (int i = 0; i < field->count; i++) {
        if (!more) {
            return calibration_refuse(reader, ERROR_SYNTAX, field->name, "too few values");
        }
        const int code =
            calibration_parse_decimal(reader, field->name, calibration_cut_word(&rest, &more),
                                      field->decimals, field->min, field->max, &values[i]);
        if (code != ERROR_OK) {
            return code;
        }
    }
    return more ? calibration_refuse(reader, ERROR_SYNTAX, field->name, "too many values")
                : ERROR_OK;
}

static int parse_numbers(struct calibration_reader *reader, const struct calibration_field *field,
                         struct calibration_span rest, bool more, struct calibration *result) {
    double values[CALIBRATION_FIELD_MAX_COUNT];
    const int code = parse_values(reader, field, rest, more, values);
    for (int i = 0; code == ERROR_OK && i < field->count; i++) {
        calibration_grammar_set(field, i, values[i], result);
    }
    return code;
}

static int parse_window(struct calibration_reader *reader, const struct calibration_field *field,
                        struct calibration_span rest, struct calibration *result) {
    double values[CALIBRATION_FIELD_MAX_COUNT];
    struct calibration_window *window = calibration_grammar_window(field, result);
    *window = (struct calibration_window){0, 0, 0};
    if (calibration_span_is(rest, CALIBRATION_GRAMMAR_UNKNOWN)) {
        return ERROR_OK;
    }
    const int code = parse_values(reader, field, rest, true, values);
    if (code == ERROR_OK) {
        *window = (struct calibration_window){(int)values[0], (int)values[1], (int)values[2]};
    }
    return code == ERROR_OK && window->skip == 0
               ? calibration_refuse(reader, ERROR_RANGE, field->name, "the step must not be 0")
               : code;
}

static int parse_axis(struct calibration_reader *reader, const struct calibration_field *field,
                      struct calibration_span rest, struct calibration *result) {
    double values[CALIBRATION_FIELD_MAX_COUNT];
    struct calibration_axis *axis = calibration_grammar_axis(field, result);
    *axis = (struct calibration_axis){.kind = CALIBRATION_AXIS_UNKNOWN};
    if (calibration_span_is(rest, CALIBRATION_GRAMMAR_UNKNOWN)) {
        return ERROR_OK;
    }
    if (calibration_span_is(rest, CALIBRATION_GRAMMAR_NO_AXIS)) {
        axis->kind = CALIBRATION_AXIS_NONE;
        return ERROR_OK;
    }
    const int code = parse_values(reader, field, rest, true, values);
    if (code == ERROR_OK) {
        *axis = (struct calibration_axis){CALIBRATION_AXIS_KNOWN, values[0], values[1]};
    }
    return code;
}

// The text of a value, empty for "unknown".
static struct calibration_span known(struct calibration_span value) {
    return calibration_span_is(value, CALIBRATION_GRAMMAR_UNKNOWN)
               ? (struct calibration_span){"", 0}
               : value;
}

static int parse_flag(struct calibration_reader *reader, const struct calibration_field *field,
                      struct calibration_span value, struct calibration *result) {
    bool *flag = calibration_grammar_flag(field, result);
    *flag = calibration_span_is(value, "yes");
    return *flag || calibration_span_is(value, "no")
               ? ERROR_OK
               : calibration_refuse(reader, ERROR_SYNTAX, field->name, "must be yes or no");
}

static int parse_lens(struct calibration_reader *reader, const struct calibration_field *field,
                      struct calibration_span value, struct calibration *result) {
    enum lens_kind *kind = calibration_grammar_lens(field, result);
    for (int i = 0; i < LENS_KINDS; i++) {
        if (calibration_span_is(value, lens_kind_name((enum lens_kind)i))) {
            *kind = (enum lens_kind)i;
            return ERROR_OK;
        }
    }
    return calibration_refuse(reader, ERROR_SYNTAX, field->name,
                              "must be brown-conrady, rational or equidistant");
}

static int parse_word(struct calibration_reader *reader, const struct calibration_field *field,
                      struct calibration_span rest, bool more, struct calibration *result) {
    if (!more || rest.length == 0) {
        return calibration_refuse(reader, ERROR_SYNTAX, field->name, "the value is missing");
    }
    switch (field->kind) {
        case CALIBRATION_FIELD_ID:
            return calibration_copy_text(reader, field->name, rest, result->id, sizeof result->id);
        case CALIBRATION_FIELD_DATE:
            return calibration_copy_text(reader, field->name, known(rest), result->date,
                                         sizeof result->date);
        case CALIBRATION_FIELD_NOTE:
            return calibration_copy_text(reader, field->name, rest, result->note,
                                         sizeof result->note);
        case CALIBRATION_FIELD_NAME:
            return calibration_copy_text(reader, field->name, known(rest),
                                         calibration_grammar_name(field, result),
                                         CALIBRATION_NAME_BYTES);
        case CALIBRATION_FIELD_WINDOW:
            return parse_window(reader, field, rest, result);
        case CALIBRATION_FIELD_AXIS:
            return parse_axis(reader, field, rest, result);
        case CALIBRATION_FIELD_LENS:
            return parse_lens(reader, field, rest, result);
        default:
            INVARIANT(field->kind == CALIBRATION_FIELD_FLAG);
            return parse_flag(reader, field, rest, result);
    }
}

static int parse_field(struct calibration_reader *reader, const struct calibration_field *field,
                       struct calibration *result) {
    struct calibration_span rest;
    const int code = calibration_next_line(reader, &rest);
    if (code != ERROR_OK) {
        reader->fault.field = field->name;
        return code;
    }
    bool more;
    const struct calibration_span name = calibration_cut_word(&rest, &more);
    if (!calibration_span_is(name, field->name)) {
        return refuse_name(reader, name, field->name);
    }
    if (field->kind == CALIBRATION_FIELD_INTEGERS || field->kind == CALIBRATION_FIELD_DECIMALS) {
        return parse_numbers(reader, field, rest, more, result);
    }
    if (field->kind == CALIBRATION_FIELD_NOTE && !more) {
        memset(result->note, 0, sizeof result->note);
        return ERROR_OK;
    }
    return parse_word(reader, field, rest, more, result);
}

static int parse_end(struct calibration_reader *reader) {
    struct calibration_span name;
    const int code = calibration_parse_crc(reader, &name);
    return code == ERROR_MISSING && name.length > 0
               ? refuse_name(reader, name, CALIBRATION_GRAMMAR_CRC)
               : code;
}

// Returns the version, or a negative code.
static int parse_first_line(struct calibration_reader *reader) {
    static const size_t magic_length = sizeof CALIBRATION_GRAMMAR_MAGIC - 1;
    if (reader->length < magic_length ||
        memcmp(reader->text, CALIBRATION_GRAMMAR_MAGIC, magic_length) != 0) {
        reader->line = 1;
        return calibration_refuse(reader, ERROR_SYNTAX, "",
                                  "the first line must be " CALIBRATION_GRAMMAR_FIRST_LINE);
    }
    struct calibration_span line;
    const int code = calibration_next_line(reader, &line);
    if (code != ERROR_OK) {
        return code;
    }
    const int version = line.length == magic_length + 1 ? line.text[magic_length] - '0' : 0;
    return version >= 1 && version <= CALIBRATION_GRAMMAR_VERSIONS
               ? version
               : calibration_refuse(reader, ERROR_VERSION, "", "unknown version (expected 1 to 4)");
}

static int parse_all(struct calibration_reader *reader, struct calibration *result) {
    const int version = parse_first_line(reader);
    if (version < 0) {
        return version;
    }
    result->has_origin = version >= 2;
    int count, code = ERROR_OK;
    const struct calibration_field *fields = calibration_grammar_fields(&count);
    count = calibration_grammar_count(version);
    for (int i = 0; i < count && code == ERROR_OK; i++) {
        code = parse_field(reader, &fields[i], result);
    }
    if (code == ERROR_OK) {
        code = parse_end(reader);
    }
    if (code == ERROR_OK && calibration_grammar_version(result) != version) {
        reader->line = 1;
        code = calibration_refuse(reader, ERROR_VERSION, "",
                                  "an earlier version of the text has all of this");
    }
    if (code == ERROR_OK) {
        code = calibration_validate(result, &reader->fault);
        // One line per field, in order, after the first line.
        for (int i = 0; code != ERROR_OK && i < count; i++) {
            if (strcmp(fields[i].name, reader->fault.field) == 0) {
                reader->fault.line = i + 2;
            }
        }
    }
    return code;
}

int calibration_parse(const char *text, size_t length, struct calibration *result,
                      struct calibration_fault *fault) {
    struct calibration_reader reader = {
        .text = text, .length = length, .fault = {.field = "", .reason = ""}};
    struct calibration parsed;
    memset(&parsed, 0, sizeof parsed);
    const int code = parse_all(&reader, &parsed);
    if (code == ERROR_OK) {
        *result = parsed;
    } else if (fault != NULL) {
        *fault = reader.fault;
    }
    return code;
}
