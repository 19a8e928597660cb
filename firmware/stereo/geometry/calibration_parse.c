// SPDX-License-Identifier: Apache-2.0
#include <string.h>

#include "core/crc.h"
#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"
#include "stereo/geometry/calibration.h"
#include "stereo/geometry/calibration_grammar.h"

// A run of bytes inside the text; not zero-terminated.
struct span {
    const char *text;
    size_t length;
};

struct parser {
    const char *text;
    size_t length, position;  // start of the next line
    int line;                 // number of the present one
    struct calibration_fault fault;
};

static int refuse(struct parser *parser, int code, const char *field, const char *reason) {
    INVARIANT(code < 0 && field != NULL && reason != NULL);
    parser->fault.line = parser->line;
    parser->fault.field = field;
    parser->fault.reason = reason;
    return code;
}

static bool span_is(struct span span, const char *word) {
    return span.length == strlen(word) && memcmp(span.text, word, span.length) == 0;
}

// Next line without its line feed.
static int next_line(struct parser *parser, struct span *line) {
    INVARIANT(parser->position <= parser->length);
    parser->line++;
    const char *begin = parser->text + parser->position;
    const size_t left = parser->length - parser->position;
    if (left == 0) {
        return refuse(parser, ERROR_MISSING, "", "unexpected end of the text");
    }
    size_t length = 0;
    for (; length < left && begin[length] != '\n'; length++) {
        const char c = begin[length];
        if (c == '\r') {
            return refuse(parser, ERROR_SYNTAX, "",
                          "lines must end in LF, not CR LF (convert the line ends)");
        }
        if (c < ' ' || c > '~') {
            return refuse(parser, ERROR_SYNTAX, "", "only printable ASCII characters are allowed");
        }
    }
    if (length == left) {
        return refuse(parser, ERROR_SYNTAX, "", "the last line has no line feed");
    }
    *line = (struct span){begin, length};
    parser->position += length + 1;
    return ERROR_OK;
}

// Splits the first word and the blank after it off `rest`. If nothing follows the blank, `more`
// stays true, so that it counts as an empty value.
static struct span cut_word(struct span *rest, bool *more) {
    size_t length = 0;
    while (length < rest->length && rest->text[length] != ' ') {
        length++;
    }
    const struct span word = {rest->text, length};
    *more = length < rest->length;
    const size_t cut = *more ? length + 1 : length;
    rest->text += cut;
    rest->length -= cut;
    return word;
}

// The line has another name than the expected one: reports the most likely mistake.
static int refuse_name(struct parser *parser, struct span name, const char *expected) {
    int count;
    const struct calibration_field *fields = calibration_grammar_fields(&count);
    bool before = true;  // until the expected field is met
    for (int i = 0; i < count; i++) {
        if (strcmp(fields[i].name, expected) == 0) {
            before = false;
        }
        if (span_is(name, fields[i].name)) {
            return before ? refuse(parser, ERROR_DUPLICATE, fields[i].name, "duplicate field")
                          : refuse(parser, ERROR_MISSING, expected,
                                   "the field is missing here, or out of order");
        }
    }
    if (span_is(name, CALIBRATION_GRAMMAR_CRC)) {
        return refuse(parser, ERROR_MISSING, expected, "the field is missing here");
    }
    return refuse(parser, ERROR_SYNTAX, expected,
                  "found another field here (this one was expected)");
}

static int copy_text(struct parser *parser, const char *field, struct span value, char *target,
                     size_t size) {
    if (value.length >= size) {
        return refuse(parser, ERROR_SYNTAX, field, "the text is too long");
    }
    memcpy(target, value.text, value.length);
    memset(target + value.length, 0, size - value.length);
    return ERROR_OK;
}

// Parses one value of a field with decimals; `*value` is set only on success.
static int parse_decimal(struct parser *parser, const struct calibration_field *field,
                         struct span word, double *value) {
    int64_t scaled;
    const int code = decimal_parse(word.text, word.length, field->decimals, &scaled);
    if (code == ERROR_SYNTAX) {
        return refuse(parser, code, field->name,
                      "not a number with the field's fixed count of decimals");
    }
    if (code != ERROR_OK) {
        return refuse(parser, ERROR_RANGE, field->name, "");
    }
    *value = decimal_to_double(scaled, field->decimals);
    return *value < (double)field->min || *value > (double)field->max
               ? refuse(parser, ERROR_RANGE, field->name, "")
               : ERROR_OK;
}

