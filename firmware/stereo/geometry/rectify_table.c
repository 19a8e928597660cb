// SPDX-License-Identifier: Apache-2.0
#include <math.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/geometry/geometry.h"
#include "stereo/geometry/rectify.h"

enum { EXTENT_STEP_PX = 64 };  // between the pixels of a row whose sources are computed

// Nodes farther outside are clamped to this, so that differences of two nodes fit 32 bits.
static const double COORDINATE_LIMIT_PX = 15000;

// The interpolation error between nodes grows with the fourth power of their angular distance: with
// 16 px at a focal length of 400 px it is about 0.003 px for common lenses.
static int choose_step_log2(const struct rectify_plan *plan) {
    if (plan->f_px >= 400) {
        return 4;
    }
    return plan->f_px >= 200 ? 3 : 2;
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
    return 2 * arena_need_bytes(nodes, sizeof(int32_t)) +
           arena_need_bytes((size_t)plan->height_px, sizeof(struct rectify_span));
}

// The raw camera behind one rectified image.
struct source {
    const struct lens *lens;
    const double *R_rect_camera;
    double cx_px, cy_px, f_px, fy_px;  // intrinsics of the rectified image
    double view_radius;                // radius of the lens' view; INFINITY: no bound
};

static int32_t node_q16(double pixel_px) {
    const double low = pixel_px < COORDINATE_LIMIT_PX ? pixel_px : COORDINATE_LIMIT_PX;
    const double limited = low > -COORDINATE_LIMIT_PX ? low : -COORDINATE_LIMIT_PX;
    const double scaled = limited * 65536.0;
    return (int32_t)(scaled < 0 ? scaled - 0.5 : scaled + 0.5);
}

// Ideal coordinates of a rectified pixel; false if it is behind the camera's view.
static bool find_ideal(const struct source *source, int x, int y, double ideal[2]) {
    const double ray_rect[3] = {(x - source->cx_px) / source->f_px,
                                (y - source->cy_px) / source->fy_px, 1.0};
    double ray[3];
    geometry_rotate_back(source->R_rect_camera, ray_rect, ray);
    if (!(ray[2] > 1e-3)) {
        return false;
    }
    ideal[0] = ray[0] / ray[2];
    ideal[1] = ray[1] / ray[2];
    return true;
}

// Nodes beyond the lens' view follow the same polynomial, even where it folds: cells across the rim
// are then as exact as any other. `view` describes the rim.
static int compute_node(const struct source *source, int x, int y, int32_t *x_q16, int32_t *y_q16) {
    double ideal[2], distorted[2];
    if (!find_ideal(source, x, y, ideal)) {
        return ERROR_DISTORTION;
    }
    lens_distort(source->lens, ideal, distorted);
    *x_q16 = node_q16(source->lens->fx_px * distorted[0] + source->lens->cx_px);
    *y_q16 = node_q16(source->lens->fy_px * distorted[1] + source->lens->cy_px);
    return ERROR_OK;
}

static bool find_in_view(const struct source *source, int x, int y, double ideal[2]) {
    return find_ideal(source, x, y, ideal) &&
           sqrt(ideal[0] * ideal[0] + ideal[1] * ideal[1]) <= source->view_radius;
}

static bool is_in_view(const struct source *source, int x, int y) {
    double ideal[2];
    return find_in_view(source, x, y, ideal);
}

// The view is a circular cone, so each row crosses it in one run.
static struct rectify_span cut_view(const struct source *source, int width_px, int y) {
    int begin = 0, end = width_px;
    while (begin < end && !is_in_view(source, begin, y)) {
        begin++;
    }
    while (end > begin && !is_in_view(source, end - 1, y)) {
        end--;
    }
    INVARIANT(begin <= end && end <= INT16_MAX);
    return begin < end ? (struct rectify_span){(int16_t)begin, (int16_t)end}
                       : (struct rectify_span){0, 0};
}

static void cut_rows(const struct source *source, const struct rectify_plan *plan,
                     struct rectify_span *view) {
    for (int y = 0; y < plan->height_px; y++) {
        view[y] = cut_view(source, plan->width_px, y);
    }
}

static int round_int(double x) {
    return (int)(x < 0 ? x - 0.5 : x + 0.5);
}

// Takes the images unchanged, from whole pixels.
static void set_identity(const struct rectify_plan *plan, const struct lens *lens, double cx_px,
                         struct rectify_table *table) {
    table->offset_x_px = round_int(lens->cx_px - cx_px);
    table->offset_y_px = round_int(lens->cy_px - plan->cy_px);
    INVARIANT(table->offset_x_px >= 0 && table->offset_x_px <= lens->width_px - plan->width_px);
    INVARIANT(table->offset_y_px >= 0 && table->offset_y_px <= lens->height_px - plan->height_px);
}

