// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/keyed_text.h"

#include <string.h>

#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"

// ---- the table

int keyed_text_fields(const struct keyed_table *table, int version) {
    int count = 0;
    while (count < table->count && table->fields[count].version <= version) {
        count++;
    }
    INVARIANT(count > 0 && (version < table->versions || count == table->count));
    return count;
}

int keyed_text_line(const struct keyed_table *table, const char *name) {
    for (int i = 0; i < table->count; i++) {
        if (strcmp(table->fields[i].name, name) == 0) {
            return i + 2;  // fields begin in the second line
        }
    }
    return 0;
}

static const char *name_in(const struct keyed_field *field, int version) {
    INVARIANT(version >= field->version);
    return version == 1 && field->old_name != NULL ? field->old_name : field->name;
}

bool keyed_text_has_numbers(const struct keyed_field *field) {
    return field->kind == KEYED_INTEGERS || field->kind == KEYED_DECIMALS;
}

double keyed_text_value(const struct keyed_field *field, int i, const void *record) {
    const char *first = (const char *)record + field->offset;
    INVARIANT(i >= 0 && i < field->count && keyed_text_has_numbers(field));
    return field->kind == KEYED_INTEGERS ? ((const int *)(const void *)first)[i]
                                         : ((const double *)(const void *)first)[i];
}

static size_t text_bytes(int kind) {
    switch (kind) {
        case KEYED_ID:
            return CALIBRATION_ID_BYTES;
        case KEYED_DATE:
            return CALIBRATION_DATE_BYTES;
        case KEYED_NOTE:
            return CALIBRATION_NOTE_BYTES;
        default:
            INVARIANT(kind == KEYED_NAME);
            return CALIBRATION_NAME_BYTES;
    }
}

bool keyed_text_is(const struct keyed_table *table, const char *text, size_t length) {
    const size_t magic_length = strlen(table->magic);
    return length >= magic_length && memcmp(text, table->magic, magic_length) == 0;
}

// ---- reading

// The line has another name than the expected one: reports the most likely mistake.
static int refuse_name(const struct keyed_table *table, struct keyed_reader *reader,
                       struct keyed_span name, const char *expected) {
    bool before = true;  // the expected field has not been met
    for (int i = 0; i < table->count; i++) {
        const struct keyed_field *field = &table->fields[i];
        const bool old = field->old_name != NULL && keyed_span_is(name, field->old_name);
        if (strcmp(field->name, expected) == 0 || expected == field->old_name) {
            before = false;
        }
        if (old || keyed_span_is(name, field->name)) {
            return before ? keyed_refuse(reader, ERROR_DUPLICATE,
                                         old ? field->old_name : field->name, "duplicate field")
                          : keyed_refuse(reader, ERROR_MISSING, expected,
                                         "the field is missing here, or out of order");
        }
    }
    if (keyed_span_is(name, KEYED_LINE_CRC)) {
        return keyed_refuse(reader, ERROR_MISSING, expected, "the field is missing here");
    }
    return keyed_refuse(reader, ERROR_SYNTAX, expected,
                        "found another field here (this one was expected)");
}

int keyed_text_open_line(const struct keyed_table *table, struct keyed_reader *reader,
                         const char *name, struct keyed_span *values, bool *more) {
    const int code = keyed_next_line(reader, values);
    if (code != ERROR_OK) {
        reader->fault.field = name;
        return code;
    }
    const struct keyed_span found = keyed_cut_word(values, more);
    return keyed_span_is(found, name) ? ERROR_OK : refuse_name(table, reader, found, name);
}

int keyed_text_parse_numbers(struct keyed_reader *reader, const struct keyed_field *field,
                             const char *name, struct keyed_span values, bool more,
                             double *numbers) {
    INVARIANT(field->count > 0);
    int code = ERROR_OK;
    for (int i = 0; i < field->count && code == ERROR_OK; i++) {
        code = keyed_parse_number(reader, name, &values, &more, field->decimals, field->min,
                                  field->max, &numbers[i]);
    }
    return code == ERROR_OK && more ? keyed_refuse(reader, ERROR_SYNTAX, name, "too many values")
                                    : code;
}

static int parse_integers(struct keyed_reader *reader, const struct keyed_field *field,
                          const char *name, struct keyed_span values, bool more, int *integers) {
    double numbers[2];
    INVARIANT(field->count <= 2);
    const int code = keyed_text_parse_numbers(reader, field, name, values, more, numbers);
    for (int i = 0; i < field->count && code == ERROR_OK; i++) {
        integers[i] = (int)numbers[i];
    }
    return code;
}