// Parses all values of a field; `more`: whether the name was followed by a blank.
static int parse_values(struct parser *parser, const struct calibration_field *field,
                        struct span rest, bool more, double values[CALIBRATION_FIELD_MAX_COUNT]) {
    for (int i = 0; i < field->count; i++) {
        if (!more) {
            return refuse(parser, ERROR_SYNTAX, field->name, "too few values");
        }
        const int code = parse_decimal(parser, field, cut_word(&rest, &more), &values[i]);
        if (code != ERROR_OK) {
            return code;
        }
    }
    return more ? refuse(parser, ERROR_SYNTAX, field->name, "too many values") : ERROR_OK;
}

static int parse_numbers(struct parser *parser, const struct calibration_field *field,
                         struct span rest, bool more, struct calibration *result) {
    double values[CALIBRATION_FIELD_MAX_COUNT];
    const int code = parse_values(parser, field, rest, more, values);
    for (int i = 0; code == ERROR_OK && i < field->count; i++) {
        calibration_grammar_set(field, i, values[i], result);
    }
    return code;
}

static int parse_window(struct parser *parser, const struct calibration_field *field,
                        struct span rest, struct calibration *result) {
    double values[CALIBRATION_FIELD_MAX_COUNT];
    struct calibration_window *window = calibration_grammar_window(field, result);
    *window = (struct calibration_window){0, 0, 0};
    if (span_is(rest, CALIBRATION_GRAMMAR_UNKNOWN)) {
        return ERROR_OK;
    }
    const int code = parse_values(parser, field, rest, true, values);
    if (code == ERROR_OK) {
        *window = (struct calibration_window){(int)values[0], (int)values[1], (int)values[2]};
    }
    return code == ERROR_OK && window->skip == 0
               ? refuse(parser, ERROR_RANGE, field->name, "the step must not be 0")
               : code;
}

static int parse_axis(struct parser *parser, const struct calibration_field *field,
                      struct span rest, struct calibration *result) {
    double values[CALIBRATION_FIELD_MAX_COUNT];
    struct calibration_axis *axis = calibration_grammar_axis(field, result);
    *axis = (struct calibration_axis){.kind = CALIBRATION_AXIS_UNKNOWN};
    if (span_is(rest, CALIBRATION_GRAMMAR_UNKNOWN)) {
        return ERROR_OK;
    }
    if (span_is(rest, CALIBRATION_GRAMMAR_NO_AXIS)) {
        axis->kind = CALIBRATION_AXIS_NONE;
        return ERROR_OK;
    }
    const int code = parse_values(parser, field, rest, true, values);
    if (code == ERROR_OK) {
        *axis = (struct calibration_axis){CALIBRATION_AXIS_KNOWN, values[0], values[1]};
    }
    return code;
}

// The text of a value, empty for "unknown".
static struct span known(struct span value) {
    return span_is(value, CALIBRATION_GRAMMAR_UNKNOWN) ? (struct span){"", 0} : value;
}

static int parse_flag(struct parser *parser, const struct calibration_field *field,
                      struct span value, struct calibration *result) {
    result->rectified = span_is(value, "yes");
    return result->rectified || span_is(value, "no")
               ? ERROR_OK
               : refuse(parser, ERROR_SYNTAX, field->name, "must be yes or no");
}

static int parse_word(struct parser *parser, const struct calibration_field *field,
                      struct span rest, bool more, struct calibration *result) {
    if (!more || rest.length == 0) {
        return refuse(parser, ERROR_SYNTAX, field->name, "the value is missing");
    }
    switch (field->kind) {
        case CALIBRATION_FIELD_ID:
            return copy_text(parser, field->name, rest, result->id, sizeof result->id);
        case CALIBRATION_FIELD_DATE:
            return copy_text(parser, field->name, known(rest), result->date, sizeof result->date);
        case CALIBRATION_FIELD_NOTE:
            return copy_text(parser, field->name, rest, result->note, sizeof result->note);
        case CALIBRATION_FIELD_NAME:
            return copy_text(parser, field->name, known(rest),
                             calibration_grammar_name(field, result), CALIBRATION_NAME_BYTES);
        case CALIBRATION_FIELD_WINDOW:
            return parse_window(parser, field, rest, result);
        case CALIBRATION_FIELD_AXIS:
            return parse_axis(parser, field, rest, result);
        default:
            INVARIANT(field->kind == CALIBRATION_FIELD_FLAG);
            return parse_flag(parser, field, rest, result);
    }
}

