// SPDX-License-Identifier: Apache-2.0
/// Sub-pixel refinement of matches from the photometric residual of small windows, with a predicted
/// standard deviation per pixel. Rows in, rows out.
#ifndef VERGENCE_STEREO_SUBPIXEL_H
#define VERGENCE_STEREO_SUBPIXEL_H

#include <stdbool.h>
#include <stdint.h>

#include "stereo/match/match.h"

#ifdef __cplusplus
extern "C" {
#endif

struct subpixel_strip;

enum {
    SUBPIXEL_LATE_ROWS = 10,  // a result depends on that many rows of disparities above and below
    SUBPIXEL_IMAGE_ROWS = 6,  // and a call on that many rows of the images above the new ones
};

/// A fit in progress. The members are its own.
struct subpixel {
    const struct parallel *parallel;
    struct subpixel_strip *strips;
    int strip_count;
    int height;
    int arrived;  // rows
    int until;    // with those of the present batch
    bool plain;
};

/// A sigma in 1/256 px, 2 to 256 or 0, in one byte of a map.
static inline uint8_t subpixel_sigma_code(int sigma_q8) {
    return (uint8_t)(sigma_q8 - (sigma_q8 > 0));
}
static inline uint16_t subpixel_sigma_q8(uint8_t code) {
    return (uint16_t)(code + (code > 0));
}

/// Working memory of a fit in bytes: O(width), whatever the height.
size_t subpixel_need_bytes(int width, int threads);

/// Prepares a fit, which moves each valid disparity by at most two pixels to the best agreement of
/// the windows of both images, and writes the predicted standard deviation as
/// subpixel_sigma_code (0 where the pixel is not valid). Only valid pixels change; results do not
/// depend on `parallel` or on batches. All arguments and the memory taken from `arena` are used
/// until the last row. `plain` avoids the processor's own instructions, for tests. ERROR_MEMORY.
int subpixel_begin(struct subpixel *fit, const struct match_input *input,
                   const struct parallel *parallel, struct arena *arena,
                   struct match_output *output, struct image_u8 *sigma, bool plain);

/// Rows below `rows` of both images, of disparities and of reasons are there: refines all that it
/// can and returns the number of finished rows, rows - SUBPIXEL_LATE_ROWS or all. Where the
/// previous call had `before` rows, this one reads rows from before - SUBPIXEL_IMAGE_ROWS of the
/// images and from before - SUBPIXEL_LATE_ROWS of disparities and reasons, and writes the rows that
/// it finishes.
int subpixel_advance(struct subpixel *fit, int rows);

#ifdef __cplusplus
}
#endif

#endif
