// SPDX-License-Identifier: Apache-2.0
#include "measure/measure_dark.h"

#include <stdbool.h>

#include "core/invariant.h"
#include "focus/exposure_measure.h"

enum { PERMILLE = 1000 };

static bool is_dark(const struct raw_image *image, uint16_t black, int column, int row) {
    const int channels = image->layout == RAW_RGB ? 3 : 1;
    const int step = exposure_green_step(image->layout);
    uint64_t sum = 0, count = 0;
    for (int y = row; y < row + MEASURE_DARK_BLOCK_PX; y++) {
        const uint16_t *values = raw_image_row(image, y) + (size_t)column * (size_t)channels;
        for (int x = exposure_first_green(image->layout, y); x < MEASURE_DARK_BLOCK_PX * channels;
             x += step) {
            sum += values[x];
            count++;
        }
    }
    const uint64_t range = (UINT64_C(1) << image->bits) - 1 - black;
    return sum * PERMILLE < count * (black * (uint64_t)PERMILLE + range * MEASURE_DARK_PERMILLE);
}

// The first multiple of a block, which begins a mosaic's tile, at or after a place.
static int begin_at(int64_t place_px) {
    const int64_t inside = place_px > 0 ? place_px : 0;
    return (int)((inside + MEASURE_DARK_BLOCK_PX - 1) / MEASURE_DARK_BLOCK_PX *
                 MEASURE_DARK_BLOCK_PX);
}

static int64_t end_at(int64_t place_px, int size_px) {
    return (place_px < size_px ? place_px : size_px) - MEASURE_DARK_BLOCK_PX;
}

uint32_t measure_dark_permille(const struct raw_image *image, uint16_t black,
                               const struct measure_box *box) {
    INVARIANT(image->data != NULL && image->bits >= 8 && image->bits <= 16);
    const int64_t last_column = end_at((int64_t)box->column_px + box->width_px, image->width_px);
    const int64_t last_row = end_at((int64_t)box->row_px + box->height_px, image->height_px);
    uint64_t dark = 0, blocks = 0;
    if (black >= (1 << image->bits) - 1 || box->column_px > image->width_px ||
        box->row_px > image->height_px) {
        return 0;
    }
    for (int row = begin_at(box->row_px); row <= last_row; row += MEASURE_DARK_BLOCK_PX) {
        for (int column = begin_at(box->column_px); column <= last_column;
             column += MEASURE_DARK_BLOCK_PX) {
            dark += is_dark(image, black, column, row);
            blocks++;
        }
    }
    return blocks > 0 ? (uint32_t)(dark * PERMILLE / blocks) : 0;
}