static int compute_nodes(const struct source *source, struct rectify_table *table) {
    const int step_px = 1 << table->step_log2;
    for (int j = 0; j < table->rows; j++) {
        for (int i = 0; i < table->columns; i++) {
            const size_t node = (size_t)j * (size_t)table->columns + (size_t)i;
            const int error = compute_node(source, (i - 1) * step_px, (j - 1) * step_px,
                                           &table->x_q16[node], &table->y_q16[node]);
            if (error != ERROR_OK) {
                return error;
            }
        }
    }
    return ERROR_OK;
}

// Takes the memory of a table's nodes and of the spans of its rows.
static int take_memory(struct arena *arena, struct rectify_table *table,
                       struct rectify_span **view) {
    const size_t nodes = (size_t)table->columns * (size_t)table->rows;
    table->x_q16 = arena_take(arena, nodes, sizeof(int32_t));
    table->y_q16 = arena_take(arena, nodes, sizeof(int32_t));
    *view = arena_take(arena, (size_t)table->height_px, sizeof(struct rectify_span));
    return table->x_q16 != NULL && table->y_q16 != NULL && *view != NULL ? ERROR_OK : ERROR_MEMORY;
}

static struct source source_of(const struct rectify_plan *plan,
                               const struct calibration *calibration, enum rectify_side side) {
    const bool is_left = side == RECTIFY_LEFT;
    const struct lens *lens = is_left ? &calibration->left : &calibration->right;
    return (struct source){
        .lens = lens,
        .R_rect_camera = is_left ? plan->R_rect_left : plan->R_rect_right,
        .cx_px = is_left ? plan->cx_left_px : plan->cx_right_px,
        .cy_px = plan->cy_px,
        .f_px = plan->f_px,
        .fy_px = plan->fy_px,
        .view_radius = lens_view_radius(lens),
    };
}

struct extent {
    double lowest, highest;
};

// The raw rows of row y; none: lowest > highest.
static struct extent row_extent(const struct source *source, int width_px, int y) {
    struct extent extent = {INFINITY, -INFINITY};
    for (int x = 0; x < width_px + EXTENT_STEP_PX; x += EXTENT_STEP_PX) {
        double ideal[2], distorted[2];
        if (!find_in_view(source, x < width_px ? x : width_px - 1, y, ideal)) {
            continue;
        }
        lens_distort(source->lens, ideal, distorted);
        const double row = source->lens->fy_px * distorted[1] + source->lens->cy_px;
        const double last = source->lens->height_px - 1;
        const double inside = math_clamp(row, 0, last);
        extent.lowest = inside < extent.lowest ? inside : extent.lowest;
        extent.highest = inside > extent.highest ? inside : extent.highest;
    }
    return extent;
}

int rectify_rows_needed(const struct rectify_plan *plan, const struct calibration *calibration,
                        enum rectify_side side, int rows) {
    if (plan->identity) {
        return rows;
    }
    const struct source source = source_of(plan, calibration, side);
    struct extent first = row_extent(&source, plan->width_px, 0);
    int most = 0;
    for (int y = 0; y < plan->height_px; y += rows) {
        const int end = y + rows < plan->height_px ? y + rows : plan->height_px - 1;
        const struct extent last = row_extent(&source, plan->width_px, end);
        const double lowest = first.lowest < last.lowest ? first.lowest : last.lowest;
        const double highest = first.highest > last.highest ? first.highest : last.highest;
        const int needed = lowest <= highest ? (int)(highest - lowest) + 3 : 0;
        most = needed > most ? needed : most;
        first = last;
    }
    return most;
}

int rectify_table_make(const struct rectify_plan *plan, const struct calibration *calibration,
                       enum rectify_side side, struct arena *arena, struct rectify_table *table) {
    INVARIANT(plan->width_px >= 1 && plan->width_px <= IMAGE_MAX_SIDE_PX);
    INVARIANT(plan->height_px >= 1 && plan->height_px <= IMAGE_MAX_SIDE_PX);
    const struct source source = source_of(plan, calibration, side);
    const struct lens *lens = source.lens;
    INVARIANT(lens->width_px <= IMAGE_MAX_SIDE_PX && lens->height_px <= IMAGE_MAX_SIDE_PX);
    struct rectify_table made = {
        .step_log2 = choose_step_log2(plan),
        .width_px = plan->width_px,
        .height_px = plan->height_px,
        .raw_width_px = lens->width_px,
        .raw_height_px = lens->height_px,
        .identity = plan->identity,
    };
    if (plan->identity) {
        set_identity(plan, lens, source.cx_px, &made);
        *table = made;
        return ERROR_OK;
    }
    made.columns = node_count(plan->width_px, made.step_log2);
    made.rows = node_count(plan->height_px, made.step_log2);
    const size_t mark = arena_mark(arena);
    struct rectify_span *view = NULL;
    int error = take_memory(arena, &made, &view);
    if (error != ERROR_OK) {
        arena_release(arena, mark);
        return error;
    }
    error = compute_nodes(&source, &made);
    if (error != ERROR_OK) {
        arena_release(arena, mark);
        return error;
    }
    if (source.view_radius < INFINITY) {
        cut_rows(&source, plan, view);
        made.view = view;
    }
    *table = made;
    return ERROR_OK;
}
