// SPDX-License-Identifier: Apache-2.0
/// Sub-pixel refinement of matches from the photometric residual of small windows, with a predicted
/// standard deviation per pixel.
#ifndef VERGENCE_STEREO_SUBPIXEL_H
#define VERGENCE_STEREO_SUBPIXEL_H

#include <stdint.h>

#include "stereo/match/match.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Working memory of `subpixel_fit` in bytes.
size_t subpixel_need_bytes(int width, int height, int threads);

/// Moves each valid disparity by at most two pixels to the best agreement of the windows of both
/// images, and writes the predicted standard deviation in 1/256 px (0 where the pixel is not
/// valid). Only valid pixels change. ERROR_MEMORY.
int subpixel_fit(const struct match_input *input, const struct parallel *parallel,
                 struct arena *arena, struct match_output *output, struct image_u16 *sigma_q8);

#ifdef __cplusplus
}
#endif

#endif
