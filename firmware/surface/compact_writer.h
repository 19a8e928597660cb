// SPDX-License-Identifier: Apache-2.0
/// Writes a compact surface (daemon/surface.md) a band of rows at a time: head, rows, CRC-32. The
/// caller lends all memory, packs the chunks and takes the bytes.
#ifndef VERGENCE_SURFACE_COMPACT_WRITER_H
#define VERGENCE_SURFACE_COMPACT_WRITER_H

#include <stddef.h>
#include <stdint.h>

#include "surface/compact_band.h"
#include "surface/compact_fields.h"

#ifdef __cplusplus
extern "C" {
#endif

struct compact_output {
    /// Packs a chunk as a stream of zlib (RFC 1950) into `packed`; returns its length.
    size_t (*pack)(void *self, uint8_t *bytes, size_t length, uint8_t *packed);
    void (*put)(void *self, const void *bytes, size_t length);
    void *self;
};

struct compact_writer {
    struct compact_output output;
    uint32_t crc;
    const struct reconstruct_result *result;
    struct compact_band band;
    uint8_t *packed;
    int rows;  // written
};

/// Begins with the first line. `output` is copied.
void compact_writer_begin(struct compact_writer *self, const struct compact_output *output);
/// The head: the fields of a record, further lines, and at its end the calibration. ERROR_RANGE: it
/// cannot be described.
void compact_writer_fields(struct compact_writer *self, const struct compact_field *fields,
                           size_t count, const void *record);
void compact_writer_text(struct compact_writer *self, const char *name, const char *text);
int compact_writer_calibration(struct compact_writer *self, const struct calibration *calibration);
/// Begins the rows. `memory`: compact_band_bytes of the width, aligned for int32_t; `packed`: room
/// for a packed chunk of compact_band_pixels bytes.
void compact_writer_rows(struct compact_writer *self, const struct reconstruct_result *result,
                         void *memory, uint8_t *packed);
/// Writes the next band, and after the last one the end. Returns the number of rows written so far;
/// maps above them are not read again.
int compact_writer_band(struct compact_writer *self);

/// A `pack` for processors without zlib: the bytes as they are.
enum { COMPACT_STORED_MORE_BYTES = 11 };
size_t compact_stored(void *self, uint8_t *bytes, size_t length, uint8_t *packed);
/// At most so many bytes come after the head with it.
size_t compact_stored_rows_bytes(int width, int height);

#ifdef __cplusplus
}
#endif

#endif
