// SPDX-License-Identifier: Apache-2.0
/// Lines of words and of numbers with a fixed count of decimals, and a last line with a CRC-32 of
/// all before it. Reading stops at the first fault and names its line.
#ifndef VERGENCE_STEREO_GEOMETRY_KEYED_LINE_H
#define VERGENCE_STEREO_GEOMETRY_KEYED_LINE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "stereo/geometry/calibration_types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define KEYED_LINE_CRC "crc32"
#define KEYED_LINE_UNKNOWN "unknown"

/// A run of bytes inside the text; not zero-terminated.
struct keyed_span {
    const char *text;
    size_t length;
};

struct keyed_reader {
    const char *text;
    size_t length, position;  // start of the next line
    int line;                 // number of the present one
    struct calibration_fault fault;
};

/// Records the fault and returns `code`. `name` and `reason` have static storage.
int keyed_refuse(struct keyed_reader *reader, int code, const char *name, const char *reason);

bool keyed_span_is(struct keyed_span span, const char *word);

/// Next line without its line feed.
int keyed_next_line(struct keyed_reader *reader, struct keyed_span *line);

/// Splits the first word and the blank after it off `rest`. If nothing follows the blank, `more`
/// stays true, so that it counts as an empty value.
struct keyed_span keyed_cut_word(struct keyed_span *rest, bool *more);

/// Fills `target` with a text and zeros.
int keyed_copy_text(struct keyed_reader *reader, const char *name, struct keyed_span value,
                    char *target, size_t size);

/// The next of the values: one number with exactly `decimals` decimals within `min`..`max`;
/// `*value` is set only on success.
int keyed_parse_number(struct keyed_reader *reader, const char *name, struct keyed_span *values,
                       bool *more, int decimals, int64_t min, int64_t max, double *value);

/// The last line. ERROR_MISSING: it has another name, which `name` receives (else it is empty).
int keyed_parse_crc(struct keyed_reader *reader, struct keyed_span *name);

struct keyed_writer {
    char *text;
    size_t size, length;  // `length` keeps counting when the text is full
};

void keyed_put(struct keyed_writer *writer, const char *word);
/// A blank, then the word; `keyed_put_known` writes "unknown" for an empty one.
void keyed_put_value(struct keyed_writer *writer, const char *word);
void keyed_put_known(struct keyed_writer *writer, const char *text);
/// A blank, then the number, which must fit the range of core/decimal.h.
void keyed_put_number(struct keyed_writer *writer, int decimals, double value);
/// Writes the last line. Returns the length of the text, or ERROR_BUFFER.
int keyed_put_crc(struct keyed_writer *writer);

#ifdef __cplusplus
}
#endif

#endif