static int parse_text(struct keyed_reader *reader, const struct keyed_field *field,
                      const char *name, struct keyed_span value, void *address) {
    INVARIANT(field->kind <= KEYED_FLAG && value.length <= reader->length);
    if (field->kind == KEYED_FLAG) {
        bool *flag = address;
        *flag = keyed_span_is(value, "yes");
        return *flag || keyed_span_is(value, "no")
                   ? ERROR_OK
                   : keyed_refuse(reader, ERROR_SYNTAX, name, "must be yes or no");
    }
    const bool may_be_unknown = field->kind == KEYED_DATE || field->kind == KEYED_NAME;
    if (may_be_unknown && keyed_span_is(value, KEYED_LINE_UNKNOWN)) {
        value.length = 0;
    }
    return keyed_copy_text(reader, name, value, address, text_bytes(field->kind));
}

static int parse_field(const struct keyed_table *table, struct keyed_reader *reader,
                       const struct keyed_field *field, const char *name, void *record) {
    void *address = (char *)record + field->offset;
    struct keyed_span values;
    bool more;
    const int code = keyed_text_open_line(table, reader, name, &values, &more);
    if (code != ERROR_OK) {
        return code;
    }
    if (field->kind == KEYED_INTEGERS) {
        return parse_integers(reader, field, name, values, more, address);
    }
    if (field->kind == KEYED_DECIMALS) {
        return keyed_text_parse_numbers(reader, field, name, values, more, address);
    }
    if (more ? values.length == 0 : field->kind != KEYED_NOTE) {
        return keyed_refuse(reader, ERROR_SYNTAX, name, "the value is missing");
    }
    return field->kind < KEYED_OTHER ? parse_text(reader, field, name, values, address)
                                     : table->parse(reader, field, name, values, address);
}

// Returns the version, or a negative code.
static int parse_first_line(const struct keyed_table *table, struct keyed_reader *reader) {
    const size_t magic_length = strlen(table->magic);
    if (!keyed_text_is(table, reader->text, reader->length)) {
        reader->line = 1;
        return keyed_refuse(reader, ERROR_SYNTAX, "", table->magic_wanted);
    }
    struct keyed_span line;
    const int code = keyed_next_line(reader, &line);
    if (code != ERROR_OK) {
        return code;
    }
    const int version = line.length == magic_length + 1 ? line.text[magic_length] - '0' : 0;
    return version >= 1 && version <= table->versions
               ? version
               : keyed_refuse(reader, ERROR_VERSION, "", table->version_wanted);
}

int keyed_text_parse(const struct keyed_table *table, struct keyed_reader *reader, void *record) {
    const int version = parse_first_line(table, reader);
    const int count = version > 0 ? keyed_text_fields(table, version) : 0;
    for (int i = 0; i < count; i++) {
        const struct keyed_field *field = &table->fields[i];
        const int code = parse_field(table, reader, field, name_in(field, version), record);
        if (code != ERROR_OK) {
            return code;
        }
    }
    return version;
}

int keyed_text_parse_end(const struct keyed_table *table, struct keyed_reader *reader) {
    struct keyed_span name;
    const int code = keyed_parse_crc(reader, &name);
    return code == ERROR_MISSING && name.length > 0
               ? refuse_name(table, reader, name, KEYED_LINE_CRC)
               : code;
}

// ---- printing

static void print_field(const struct keyed_table *table, const struct keyed_field *field,
                        const void *record, struct keyed_writer *writer) {
    const void *address = (const char *)record + field->offset;
    INVARIANT(field->count > 0 && field->decimals >= 0);
    keyed_put(writer, field->name);
    switch (field->kind) {
        case KEYED_ID:
        case KEYED_NOTE:
            if (*(const char *)address != '\0') {
                keyed_put_value(writer, address);
            }
            break;
        case KEYED_DATE:
        case KEYED_NAME:
            keyed_put_known(writer, address);
            break;
        case KEYED_FLAG:
            keyed_put_value(writer, *(const bool *)address ? "yes" : "no");
            break;
        case KEYED_INTEGERS:
        case KEYED_DECIMALS:
            for (int i = 0; i < field->count; i++) {
                keyed_put_number(writer, field->decimals, keyed_text_value(field, i, record));
            }
            break;
        default:
            table->print(writer, field, address);
            break;
    }
    keyed_put(writer, "\n");
}

void keyed_text_print(const struct keyed_table *table, int version, const void *record,
                      struct keyed_writer *writer) {
    INVARIANT(version >= 1 && version <= table->versions);
    const char digit[3] = {(char)('0' + version), '\n', '\0'};
    const int count = keyed_text_fields(table, version);
    keyed_put(writer, table->magic);
    keyed_put(writer, digit);
    for (int i = 0; i < count; i++) {
        print_field(table, &table->fields[i], record, writer);
    }
}

// ---- checking

// Length of a text that ends within `size` bytes; else `size`.
static size_t text_length(const char *text, size_t size) {
    size_t length = 0;
    while (length < size && text[length] != '\0') {
        length++;
    }
    return length;
}

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

