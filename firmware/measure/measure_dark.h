// SPDX-License-Identifier: Apache-2.0
/// How much of the subject is too dark to be measured with one exposure. Integers only.
#ifndef VERGENCE_MEASURE_MEASURE_DARK_H
#define VERGENCE_MEASURE_MEASURE_DARK_H

#include <stdint.h>

#include "core/raw_image.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A part of a frame, px; it may reach beyond it.
struct measure_box {
    int column_px, row_px, width_px, height_px;
};

enum {
    MEASURE_DARK_BLOCK_PX = 8,
    MEASURE_DARK_PERMILLE = 40,  ///< of the range above black: what daemon/RESULTS.md calls dark
};

/// Blocks of MEASURE_DARK_BLOCK_PX a side within the box whose mean of green is less than
/// MEASURE_DARK_PERMILLE of the range above `black`, in 1/1000 of those in the box; 0: there is
/// none.
uint32_t measure_dark_permille(const struct raw_image *image, uint16_t black,
                               const struct measure_box *box);

#ifdef __cplusplus
}
#endif

#endif
