// SPDX-License-Identifier: Apache-2.0
/// From what a camera or a file delivers to 8 bit grey (for matching) and colour (for texture).
#ifndef VERGENCE_STEREO_DEVELOP_H
#define VERGENCE_STEREO_DEVELOP_H

#include <stdint.h>

#include "core/arena.h"
#include "core/parallel.h"
#include "stereo/reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { DEVELOP_BALANCE_ONE = 256 };

/// Factors of red, green and blue that make a picture's white white, in 1/256; the least is 1.
struct develop_balance {
    uint16_t gain_q8[3];
};

/// Those of a mosaic, for which raw red, green and blue have equal means of their fourth powers:
/// between the grey world, which a large coloured thing misleads, and the brightest spot, which a
/// lamp misleads (Finlayson and Trezzi, Shades of Gray and Colour Constancy, CIC 2004). At most 4,
/// so that noise is not made a colour. All 1 for other layouts: their colours are meant as they
/// are.
struct develop_balance develop_balance_of(const struct reconstruct_image *raw);

/// Working memory of `develop_image` in bytes.
size_t develop_need_bytes(int width_px, int bits, int threads);

/// Fills `grey` and `colour` (both of the raw image's size). Values of more than 8 bits are
/// brought to 8: a Bayer mosaic is linear in light and goes through a square root, which makes
/// photon noise equal at all brightnesses, so dark regions keep their detail; other images are
/// taken as already encoded for viewing and are scaled. The balance changes colours alone: grey is
/// for matching, where amplified noise would harm. ERROR_ARGUMENT for bits outside 8..16 or a
/// mosaic smaller than 2x2; ERROR_MEMORY.
int develop_image(const struct reconstruct_image *raw, const struct develop_balance *balance,
                  const struct parallel *parallel, struct arena *arena, struct image_u8 *grey,
                  struct image_rgb8 *colour);

#ifdef __cplusplus
}
#endif

#endif
