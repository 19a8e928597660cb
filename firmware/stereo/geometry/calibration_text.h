// SPDX-License-Identifier: Apache-2.0
/// What the texts of calibrations have in common: lines of words, numbers with a fixed count of
/// decimals, and a last line with a CRC-32. Reading stops at the first fault and names its line.
#ifndef VERGENCE_STEREO_GEOMETRY_CALIBRATION_TEXT_H
#define VERGENCE_STEREO_GEOMETRY_CALIBRATION_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "stereo/geometry/calibration_types.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A run of bytes inside the text; not zero-terminated.
struct calibration_span {
    const char *text;
    size_t length;
};

struct calibration_reader {
    const char *text;
    size_t length, position;  // start of the next line
    int line;                 // number of the present one
    struct calibration_fault fault;
};

/// Records the fault and returns `code`. `field` and `reason` have static storage.
int calibration_refuse(struct calibration_reader *reader, int code, const char *field,
                       const char *reason);

bool calibration_span_is(struct calibration_span span, const char *word);

/// Next line without its line feed.
int calibration_next_line(struct calibration_reader *reader, struct calibration_span *line);

/// Splits the first word and the blank after it off `rest`. If nothing follows the blank, `more`
/// stays true, so that it counts as an empty value.
struct calibration_span calibration_cut_word(struct calibration_span *rest, bool *more);

int calibration_copy_text(struct calibration_reader *reader, const char *field,
                          struct calibration_span value, char *target, size_t size);

/// One number with exactly `decimals` decimals within `min`..`max`; `*value` is set only on
/// success.
int calibration_parse_decimal(struct calibration_reader *reader, const char *field,
                              struct calibration_span word, int decimals, int64_t min, int64_t max,
                              double *value);

/// The last line. ERROR_MISSING: it has another name, which `name` receives (else it is empty).
int calibration_parse_crc(struct calibration_reader *reader, struct calibration_span *name);

struct calibration_writer {
    char *text;
    size_t size, length;  // `length` keeps counting when the text is full
};

void calibration_put(struct calibration_writer *writer, const char *word);
/// A blank, then the word; `calibration_put_known` writes "unknown" for an empty one.
void calibration_put_value(struct calibration_writer *writer, const char *word);
void calibration_put_known(struct calibration_writer *writer, const char *text);
/// A blank, then the number, which must fit the range of core/decimal.h.
void calibration_put_number(struct calibration_writer *writer, int decimals, double value);
/// Writes the last line. Returns the length of the text, or ERROR_BUFFER.
int calibration_put_crc(struct calibration_writer *writer);

/// Whether a text is legal as identifier; as date (YYYY-MM-DD, or empty); as one line (printable
/// ASCII without blanks at the ends, shorter than `bytes`; may be empty).
bool calibration_id_is_legal(const char *id);
bool calibration_date_is_legal(const char *date, size_t size);
bool calibration_line_is_legal(const char *line, size_t bytes);

#ifdef __cplusplus
}
#endif

#endif
