// SPDX-License-Identifier: Apache-2.0
#include "surface/compact_band.h"

#include "stereo/image/reason.h"

enum { BAND_PIXELS = 1 << 15 };  // about: a chunk has the length of a few blocks of deflate

const struct compact_form compact_forms[COMPACT_CHANNELS] = {
    [COMPACT_CONFIDENCE] = {1, false}, [COMPACT_SIGMA] = {2, false},
    [COMPACT_DISPARITY] = {3, true},   [COMPACT_GREEN] = {1, false},
    [COMPACT_RED] = {1, true},         [COMPACT_BLUE] = {1, true},
};

static int band_rows(int width) {
    return width >= BAND_PIXELS ? 1 : BAND_PIXELS / width;
}

size_t compact_band_pixels(int width) {
    return (size_t)width * (size_t)band_rows(width);
}

size_t compact_band_bytes(int width) {
    size_t bytes = compact_band_pixels(width);
    for (int i = 0; i < COMPACT_CHANNELS; i++) {
        bytes += 2 * (size_t)width * sizeof(int32_t) +
                 (size_t)compact_forms[i].bytes * compact_band_pixels(width);
    }
    return bytes;
}

void compact_band_lay(int width, void *memory, struct compact_band *band) {
    const size_t pixels = compact_band_pixels(width);
    uint8_t *at = memory;
    *band = (struct compact_band){.width = width, .rows_max = band_rows(width)};
    for (int i = 0; i < COMPACT_CHANNELS; i++, at += 2 * (size_t)width * sizeof(int32_t)) {
        band->row[i][0] = (int32_t *)(void *)at;
        band->row[i][1] = band->row[i][0] + width;
    }
    for (int i = 0; i < COMPACT_CHANNELS; i++) {
        for (int byte = 0; byte < compact_forms[i].bytes; byte++, at += pixels) {
            band->chunk[i][byte] = at;
        }
    }
    band->reason = at;
}

int32_t compact_wrap(int32_t value, int bytes, bool is_signed) {
    const uint32_t half = 1u << (8 * bytes - 1), mask = 2 * half - 1;
    const uint32_t bits = (uint32_t)value & mask;
    return is_signed && bits >= half ? (int32_t)bits - (int32_t)mask - 1 : (int32_t)bits;
}

/// The pixel to the left, above, or on the plane of both and the one between them, whichever is the
/// median (LOCO-I: M. Weinberger, G. Seroussi, G. Sapiro, 1996).
static int32_t predict(const int32_t *above, const int32_t *row, int x, bool first) {
    if (x == 0) {
        return first ? 0 : above[0];
    }
    const int32_t left = row[x - 1];
    if (first) {
        return left;
    }
    const int32_t low = left < above[x] ? left : above[x];
    const int32_t high = left < above[x] ? above[x] : left;
    const int32_t plane = left + above[x] - above[x - 1];
    return plane < low ? low : plane > high ? high : plane;
}

bool compact_is_kept(enum compact_channel channel, uint8_t reason) {
    return channel != COMPACT_DISPARITY || reason_has_point(reason) || reason_has_disparity(reason);
}

void compact_encode(struct compact_band *band, enum compact_channel channel, const uint8_t *reason,
                    bool first) {
    int32_t *const above = band->row[channel][0], *const row = band->row[channel][1];
    const int bytes = compact_forms[channel].bytes, width = band->width;
    uint8_t *const *chunk = band->chunk[channel];
    size_t used = band->used[channel];
    for (int x = 0; x < width; x++) {
        const int32_t guess = predict(above, row, x, first);
        if (!compact_is_kept(channel, reason[x])) {
            row[x] = guess;
            continue;
        }
        const int32_t off = compact_wrap(row[x] - guess, bytes, true);
        const uint32_t code = off < 0 ? ~((uint32_t)off << 1) : (uint32_t)off << 1;
        for (int byte = 0; byte < bytes; byte++) {
            chunk[byte][used] = (uint8_t)(code >> (8 * byte));
        }
        used++;
    }
    band->used[channel] = used;
    band->row[channel][0] = row;
    band->row[channel][1] = above;
}

void compact_decode(struct compact_band *band, enum compact_channel channel, const uint8_t *reason,
                    bool first) {
    int32_t *const above = band->row[channel][0], *const row = band->row[channel][1];
    const int bytes = compact_forms[channel].bytes;
    for (int x = 0; x < band->width; x++) {
        row[x] = predict(above, row, x, first);
        if (!compact_is_kept(channel, reason[x])) {
            continue;
        }
        uint32_t code = 0;
        for (int byte = 0; byte < bytes; byte++) {
            code |= (uint32_t)band->chunk[channel][byte][band->used[channel]] << (8 * byte);
        }
        band->used[channel]++;
        const int32_t off = (int32_t)(code >> 1) ^ -(int32_t)(code & 1);
        row[x] = compact_wrap(row[x] + off, bytes, compact_forms[channel].is_signed);
    }
    band->row[channel][0] = row;
    band->row[channel][1] = above;
}
