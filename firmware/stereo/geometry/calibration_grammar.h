// SPDX-License-Identifier: Apache-2.0
/// The grammar of the calibration text as data: one entry per line, in the order of the text. A
/// line has the field's name and its values, separated by single spaces and ended by a line feed.
/// The fields follow the line CALIBRATION_GRAMMAR_FIRST_LINE, or that of a later version, which has
/// more fields; after them comes the line `crc32 XXXXXXXX` (eight lower-case hexadecimal digits,
/// over all bytes before it).
#ifndef VERGENCE_STEREO_GEOMETRY_CALIBRATION_GRAMMAR_H
#define VERGENCE_STEREO_GEOMETRY_CALIBRATION_GRAMMAR_H

#include <stddef.h>
#include <stdint.h>

#include "stereo/geometry/calibration_types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CALIBRATION_GRAMMAR_MAGIC "vergence-calibration "
#define CALIBRATION_GRAMMAR_FIRST_LINE CALIBRATION_GRAMMAR_MAGIC "1"
#define CALIBRATION_GRAMMAR_CRC "crc32"
#define CALIBRATION_GRAMMAR_UNKNOWN "unknown"
#define CALIBRATION_GRAMMAR_NO_AXIS "none"

enum { CALIBRATION_GRAMMAR_VERSIONS = 4 };

enum calibration_field_kind {
    CALIBRATION_FIELD_ID,        // one or more of A-Z a-z 0-9 . _ -
    CALIBRATION_FIELD_DATE,      // YYYY-MM-DD or "unknown"
    CALIBRATION_FIELD_NOTE,      // the rest of the line, may be empty
    CALIBRATION_FIELD_FLAG,      // "yes" or "no"
    CALIBRATION_FIELD_INTEGERS,  // `count` integers, stored as int
    CALIBRATION_FIELD_DECIMALS,  // `count` numbers with `decimals` decimals, stored as double
    CALIBRATION_FIELD_NAME,      // the rest of the line, or "unknown"
    CALIBRATION_FIELD_WINDOW,    // three integers, or "unknown"
    CALIBRATION_FIELD_LENS,      // name of an `enum lens_kind`
    CALIBRATION_FIELD_AXIS,      // mean and spread with `decimals` decimals, "none" or "unknown"
};

enum { CALIBRATION_FIELD_MAX_COUNT = 3 };

struct calibration_field {
    const char *name;
    enum calibration_field_kind kind;
    int version;       // first version of the text that has it
    int count;         // number of values
    int decimals;      // exact number of digits after the point
    int64_t min, max;  // legal range of each value, in whole units, both ends included
    const char *unit;  // "" if it has none
    const char *meaning;
    size_t offset[CALIBRATION_FIELD_MAX_COUNT];  // offset of each value in struct calibration
};

/// All fields in the order of the text; static storage. `count` receives their number. Fields of
/// later versions follow those of earlier ones.
const struct calibration_field *calibration_grammar_fields(int *count);

/// Number of fields in a text of `version`, 1 to CALIBRATION_GRAMMAR_VERSIONS.
int calibration_grammar_count(int version);

/// The version of a calibration's text: the first one that has all that it says.
int calibration_grammar_version(const struct calibration *calibration);

/// Address of a field that is not a number: the flag, the kind of lens, the text
/// (CALIBRATION_NAME_BYTES), the window, or the axis.
bool *calibration_grammar_flag(const struct calibration_field *field,
                               struct calibration *calibration);
enum lens_kind *calibration_grammar_lens(const struct calibration_field *field,
                                         struct calibration *calibration);
char *calibration_grammar_name(const struct calibration_field *field,
                               struct calibration *calibration);
struct calibration_window *calibration_grammar_window(const struct calibration_field *field,
                                                      struct calibration *calibration);
struct calibration_axis *calibration_grammar_axis(const struct calibration_field *field,
                                                  struct calibration *calibration);

/// Value i, 0 <= i < count, of a number field.
double calibration_grammar_value(const struct calibration_field *field, int i,
                                 const struct calibration *calibration);
/// Stores value i of a number field; an integer field accepts integers only.
void calibration_grammar_set(const struct calibration_field *field, int i, double value,
                             struct calibration *calibration);

#ifdef __cplusplus
}
#endif

#endif
