// SPDX-License-Identifier: Apache-2.0
/// The grammar of the calibration text as data: one entry a line, in the order of the text.
/// A line is the field's name and its values, separated by single spaces and closed by a line feed.
/// Before the fields stands the line CALIBRATION_GRAMMAR_FIRST_LINE, after them the line
/// `crc32 XXXXXXXX` (eight lower-case hexadecimal digits, over all bytes before it).
#ifndef VERGENCE_CORE_CALIBRATION_GRAMMAR_H
#define VERGENCE_CORE_CALIBRATION_GRAMMAR_H

#include <stddef.h>
#include <stdint.h>

#include "core/calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CALIBRATION_GRAMMAR_MAGIC "vergence-calibration "
#define CALIBRATION_GRAMMAR_FIRST_LINE CALIBRATION_GRAMMAR_MAGIC "1"
#define CALIBRATION_GRAMMAR_CRC "crc32"
#define CALIBRATION_GRAMMAR_NO_DATE "unknown"

enum calibration_field_kind {
    CALIBRATION_FIELD_ID,        // one or more of A-Z a-z 0-9 . _ -
    CALIBRATION_FIELD_DATE,      // YYYY-MM-DD or "unknown"
    CALIBRATION_FIELD_NOTE,      // the rest of the line, may be empty
    CALIBRATION_FIELD_FLAG,      // "yes" or "no"
    CALIBRATION_FIELD_INTEGERS,  // `count` integers, stored as int
    CALIBRATION_FIELD_DECIMALS,  // `count` numbers with `decimals` decimals, stored as double
};

enum { CALIBRATION_FIELD_MAX_COUNT = 3 };

struct calibration_field {
    const char *name;
    enum calibration_field_kind kind;
    int count;         // values
    int decimals;      // exactly that many after the point
    int64_t min, max;  // legal range of each value, in whole units, both ends included
    const char *unit;  // "" when it has none
    const char *meaning;
    size_t offset[CALIBRATION_FIELD_MAX_COUNT];  // of each value in struct calibration
};

/// All fields in the order of the text; static storage. `count` takes how many.
const struct calibration_field *calibration_grammar_fields(int *count);

/// Value i, 0 <= i < count, of a number field.
double calibration_grammar_value(const struct calibration_field *field, int i,
                                 const struct calibration *calibration);
/// Stores value i of a number field; an integer field takes whole numbers only.
void calibration_grammar_set(const struct calibration_field *field, int i, double value,
                             struct calibration *calibration);

#ifdef __cplusplus
}
#endif

#endif
