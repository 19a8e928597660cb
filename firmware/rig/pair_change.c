// SPDX-License-Identifier: Apache-2.0
#include "rig/pair_change.h"

#include "core/invariant.h"

enum {
    SQUARE = 4,
    VALUES = SQUARE * SQUARE,
    SIGMAS = 5,
    WELL_E = 5000,
    GAIN_ONE_Q3 = 8,
    GAIN_UNKNOWN_Q3 = 32,
};

static uint32_t sum_of(const uint16_t *frame, uint32_t width) {
    uint32_t sum = 0;
    for (unsigned row = 0; row < SQUARE; row++) {
        for (unsigned column = 0; column < SQUARE; column++) {
            sum += frame[(uint64_t)row * width + column];
        }
    }
    return sum;
}

uint32_t pair_change_permille(const struct pair_change_frames *frames) {
    INVARIANT(frames->bits >= 8 && frames->bits <= 16);
    const uint64_t range = UINT64_C(1) << frames->bits;
    const uint64_t gain_q3 = frames->gain_q3 != 0 ? frames->gain_q3 : GAIN_UNKNOWN_Q3;
    // Variance of a sum of values: shot noise is proportional to the sum, read noise is constant.
    // Everything is times 8 * 8, as the gain squared is; both occur in each of two frames.
    const uint64_t light_q6 = gain_q3 * GAIN_ONE_Q3 * range;  // / WELL_E
    const uint64_t read_q6 = VALUES * gain_q3 * gain_q3 * range * range / 1024 * 9 / 4 / 1024;
    uint64_t squares = 0, changed = 0;
    for (uint32_t row = 0; row + SQUARE <= frames->height; row += SQUARE) {
        for (uint32_t column = 0; column + SQUARE <= frames->width; column += SQUARE) {
            const uint64_t at = (uint64_t)row * frames->width + column;
            const uint64_t before = sum_of(frames->before + at, frames->width);
            const uint64_t after = sum_of(frames->after + at, frames->width);
            const uint64_t apart = before > after ? before - after : after - before;
            const uint64_t variance_q6 = (before + after) * light_q6 / WELL_E + 2 * read_q6;
            squares++;
            changed += apart * apart * 64 > SIGMAS * SIGMAS * variance_q6;
        }
    }
    INVARIANT(changed <= squares);
    return squares == 0 ? 0 : (uint32_t)(changed * 1000 / squares);
}