static bool id_is_legal(const char *id) {
    const size_t length = text_length(id, CALIBRATION_ID_BYTES);
    if (length == 0 || length == CALIBRATION_ID_BYTES) {
        return false;
    }
    for (size_t i = 0; i < length; i++) {
        const char c = id[i];
        const bool letter = (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
        if (!letter && !is_digit(c) && c != '.' && c != '_' && c != '-') {
            return false;
        }
    }
    return true;
}

// Whether 10 characters have the form YYYY-MM-DD.
static bool has_date_form(const char *date) {
    for (int i = 0; i < 10; i++) {
        if (i == 4 || i == 7 ? date[i] != '-' : !is_digit(date[i])) {
            return false;
        }
    }
    return true;
}

static bool date_is_legal(const char *date) {
    const size_t length = text_length(date, CALIBRATION_DATE_BYTES);
    if (length == 0) {
        return true;
    }
    if (length != 10 || !has_date_form(date)) {
        return false;
    }
    const int year =
        (date[0] - '0') * 1000 + (date[1] - '0') * 100 + (date[2] - '0') * 10 + (date[3] - '0');
    const int month = (date[5] - '0') * 10 + (date[6] - '0');
    const int day = (date[8] - '0') * 10 + (date[9] - '0');
    static const int days_of_month[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    if (month < 1 || month > 12) {
        return false;
    }
    const bool leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    return day >= 1 && day <= days_of_month[month - 1] + (leap && month == 2 ? 1 : 0);
}

// Printable ASCII without blanks at the ends, shorter than `bytes`; may be empty.
static bool line_is_legal(const char *line, size_t bytes) {
    const size_t length = text_length(line, bytes);
    if (length == bytes) {
        return false;
    }
    for (size_t i = 0; i < length; i++) {
        if (line[i] < ' ' || line[i] > '~') {
            return false;
        }
    }
    // Editors easily lose blanks at the ends, and then the checksum fails.
    return length == 0 || (line[0] != ' ' && line[length - 1] != ' ');
}

static bool numbers_fit(const struct keyed_field *field, const void *record) {
    INVARIANT(field->min < field->max);
    bool fit = true;
    for (int i = 0; i < field->count; i++) {
        const double value = keyed_text_value(field, i, record);
        // False for a NaN, too.
        fit = fit && value >= (double)field->min && value <= (double)field->max;
    }
    return fit;
}

// What a text must be; NULL: it is. "" stands for the error's own words.
static const char *fault_of(const struct keyed_table *table, const struct keyed_field *field,
                            const void *record) {
    const void *address = (const char *)record + field->offset;
    switch (field->kind) {
        case KEYED_ID:
            return id_is_legal(address)
                       ? NULL
                       : "must be 1 to 47 letters, digits, dots, underlines or hyphens";
        case KEYED_DATE:
            return date_is_legal(address) ? NULL : "must be a date YYYY-MM-DD, or unknown";
        case KEYED_NOTE:
            return line_is_legal(address, CALIBRATION_NOTE_BYTES)
                       ? NULL
                       : "must be at most 239 printable ASCII characters without blanks at the "
                         "ends";
        case KEYED_NAME:
            return line_is_legal(address, CALIBRATION_NAME_BYTES)
                       ? NULL
                       : "must be at most 63 printable ASCII characters without blanks at the ends";
        case KEYED_FLAG:
            return NULL;
        case KEYED_INTEGERS:
        case KEYED_DECIMALS:
            return numbers_fit(field, record) ? NULL : "";
        default:
            return table->is_legal(field, address) ? NULL : "";
    }
}

int keyed_text_check(const struct keyed_table *table, const void *record,
                     struct calibration_fault *fault) {
    for (int i = 0; i < table->count; i++) {
        const struct keyed_field *field = &table->fields[i];
        const char *reason = fault_of(table, field, record);
        if (reason != NULL && fault != NULL) {
            *fault = (struct calibration_fault){.field = field->name, .reason = reason};
        }
        if (reason != NULL) {
            return *reason == '\0' ? ERROR_RANGE : ERROR_SYNTAX;
        }
    }
    return ERROR_OK;
}

double keyed_text_rounded(double value, int decimals) {
    INVARIANT(decimals >= 0 && decimals <= DECIMAL_MAX_DECIMALS);
    int64_t scaled;
    const int fits = decimal_from_double(value, decimals, &scaled);
    INVARIANT(fits == ERROR_OK);
    return decimal_to_double(scaled, decimals);
}

void keyed_text_round(const struct keyed_table *table, void *record) {
    for (int i = 0; i < table->count; i++) {
        const struct keyed_field *field = &table->fields[i];
        if (field->kind == KEYED_DECIMALS) {
            double *values = (double *)(void *)((char *)record + field->offset);
            for (int j = 0; j < field->count; j++) {
                values[j] = keyed_text_rounded(values[j], field->decimals);
            }
        }
    }
}
