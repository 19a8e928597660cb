// SPDX-License-Identifier: Apache-2.0
/// From raw frames of a camera or file to 8-bit grey (for matching) and colour (for texture).
#ifndef VERGENCE_STEREO_DEVELOP_H
#define VERGENCE_STEREO_DEVELOP_H

#include <stdint.h>

#include "core/arena.h"
#include "core/parallel.h"
#include "stereo/reconstruct_types.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { DEVELOP_BALANCE_ONE = 256 };

/// White balance factors of red, green and blue in 1/256; the smallest is 1.
struct develop_balance {
    uint16_t gain_q8[3];
};

/// White balance of a mosaic: makes the means of the fourth powers of raw red, green and blue
/// equal. This is between grey world, which a large coloured object misleads, and brightest spot,
/// which a lamp misleads (Finlayson and Trezzi, Shades of Gray and Colour Constancy, CIC 2004). At
/// most 4, so that noise does not become colour. All 1 for other layouts, whose colours are final.
struct develop_balance develop_balance_of(const struct raw_image *raw);

/// A raw image that is developed in parts. Its buffers are in the arena of develop_begin.
struct develop_state {
    const struct raw_image *raw;
    uint8_t *tone;         // 8-bit value of each raw value
    uint8_t *balanced[3];  // the same for each channel, balanced
    uint16_t *rgb;         // 3 * width values per part
    int32_t *work;         // 3 * (width + DEBAYER_MARGIN_PX) values per part
    int parts;
};

/// Working memory of `develop_begin` in bytes.
size_t develop_need_bytes(int width_px, int bits, int threads);

/// Begins with an image. Grey and colour: values of more than 8 bits are reduced
/// to 8. A Bayer mosaic is linear in light and gets a square root, which makes photon noise equal
/// at all brightnesses, so that dark regions keep their detail. Other images are already encoded
/// for viewing and are only scaled. The balance changes colours only: amplified noise in grey would
/// harm matching. ERROR_ARGUMENT for bits outside 8..16 or a mosaic smaller than 2x2; ERROR_MEMORY.
int develop_begin(struct develop_state *develop, const struct raw_image *raw,
                  const struct develop_balance *balance, int threads, struct arena *arena);

/// Develops the rows from `begin` on into `grey` and `colour`, which have as many rows as are
/// wanted and the raw image's width; `colour` may have no data. `parallel` has at most the threads
/// of develop_begin.
void develop_rows(const struct develop_state *develop, const struct parallel *parallel, int begin,
                  struct image_u8 *grey, struct image_rgb8 *colour);

/// Both, for the whole image.
int develop_image(const struct raw_image *raw, const struct develop_balance *balance,
                  const struct parallel *parallel, struct arena *arena, struct image_u8 *grey,
                  struct image_rgb8 *colour);

#ifdef __cplusplus
}
#endif

#endif
