// SPDX-License-Identifier: Apache-2.0
/// From what a camera or a file delivers to 8 bit grey (for matching) and colour (for texture).
#ifndef VERGENCE_RIG_DEVELOP_H
#define VERGENCE_RIG_DEVELOP_H

#include "core/arena.h"
#include "core/parallel.h"
#include "rig/reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Working memory of `develop_image` in bytes.
size_t develop_need_bytes(int width_px, int bits, int threads);

/// Fills `grey` and `colour` (both of the raw image's size). Values of more than 8 bits are
/// brought to 8: a Bayer mosaic is linear in light and goes through a square root, which makes
/// photon noise equal at all brightnesses, so dark regions keep their detail; other images are
/// taken as already encoded for viewing and are scaled. ERROR_ARGUMENT for bits outside 8..16 or a
/// mosaic smaller than 2x2; ERROR_MEMORY.
int develop_image(const struct reconstruct_image *raw, const struct parallel *parallel,
                  struct arena *arena, struct image_u8 *grey, struct image_rgb8 *colour);

#ifdef __cplusplus
}
#endif

#endif
