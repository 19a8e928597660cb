// SPDX-License-Identifier: Apache-2.0
/// Fits a plane and a curved surface to measured vertical disparities, robustly.
#ifndef VERGENCE_STEREO_ROW_TREND_H
#define VERGENCE_STEREO_ROW_TREND_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// A measured value within +-3 px and its position on a lattice, at most +-512.
struct row_sample {
    int16_t x, y;
    int16_t vertical_q12;
};

struct row_trend {
    double plane_px[3];        // at (0, 0), and slopes per step of the lattice along x and y
    double scatter_px;         // about the plane: 1.5 times the median distance
    double median_px, p95_px;  // of |measured value|
    double plane_p95_px, curve_p95_px;  // 95th percentiles at the samples: of |plane|, and of the
                                        // distance between plane and curved surface
};

/// `samples` row by row, at most 4096; `work` has one element each.
void row_trend_fit(const struct row_sample *samples, int count, int16_t *work,
                   struct row_trend *trend);

#ifdef __cplusplus
}
#endif

#endif
