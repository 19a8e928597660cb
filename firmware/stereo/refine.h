// SPDX-License-Identifier: Apache-2.0
/// Sub-pixel refinement of matches from the photometric residual of small windows, with a predicted
/// standard deviation per pixel, and measurement of the residual vertical disparity.
#ifndef VERGENCE_STEREO_REFINE_H
#define VERGENCE_STEREO_REFINE_H

#include <stdint.h>

#include "stereo/geometry/triangulate.h"
#include "stereo/match/match.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Working memory of `refine_disparities` in bytes.
size_t refine_need_bytes(int width, int height, int threads);

/// Moves each valid disparity by at most two pixels to the best agreement of the windows of both
/// images, and writes the predicted standard deviation in 1/256 px (0 where the pixel is not
/// valid). Only valid pixels change. ERROR_MEMORY.
int refine_disparities(const struct match_input *input, const struct parallel *parallel,
                       struct arena *arena, struct match_output *output,
                       struct image_u16 *sigma_q8);

/// Working memory of `refine_measure_vertical` in bytes.
size_t refine_vertical_need_bytes(void);

/// Measures the residual vertical disparity (right rows relative to left rows, sub-pixel, up to +-3
/// rows) on a textured sample of the valid matches and fits offset and slopes, robustly.
/// `vertical->samples` is 0 if fewer than 50 matches have enough texture. ERROR_MEMORY.
int refine_measure_vertical(const struct match_input *input, const struct match_output *output,
                            struct arena *arena, struct triangulate_vertical *vertical);

#ifdef __cplusplus
}
#endif

#endif
