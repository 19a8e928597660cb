// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/result/result_figures.h"

#include <math.h>
#include <stdlib.h>

#include "core/invariant.h"
#include "stereo/surface.h"

struct bounds {
    const struct reconstruct_result *result;
    struct result_figures_box box;
};

static void extend(void *cookie, const struct surface_part *part) {
    struct bounds *self = cookie;
    struct result_figures_box *bounds = &self->box;
    for (uint32_t i = 0; i < part->vertex_count; i++) {
        if (surface_figures_is_filled(self->result, part->vertex_pixel[i])) {
            continue;
        }
        const struct triangulate_point *point = &part->points[i];
        const int32_t um[3] = {point->x_um, point->y_um, point->z_um};
        for (int axis = 0; axis < 3; axis++) {
            const double mm = um[axis] / 1000.0;
            bounds->min_mm[axis] = mm < bounds->min_mm[axis] ? mm : bounds->min_mm[axis];
            bounds->greatest_mm[axis] =
                mm > bounds->greatest_mm[axis] ? mm : bounds->greatest_mm[axis];
        }
    }
}

struct result_figures_box result_figures_bounds(const struct reconstruct_result *result) {
    INVARIANT(surface_figures_measured_count(result) > 0);
    struct bounds bounds = {
        .result = result,
        .box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}},
    };
    surface_walk(result, SURFACE_POINTS, extend, &bounds);
    return bounds.box;
}

double result_figures_density_percent(const struct reconstruct_result *result) {
    const double pixels = (double)result->plan.width_px * result->plan.height_px;
    return 100.0 * (result->reason_count[REASON_VALID] + result->reason_count[REASON_BEYOND]) /
           pixels;
}

bool result_figures_spread(const struct reconstruct_result *result,
                           struct surface_figures_spread *spread) {
    const size_t bytes = surface_figures_spread_need_bytes();
    void *memory = malloc(bytes);
    struct arena arena;
    arena_init(&arena, memory, memory != NULL ? bytes : 0);
    const bool found = surface_figures_find_spread(
        result, NULL, surface_figures_measured_count(result), &arena, spread);
    free(memory);
    return found;
}

const char *result_figures_rows_fault(const struct triangulate_vertical *vertical,
                                      const struct rectify_plan *plan, double scale) {
    // In pixels of the raw images, as enlarging them scales the misfit. 30 pairs with matching
    // calibrations stay below 0.24, 0.39 and 0.24 px; a focal length that is off by 0.3 % gives
    // trends of 0.48 px and more at VGA, lenses with k1 = -0.28 treated as undistorted curvatures
    // of 0.73 px and more. Weak distortion left out (k1 = -0.05) stays below: rows hardly show it.
    static const double median_max_px = 0.5, trend_max_px = 0.45, curve_max_px = 0.4;
    const double enlarged = scale > 1 ? scale : 1;
    const double trend_px = vertical->trend_px / enlarged, curve_px = vertical->curve_px / enlarged;
    if (vertical->samples == 0 || (vertical->median_px <= median_max_px * enlarged &&
                                   trend_px <= trend_max_px && curve_px <= curve_max_px)) {
        return NULL;
    }
    const double spread_px = 0.5 * fabs(vertical->slope_y) * plan->height_px;
    const double turn_px = 0.5 * fabs(vertical->slope_x) * plan->width_px;
    const double offset_px = fabs(vertical->offset_px);
    if (curve_px > curve_max_px && vertical->curve_px > vertical->trend_px) {
        return "they are curved relative to each other, as by a different lens distortion";
    }
    if (spread_px > offset_px && spread_px > turn_px) {
        return "they spread from top to bottom, as by a different focal length: check zoom and "
               "focus of both cameras";
    }
    return turn_px > offset_px ? "they are rotated relative to each other: check whether a camera "
                                 "has rolled about its axis"
                               : "they are offset vertically: check whether a camera has tilted";
}
