// SPDX-License-Identifier: Apache-2.0
/// Points from disparities: mid-points of the two real camera rays, in the left camera's frame. The
/// rectified pixel (x, y) and the raw pixel that rectification sampled for it lie on the same ray
/// (a test measures the table's error), so rays are computed in the rect frame and rotated back. A
/// residual vertical disparity moves the right ray off the row, so that the rays do not intersect.
#ifndef VERGENCE_STEREO_GEOMETRY_TRIANGULATE_H
#define VERGENCE_STEREO_GEOMETRY_TRIANGULATE_H

#include <stdbool.h>
#include <stdint.h>

#include "stereo/geometry/rectify.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Residual vertical disparity of a rectified pair: at (x, y) the right match lies at
/// y + offset + slope_x (x - width/2) + slope_y (y - height/2).
struct triangulate_vertical {
    double offset_px, slope_x, slope_y;
    double rms_px;     // scatter of the measured residuals about the model, robust
    double median_px;  // median |residual| before the model: indicates the quality of the
                       // calibration
    double p95_px;
    // 95th percentiles of the systematic part at the same matches: |offset and slopes|, and the
    // additional curvature. A good calibration has less than 0.4 px of either.
    double trend_px, curve_px;
    int samples;  // number of measured matches; 0: not measured, all other fields are 0
};

/// A point in the left camera's frame, micrometres (+-2000 m).
struct triangulate_point {
    int32_t x_um, y_um, z_um;
    uint32_t miss_um;   // distance between the rays at their closest
    uint32_t sigma_um;  // predicted standard deviation along the left ray
};

/// Fixed-point form of a rectification plan and its residual. "Slopes" are x/z and y/z of the
/// rect frame; all of them are below TRIANGULATE_SLOPE_MAX.
struct triangulate_plan {
    int32_t R_left_rect_q30[9];
    int64_t pixel_slope_x_q43, pixel_slope_y_q43;  // slope per pixel: 1/f, 1/fy
    int64_t left_slope_x_q43, top_slope_y_q43;     // slope of pixel (0, 0)
    int64_t offset_q16;                            // cx_left - cx_right
    int64_t f_baseline_um_q16;                     // times 2^range_shift
    int range_shift;                               // 0..8
    int32_t baseline_um;
    // Residual vertical disparity at pixel (0, 0) and its slopes, in pixels of f.
    int64_t vertical_q32, vertical_slope_x_q32, vertical_slope_y_q32;
    int32_t vertical_sigma_q12;
    int64_t vertical_max_q16;  // no residual is larger
    bool has_vertical;
    uint32_t narrow_min_q16;  // least parallax for which numbers of 32 bits are enough
};

/// Limit of |x/z| and |y/z| (a half view of 82 degrees).
#define TRIANGULATE_SLOPE_MAX 8.0

/// Fixed-point form of a plan. `vertical` may be NULL (not measured). ERROR_RANGE if a value does
/// not fit (baseline above 100 m, focal length outside 1..1e6 px, slopes above
/// TRIANGULATE_SLOPE_MAX, vertical offset above 256 px, vertical slope or the largest vertical
/// disparity over the focal length above 1/4).
int triangulate_plan_make(const struct rectify_plan *plan,
                          const struct triangulate_vertical *vertical,
                          struct triangulate_plan *result);

/// Disparities of which no point has to be made to know that its left z is within a range: at all
/// pixels their rays meet there.
struct triangulate_certain {
    int32_t least_q8, most_q8;  // none if this is below that
};

static inline bool triangulate_is_certain(const struct triangulate_certain *certain,
                                          int32_t disparity_q8) {
    return disparity_q8 >= certain->least_q8 && disparity_q8 <= certain->most_q8;
}

/// These of the range near_um..far_um, not negative. `made` was made of the plan.
struct triangulate_certain triangulate_find_certain(const struct rectify_plan *plan,
                                                    const struct triangulate_plan *made,
                                                    int32_t near_um, int32_t far_um);

/// Triangulates one match: left pixel (x, y), disparity_q8 = 256 (x_left - x_right), sigma_q8 its
/// predicted standard deviation in 1/256 px. Returns false (point unchanged) if the rays meet at
/// infinity, behind the cameras, or beyond 2000 m in a coordinate, or if the residual vertical
/// disparity is larger than the parallax (such rays have no useful intersection).
bool triangulate_match(const struct triangulate_plan *plan, int x, int y, int32_t disparity_q8,
                       uint32_t sigma_q8, struct triangulate_point *point);

#ifdef __cplusplus
}
#endif

#endif
