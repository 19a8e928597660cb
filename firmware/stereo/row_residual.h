// SPDX-License-Identifier: Apache-2.0
/// The vertical disparity that rectification has left between the rows of a pair.
#ifndef VERGENCE_STEREO_ROW_RESIDUAL_H
#define VERGENCE_STEREO_ROW_RESIDUAL_H

#include "stereo/geometry/triangulate.h"
#include "stereo/match/match.h"
#include "stereo/row_trend.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { ROW_RESIDUAL_AROUND = 11 };  // rows of the images that a sample needs above and below

/// A measurement in progress. The members are its own.
struct row_residual {
    const struct match_input *input;
    const struct match_output *output;
    struct row_sample *samples;
    int16_t *work;
    int count, step, next_y;
};

/// Memory of a measurement in bytes.
size_t row_residual_need_bytes(void);

/// Prepares a measurement, rows in their order; the arguments and the memory from `arena` are used
/// until its end. ERROR_MEMORY.
int row_residual_begin(struct row_residual *residual, const struct match_input *input,
                       const struct match_output *output, struct arena *arena);

/// Rows below `rows` of the images are there, and of the matches those up to ROW_RESIDUAL_AROUND
/// above are final.
void row_residual_add(struct row_residual *residual, int rows);

/// After all rows: the residual vertical disparity (right rows relative to left rows, sub-pixel, up
/// to +-3 rows) on a textured sample of the valid matches, with its offset and slopes, fitted
/// robustly. `vertical->samples` is 0 if fewer than 50 matches have enough texture. May ask for
/// rows of the images again.
void row_residual_finish(struct row_residual *residual, struct triangulate_vertical *vertical);

#ifdef __cplusplus
}
#endif

#endif
