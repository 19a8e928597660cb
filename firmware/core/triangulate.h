// SPDX-License-Identifier: Apache-2.0
/// Points from disparities: mid-points of the two real camera rays, in the left camera's frame.
/// The rectified pixel (x, y) and the raw pixel that rectification sampled for it lie on the same
/// ray (a test measures the table's error), so rays are taken in the rect frame and turned back.
/// A residual vertical disparity moves the right ray off the row; the rays then miss each other.
#ifndef VERGENCE_CORE_TRIANGULATE_H
#define VERGENCE_CORE_TRIANGULATE_H

#include <stdint.h>

#include "core/rectify.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Residual vertical disparity of a rectified pair: at (x, y) the right match lies at
/// y + offset + slope_x (x - width/2) + slope_y (y - height/2).
struct triangulate_vertical {
    double offset_px, slope_x, slope_y;
    double rms_px;        // scatter of the measured residuals about the model, robust
    double median_px;     // median |residual| before the model: the calibration's health number
    double p95_px;
    int samples;          // measured matches; 0: not measured, all other fields are 0
};

/// A point in the left camera's frame, micrometres (+-2147 m).
struct triangulate_point {
    int32_t x_um, y_um, z_um;
    uint32_t miss_um;     // distance between the rays at their closest
    uint32_t sigma_um;    // predicted standard deviation along the left ray
};

struct triangulate_plan {
    int32_t R_left_rect_q30[9];
    int64_t f_q16, fy_q16;
    int64_t cx_left_q16, cx_right_q16, cy_q16;
    int64_t baseline_um_q8;
    int64_t vertical_offset_q32, vertical_slope_x_q32, vertical_slope_y_q32;
    int64_t vertical_sigma_q16;
    int32_t half_width_px, half_height_px;
};

/// Fixed-point form of a plan. `vertical` may be NULL (not measured).
/// ERROR_RANGE when a value does not fit (baseline above 100 m, focal length above 1e6 px).
int triangulate_plan_make(const struct rectify_plan *plan,
                          const struct triangulate_vertical *vertical,
                          struct triangulate_plan *result);

/// Triangulates one match: left pixel (x, y), disparity_q8 = 256 (x_left - x_right), sigma_q8 its
/// predicted standard deviation in 1/256 px. Returns false (point untouched) when the rays
/// meet at infinity, behind the cameras, or beyond 2000 m.
bool triangulate_match(const struct triangulate_plan *plan, int x, int y, int32_t disparity_q8,
                       uint32_t sigma_q8, struct triangulate_point *point);

#ifdef __cplusplus
}
#endif

#endif