static int parse_field(struct parser *parser, const struct calibration_field *field,
                       struct calibration *result) {
    struct span rest;
    const int code = next_line(parser, &rest);
    if (code != ERROR_OK) {
        parser->fault.field = field->name;
        return code;
    }
    bool more;
    const struct span name = cut_word(&rest, &more);
    if (!span_is(name, field->name)) {
        return refuse_name(parser, name, field->name);
    }
    if (field->kind == CALIBRATION_FIELD_INTEGERS || field->kind == CALIBRATION_FIELD_DECIMALS) {
        return parse_numbers(parser, field, rest, more, result);
    }
    if (field->kind == CALIBRATION_FIELD_NOTE && !more) {
        memset(result->note, 0, sizeof result->note);
        return ERROR_OK;
    }
    return parse_word(parser, field, rest, more, result);
}

// Eight lower-case hexadecimal digits.
static bool parse_hex(struct span word, uint32_t *value) {
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

static int parse_crc(struct parser *parser) {
    const uint32_t crc = crc_update(0, parser->text, parser->position);
    struct span rest;
    const int code = next_line(parser, &rest);
    if (code != ERROR_OK) {
        parser->fault.field = CALIBRATION_GRAMMAR_CRC;
        return code;
    }
    bool more;
    const struct span name = cut_word(&rest, &more);
    if (!span_is(name, CALIBRATION_GRAMMAR_CRC)) {
        return refuse_name(parser, name, CALIBRATION_GRAMMAR_CRC);
    }
    uint32_t stated;
    if (!more || !parse_hex(rest, &stated)) {
        return refuse(parser, ERROR_SYNTAX, CALIBRATION_GRAMMAR_CRC,
                      "must be eight lower-case hexadecimal digits");
    }
    if (parser->position != parser->length) {
        return refuse(parser, ERROR_SYNTAX, CALIBRATION_GRAMMAR_CRC, "text after the checksum");
    }
    if (stated != crc) {
        parser->fault.crc = crc;
        return refuse(parser, ERROR_CRC, CALIBRATION_GRAMMAR_CRC, "");
    }
    return ERROR_OK;
}

static int parse_first_line(struct parser *parser, bool *has_origin) {
    static const size_t magic_length = sizeof CALIBRATION_GRAMMAR_MAGIC - 1;
    if (parser->length < magic_length ||
        memcmp(parser->text, CALIBRATION_GRAMMAR_MAGIC, magic_length) != 0) {
        parser->line = 1;
        return refuse(parser, ERROR_SYNTAX, "",
                      "the first line must be " CALIBRATION_GRAMMAR_FIRST_LINE);
    }
    struct span line;
    const int code = next_line(parser, &line);
    if (code != ERROR_OK) {
        return code;
    }
    *has_origin = span_is(line, CALIBRATION_GRAMMAR_FIRST_LINE_2);
    return *has_origin || span_is(line, CALIBRATION_GRAMMAR_FIRST_LINE)
               ? ERROR_OK
               : refuse(parser, ERROR_VERSION, "", "unknown version (expected 1 or 2)");
}

static int parse_all(struct parser *parser, struct calibration *result) {
    int code = parse_first_line(parser, &result->has_origin);
    int count;
    const struct calibration_field *fields = calibration_grammar_fields(&count);
    count = calibration_grammar_count(result->has_origin ? 2 : 1);
    for (int i = 0; i < count && code == ERROR_OK; i++) {
        code = parse_field(parser, &fields[i], result);
    }
    if (code == ERROR_OK) {
        code = parse_crc(parser);
    }
    if (code == ERROR_OK) {
        code = calibration_validate(result, &parser->fault);
        // One line per field, in order, after the first line.
        for (int i = 0; code != ERROR_OK && i < count; i++) {
            if (strcmp(fields[i].name, parser->fault.field) == 0) {
                parser->fault.line = i + 2;
            }
        }
    }
    return code;
}

int calibration_parse(const char *text, size_t length, struct calibration *result,
                      struct calibration_fault *fault) {
    struct parser parser = {.text = text, .length = length, .fault = {.field = "", .reason = ""}};
    struct calibration parsed;
    memset(&parsed, 0, sizeof parsed);
    const int code = parse_all(&parser, &parsed);
    if (code == ERROR_OK) {
        *result = parsed;
    } else if (fault != NULL) {
        *fault = parser.fault;
    }
    return code;
}
