// SPDX-License-Identifier: Apache-2.0
/// The rows of a compact surface, in bands: for its writer and its reader only. A band has
/// a chunk for each byte of each value, so that deflate sees like next to like: what differs from a
/// prediction by the pixels around.
#ifndef VERGENCE_SURFACE_COMPACT_BAND_H
#define VERGENCE_SURFACE_COMPACT_BAND_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define COMPACT_MAGIC "vergence compact surface "

enum { COMPACT_CRC_BYTES = 4, COMPACT_VALUE_BYTES = 3 };

/// Values of a pixel after its reason. Red and blue are differences to green, modulo 256.
enum compact_channel {
    COMPACT_CONFIDENCE,
    COMPACT_SIGMA,
    COMPACT_DISPARITY,
    COMPACT_GREEN,
    COMPACT_RED,
    COMPACT_BLUE,
    COMPACT_CHANNELS
};

/// Bytes of a value, and whether it has a sign.
struct compact_form {
    int bytes;
    bool is_signed;
};
extern const struct compact_form compact_forms[COMPACT_CHANNELS];

/// Rows of values, and the chunks of a band.
struct compact_band {
    int width, rows_max;
    int32_t *row[COMPACT_CHANNELS][2];  // the row before and the present one
    uint8_t *reason;
    uint8_t *chunk[COMPACT_CHANNELS][COMPACT_VALUE_BYTES];
    size_t used[COMPACT_CHANNELS];
};

/// Pixels in a band of a picture, at most: the length of its longest chunk.
size_t compact_band_pixels(int width);
/// Memory of a band.
size_t compact_band_bytes(int width);
/// Lays a band out in that memory.
void compact_band_lay(int width, void *memory, struct compact_band *band);

/// The value modulo 2 to the number of its bits.
int32_t compact_wrap(int32_t value, int bytes, bool is_signed);

/// Whether a pixel has a value in the file. One that has none counts as its prediction.
bool compact_is_kept(enum compact_channel channel, uint8_t reason);

/// Appends row[1] to the chunks of its channel, or takes it from there; it is row[0] then. `first`:
/// it is the first row of all.
void compact_encode(struct compact_band *band, enum compact_channel channel, const uint8_t *reason,
                    bool first);
void compact_decode(struct compact_band *band, enum compact_channel channel, const uint8_t *reason,
                    bool first);

#ifdef __cplusplus
}
#endif

#endif
