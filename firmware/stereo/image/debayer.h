// SPDX-License-Identifier: Apache-2.0
/// Colour from a GRBG Bayer mosaic (MT9T001: even rows G R, odd rows B G), edge-aware.
/// Green along the weaker of the two gradients with second-order correction (Hamilton and Adams,
/// US patent 5,629,734, expired), then red and blue by colour differences.
#ifndef VERGENCE_STEREO_IMAGE_DEBAYER_H
#define VERGENCE_STEREO_IMAGE_DEBAYER_H

#include <stdint.h>

#include "stereo/image/image.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Columns that the working memory has in addition to a row's.
enum { DEBAYER_MARGIN_PX = 4 };

/// Computes one row of colour, `bits` (8..16) per channel, into `rgb` (3 * width values). `raw` is
/// the whole mosaic, at least 2x2; borders are mirrored so that the colour pattern continues.
/// `work` needs 3 * (width + DEBAYER_MARGIN_PX) values.
void debayer_row(const struct image_u16 *raw, int bits, int y, uint16_t *rgb, int32_t *work);

/// The same, where the last call with `work` was that for row y - 1: takes a third of green's time.
void debayer_next_row(const struct image_u16 *raw, int bits, int y, uint16_t *rgb, int32_t *work);

#ifdef __cplusplus
}
#endif

#endif
