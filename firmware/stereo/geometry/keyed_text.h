// SPDX-License-Identifier: Apache-2.0
/// Texts of fields, as those of calibrations are: a first line with the version, then a line for
/// each field in a fixed order: its name and its values. The fields are a table, from which texts
/// are read, printed, checked and documented.
#ifndef VERGENCE_STEREO_GEOMETRY_KEYED_TEXT_H
#define VERGENCE_STEREO_GEOMETRY_KEYED_TEXT_H

#include "stereo/geometry/keyed_line.h"

#ifdef __cplusplus
extern "C" {
#endif

enum keyed_kind {
    KEYED_ID,        // one or more of A-Z a-z 0-9 . _ -; char[CALIBRATION_ID_BYTES]
    KEYED_DATE,      // YYYY-MM-DD or "unknown"; char[CALIBRATION_DATE_BYTES]
    KEYED_NOTE,      // the rest of the line, may be empty; char[CALIBRATION_NOTE_BYTES]
    KEYED_NAME,      // the rest of the line, or "unknown"; char[CALIBRATION_NAME_BYTES]
    KEYED_FLAG,      // "yes" or "no"; bool
    KEYED_INTEGERS,  // int[count]
    KEYED_DECIMALS,  // double[count]
    KEYED_OTHER,     // this and above: kinds of one table
};

struct keyed_field {
    const char *name;
    const char *old_name;  // name in version 1 of the text; NULL: the same
    int kind;
    int version;       // first version of the text that has it
    int count;         // number of values
    int decimals;      // exact number of digits after the point
    int64_t min, max;  // legal range of each value, in whole units, both ends included
    const char *unit;  // "" if it has none
    const char *meaning;
    size_t offset;  // place of the first value in the record; the others follow it
};

struct keyed_table {
    const char *magic;  // start of the first line; the version follows it, one digit
    int versions;
    const char *magic_wanted, *version_wanted;  // reasons to refuse a first line
    const struct keyed_field *fields;  // the text's fields in order; later versions append to it
    int count;
    /// For kinds from KEYED_OTHER on. `values`: what follows the name's blank, not empty.
    /// `is_legal` is false for a NaN.
    int (*parse)(struct keyed_reader *reader, const struct keyed_field *field, const char *name,
                 struct keyed_span values, void *address);
    void (*print)(struct keyed_writer *writer, const struct keyed_field *field,
                  const void *address);
    bool (*is_legal)(const struct keyed_field *field, const void *address);
};

/// Number of fields in a text of a version, 1 to `versions`.
int keyed_text_fields(const struct keyed_table *table, int version);
/// The line of a field, 0 for another name.
int keyed_text_line(const struct keyed_table *table, const char *name);
/// Value i, 0 <= i < count, of a field of integers or decimals.
double keyed_text_value(const struct keyed_field *field, int i, const void *record);
/// Whether it has such values.
bool keyed_text_has_numbers(const struct keyed_field *field);

/// Whether a text begins as one of the table.
bool keyed_text_is(const struct keyed_table *table, const char *text, size_t length);

/// Reads the first line and the fields into `record`, unchecked but for the ranges of numbers.
/// Returns the version, or a negative code with the fault in the reader.
int keyed_text_parse(const struct keyed_table *table, struct keyed_reader *reader, void *record);
/// Opens a line that must begin with `name`; `more`: whether a blank and `values` follow.
int keyed_text_open_line(const struct keyed_table *table, struct keyed_reader *reader,
                         const char *name, struct keyed_span *values, bool *more);
/// The field's numbers, and nothing after them.
int keyed_text_parse_numbers(struct keyed_reader *reader, const struct keyed_field *field,
                             const char *name, struct keyed_span values, bool more,
                             double *numbers);
/// The last line.
int keyed_text_parse_end(const struct keyed_table *table, struct keyed_reader *reader);

/// Writes the first line and the fields.
void keyed_text_print(const struct keyed_table *table, int version, const void *record,
                      struct keyed_writer *writer);

/// Checks every field: ERROR_SYNTAX of texts, ERROR_RANGE of numbers. `fault` may be NULL.
int keyed_text_check(const struct keyed_table *table, const void *record,
                     struct calibration_fault *fault);

/// Rounds a number that fits core/decimal.h as printing and reading it would.
double keyed_text_rounded(double value, int decimals);
/// Rounds all KEYED_DECIMALS of a record that was checked.
void keyed_text_round(const struct keyed_table *table, void *record);

#ifdef __cplusplus
}
#endif

#endif
