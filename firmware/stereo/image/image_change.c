// SPDX-License-Identifier: Apache-2.0
#include "stereo/image/image_change.h"

#include "core/invariant.h"
#include "stereo/image/sensor_noise.h"

enum {
    SQUARE = 4,
    VALUES = SQUARE * SQUARE,
    SIGMAS = 5,
};

static uint32_t sum_of(const struct raw_image *image, int row, size_t column) {
    uint32_t sum = 0;
    for (int y = row; y < row + SQUARE; y++) {
        const uint16_t *values = raw_image_row(image, y) + column;
        for (unsigned i = 0; i < SQUARE; i++) {
            sum += values[i];
        }
    }
    return sum;
}

uint32_t image_change_permille(const struct raw_image *before_image,
                               const struct raw_image *after_image, uint16_t known_gain_q3) {
    const size_t width = raw_image_row_values(before_image);
    INVARIANT(before_image->bits >= 8 && before_image->bits <= 16);
    INVARIANT(raw_image_row_values(after_image) == width);
    INVARIANT(after_image->height_px == before_image->height_px);
    const int bits = before_image->bits;
    const uint64_t gain_q3 = sensor_noise_gain_q3(known_gain_q3);
    const uint64_t read_q6 = sensor_noise_of_reading_q6(bits, gain_q3, VALUES);
    uint64_t squares = 0, changed = 0;
    for (int row = 0; row + SQUARE <= before_image->height_px; row += SQUARE) {
        for (size_t column = 0; column + SQUARE <= width; column += SQUARE) {
            const uint64_t before = sum_of(before_image, row, column);
            const uint64_t after = sum_of(after_image, row, column);
            const uint64_t apart = before > after ? before - after : after - before;
            const uint64_t variance_q6 =
                sensor_noise_of_light_q6(bits, gain_q3, before + after) + 2 * read_q6;
            squares++;
            changed += apart * apart * 64 > SIGMAS * SIGMAS * variance_q6;
        }
    }
    INVARIANT(changed <= squares);
    return squares == 0 ? 0 : (uint32_t)(changed * 1000 / squares);
}
