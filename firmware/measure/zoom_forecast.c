// SPDX-License-Identifier: Apache-2.0
#include "measure/zoom_forecast.h"

#include <math.h>

#include "core/error.h"
#include "core/math.h"
#include "measure/measure_tuning.h"
#include "stereo/zoom/zoom_sigma.h"

// The lens with the longer focal length, mm.
static double focal_mm_of(const struct zoom_calibration *calibration,
                          const struct zoom_state *state) {
    double focal_mm = 0;
    for (int side = 0; side < 2; side++) {
        const struct zoom_camera *camera = &calibration->camera[side];
        focal_mm = math_max(
            focal_mm, camera->pixel_mm *
                          zoom_function_value(camera, ZOOM_FOCAL, state->side[side].zoom_counts));
    }
    return focal_mm;
}

static double factor_of(const struct zoom_calibration *calibration,
                        const struct zoom_state *state) {
    const struct zoom_camera *left = &calibration->camera[0];
    const double least = math_min(zoom_function_value(left, ZOOM_FOCAL, left->zoom.min),
                                  zoom_function_value(left, ZOOM_FOCAL, left->zoom.max));
    return zoom_function_value(left, ZOOM_FOCAL, state->side[0].zoom_counts) / least;
}

static enum zoom_forecast_limit find_limit(const struct zoom_forecast *forecast, double blur_mm) {
    if (forecast->has_iris && forecast->iris.blur_mm > MEASURE_BLURRED_PX * blur_mm) {
        return ZOOM_FORECAST_DEPTH;
    }
    if (forecast->common_mm > MEASURE_COMMON_FACTOR * forecast->point_mm) {
        return ZOOM_FORECAST_COMMON;
    }
    return ZOOM_FORECAST_PIXELS;
}

int zoom_forecast_at(const struct zoom_calibration *calibration, const struct zoom_frames *frames,
                     const struct zoom_state *state, const double point_mm[3], double near_mm,
                     double far_mm, const struct depth_iris_limits *limits,
                     struct zoom_forecast *forecast) {
    struct zoom_forecast found = {.has_iris = limits != NULL};
    const int error = zoom_field_at(calibration, frames, state, point_mm, &found.field);
    if (error != ERROR_OK) {
        return error;
    }
    const double depth_mm = found.field.distance_mm[0];
    const bool has_depths = near_mm > 0 && far_mm >= near_mm;
    const double from_mm = has_depths ? near_mm : depth_mm, to_mm = has_depths ? far_mm : depth_mm;
    const struct lens_state lens = {.focal_length_mm = focal_mm_of(calibration, state),
                                    .f_number = 1,
                                    .focus_distance_mm = lens_range_middle(from_mm, to_mm)};
    if (!(lens.focal_length_mm > 0 && from_mm > 2 * lens.focal_length_mm)) {
        return ERROR_RANGE;
    }
    const double blur_mm = MEASURE_SHARP_PX * calibration->camera[0].pixel_mm;
    if (limits != NULL) {
        found.iris = depth_iris_for(&lens, from_mm, to_mm, blur_mm, limits);
    }
    const struct zoom_variance variance =
        zoom_depth_variance(calibration, state, found.field.pixel_px[0], depth_mm);
    found.factor = factor_of(calibration, state);
    found.point_mm = MEASURE_DISPARITY_PX * found.field.depth_per_px_mm;
    found.common_mm = sqrt(math_max(0, zoom_variance_sum(&variance)));
    found.limit = find_limit(&found, blur_mm);
    *forecast = found;
    return ERROR_OK;
}
