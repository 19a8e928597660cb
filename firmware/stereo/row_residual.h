// SPDX-License-Identifier: Apache-2.0
/// The vertical disparity that rectification has left between the rows of a pair.
#ifndef VERGENCE_STEREO_ROW_RESIDUAL_H
#define VERGENCE_STEREO_ROW_RESIDUAL_H

#include "stereo/geometry/triangulate.h"
#include "stereo/match/match.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Working memory of `row_residual_measure` in bytes.
size_t row_residual_need_bytes(void);

/// Measures the residual vertical disparity (right rows relative to left rows, sub-pixel, up to +-3
/// rows) on a textured sample of the valid matches and fits offset and slopes, robustly.
/// `vertical->samples` is 0 if fewer than 50 matches have enough texture. ERROR_MEMORY.
int row_residual_measure(const struct match_input *input, const struct match_output *output,
                         struct arena *arena, struct triangulate_vertical *vertical);

#ifdef __cplusplus
}
#endif

#endif
