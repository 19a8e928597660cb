// SPDX-License-Identifier: Apache-2.0
#include <math.h>

#include "core/error.h"
#include "core/geometry.h"
#include "core/invariant.h"
#include "core/rectify.h"

// Nodes farther outside are moved here: differences of any two nodes then fit 32 bits.
static const double COORDINATE_LIMIT_PX = 15000;

// The error of the cubic between nodes grows with the fourth power of their distance as an angle:
// with 16 px at a focal length of 400 px it is some 0.003 px for common lenses.
static int choose_step_log2(const struct rectify_plan *plan) {
    return plan->f_px >= 400 ? 4 : plan->f_px >= 200 ? 3 : 2;
}

// One node before the image, and two behind the last cell's start.
static int node_count(int pixels, int step_log2) {
    return ((pixels - 1) >> step_log2) + 4;
}

size_t rectify_table_need_bytes(const struct rectify_plan *plan) {
    if (plan->identity) {
        return 0;
    }
    const int step_log2 = choose_step_log2(plan);
    const size_t nodes = (size_t)node_count(plan->width_px, step_log2) *
                         (size_t)node_count(plan->height_px, step_log2);
    return 2 * arena_need_bytes(nodes, sizeof(int32_t));
}

// The raw camera behind one rectified image.
struct source {
    const struct lens *lens;
    const double *R_rect_camera;
    double cx_px, cy_px, f_px, fy_px;  // of the rectified image
    double safe_radius;                // up to here the distortion is taken as it is
};

// Distorted coordinates, continued outward in a straight line behind `safe_radius`: the model folds
// back there and would show the image's border a second time.
static void distort_outward(const struct source *source, const double ideal[2],
                            double distorted[2]) {
    const double radius = sqrt(ideal[0] * ideal[0] + ideal[1] * ideal[1]);
    if (!(radius > source->safe_radius)) {
        lens_distort(source->lens, ideal, distorted);
        return;
    }
    const double share = source->safe_radius / radius;
    const double edge[2] = {ideal[0] * share, ideal[1] * share};
    lens_distort(source->lens, edge, distorted);
    for (int i = 0; i < 2; i++) {
        distorted[i] += ideal[i] - edge[i];
    }
}

static int32_t node_q16(double pixel_px) {
    const double low = pixel_px < COORDINATE_LIMIT_PX ? pixel_px : COORDINATE_LIMIT_PX;
    const double limited = low > -COORDINATE_LIMIT_PX ? low : -COORDINATE_LIMIT_PX;
    const double scaled = limited * 65536.0;
    return (int32_t)(scaled < 0 ? scaled - 0.5 : scaled + 0.5);
}

static int compute_node(const struct source *source, int x, int y, int32_t *x_q16, int32_t *y_q16) {
    const double ray_rect[3] = {(x - source->cx_px) / source->f_px,
                                (y - source->cy_px) / source->fy_px, 1.0};
    double ray[3], distorted[2];
    geometry_rotate_back(source->R_rect_camera, ray_rect, ray);
    if (!(ray[2] > 1e-3)) {
        return ERROR_DISTORTION;
    }
    const double ideal[2] = {ray[0] / ray[2], ray[1] / ray[2]};
    distort_outward(source, ideal, distorted);
    *x_q16 = node_q16(source->lens->fx_px * distorted[0] + source->lens->cx_px);
    *y_q16 = node_q16(source->lens->fy_px * distorted[1] + source->lens->cy_px);
    return ERROR_OK;
}

static int round_int(double x) {
    return (int)(x < 0 ? x - 0.5 : x + 0.5);
}

int rectify_table_make(const struct rectify_plan *plan, const struct calibration *calibration,
                       enum rectify_side side, struct arena *arena, struct rectify_table *table) {
    INVARIANT(plan->width_px >= 1 && plan->width_px <= IMAGE_MAX_SIDE_PX);
    INVARIANT(plan->height_px >= 1 && plan->height_px <= IMAGE_MAX_SIDE_PX);
    const bool is_left = side == RECTIFY_LEFT;
    const struct lens *lens = is_left ? &calibration->left : &calibration->right;
    const double cx_px = is_left ? plan->cx_left_px : plan->cx_right_px;
    struct rectify_table made = {
        .step_log2 = choose_step_log2(plan),
        .width_px = plan->width_px,
        .height_px = plan->height_px,
        .raw_width_px = lens->width_px,
        .raw_height_px = lens->height_px,
        .identity = plan->identity,
    };
    if (plan->identity) {
        made.offset_x_px = round_int(lens->cx_px - cx_px);
        made.offset_y_px = round_int(lens->cy_px - plan->cy_px);
        INVARIANT(made.offset_x_px >= 0 && made.offset_x_px <= lens->width_px - plan->width_px);
        INVARIANT(made.offset_y_px >= 0 && made.offset_y_px <= lens->height_px - plan->height_px);
        *table = made;
        return ERROR_OK;
    }
    made.columns = node_count(plan->width_px, made.step_log2);
    made.rows = node_count(plan->height_px, made.step_log2);
    const size_t nodes = (size_t)made.columns * (size_t)made.rows;
    const size_t mark = arena_mark(arena);
    made.x_q16 = arena_take(arena, nodes, sizeof(int32_t));
    made.y_q16 = arena_take(arena, nodes, sizeof(int32_t));
    if (made.x_q16 == NULL || made.y_q16 == NULL) {
        arena_release(arena, mark);
        return ERROR_MEMORY;
    }
    const struct source source = {
        .lens = lens,
        .R_rect_camera = is_left ? plan->R_rect_left : plan->R_rect_right,
        .cx_px = cx_px,
        .cy_px = plan->cy_px,
        .f_px = plan->f_px,
        .fy_px = plan->fy_px,
        .safe_radius = 0.98 * lens_fold_radius(lens),
    };
    const int step_px = 1 << made.step_log2;
    for (int j = 0; j < made.rows; j++) {
        for (int i = 0; i < made.columns; i++) {
            const size_t node = (size_t)j * (size_t)made.columns + (size_t)i;
            const int error = compute_node(&source, (i - 1) * step_px, (j - 1) * step_px,
                                           &made.x_q16[node], &made.y_q16[node]);
            if (error != ERROR_OK) {
                arena_release(arena, mark);
                return error;
            }
        }
    }
    *table = made;
    return ERROR_OK;
}
