// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/adjust_expect.h"

#include <math.h>
#include <string.h>

#include "core/invariant.h"

static const double search_sigmas = 4;

// Of the two pixels of a colour pair, every second is taken one step early.
static double early_px(const struct calibration_window *window) {
    return 0.5 * (window->skip - 1);
}

void adjust_to_sensor(const struct calibration_window *window, double px[2]) {
    px[0] = window->column_px + window->skip * px[0] - early_px(window);
    px[1] = window->row_px + window->skip * px[1] - early_px(window);
}

void adjust_from_sensor(const struct calibration_window *window, double px[2]) {
    px[0] = (px[0] + early_px(window) - window->column_px) / window->skip;
    px[1] = (px[1] + early_px(window) - window->row_px) / window->skip;
}

// Where the right camera sees the point of a left ray at depth 1 / w, with its derivatives.
static bool project_right(const struct camera_view view[2], const double direction[3], double w,
                          double px[2], double derivative[2][ADJUST_TERMS]) {
    const struct camera_view *left = &view[0], *right = &view[1];
    struct far_point point = {
        .x = direction[0] / direction[2], .y = direction[1] / direction[2], .w = w};
    memcpy(point.origin_mm, left->position_mm, sizeof point.origin_mm);
    if (derivative == NULL) {
        return camera_view_project(right, &point, px, NULL, NULL);
    }
    double of_left[2][VIEW_TERMS], left_point[2][3], of_right[2][VIEW_TERMS], right_point[2][3];
    double left_px[2];
    if (!camera_view_project(left, &point, left_px, of_left, left_point) ||
        !camera_view_project(right, &point, px, of_right, right_point)) {
        return false;
    }
    // The left pixel stays: x and y of the point follow the left corrections.
    const double d = left_point[0][0] * left_point[1][1] - left_point[0][1] * left_point[1][0];
    for (int c = 0; c < VIEW_TERMS; c++) {
        const double x = -(left_point[1][1] * of_left[0][c] - left_point[0][1] * of_left[1][c]) / d;
        const double y = -(left_point[0][0] * of_left[1][c] - left_point[1][0] * of_left[0][c]) / d;
        for (int i = 0; i < 2; i++) {
            derivative[i][c] = right_point[i][0] * x + right_point[i][1] * y;
            derivative[i][VIEW_TERMS + c] = of_right[i][c];
        }
    }
    return true;
}

// Whether the right camera, if its lens were ideal, sees the point in or near its picture: farther
// out the distortion's polynomial means nothing.
static bool is_near_view(const struct camera_view pair[2], const double direction[3], double w) {
    static const double margin = 0.3;
    struct camera_view right = pair[1];
    right.lens.k1 = right.lens.k2 = right.lens.k3 = right.lens.p1 = right.lens.p2 = 0;
    struct far_point point = {
        .x = direction[0] / direction[2], .y = direction[1] / direction[2], .w = w};
    memcpy(point.origin_mm, pair[0].position_mm, sizeof point.origin_mm);
    double px[2];
    return camera_view_project(&right, &point, px, NULL, NULL) &&
           px[0] > -margin * right.lens.width_px && px[0] < (1 + margin) * right.lens.width_px &&
           px[1] > -margin * right.lens.height_px && px[1] < (1 + margin) * right.lens.height_px;
}

// The part of the reciprocal depths from `range[0]` to `range[1]` that the right camera may see.
static bool clip_depths(const struct camera_view pair[2], const double direction[3],
                        double range[2]) {
    enum { SCAN = 64, HALVINGS = 6 };
    int first = -1, last = -1;
    const double step = (range[1] - range[0]) / SCAN;
    for (int i = 0; i <= SCAN; i++) {
        if (is_near_view(pair, direction, range[0] + i * step)) {
            first = first < 0 ? i : first;
            last = i;
        }
    }
    if (first < 0) {
        return false;
    }
    const double origin = range[0];
    const double inside[2] = {origin + first * step, origin + last * step};
    for (int end = 0; end < 2; end++) {
        double in = inside[end],
               out = end == 0 ? in - (first > 0 ? step : 0) : in + (last < SCAN ? step : 0);
        for (int i = 0; i < HALVINGS; i++) {
            const double middle = 0.5 * (in + out);
            if (is_near_view(pair, direction, middle)) {
                in = middle;
            } else {
                out = middle;
            }
        }
        range[end] = in;
    }
    return true;
}

void adjust_expect_serve(void *context) {
    const struct adjust_expectation *e = context;
    watch_serve(&e->adjustment->watch);
}

bool adjust_expect(void *context, const double left_px[2], struct sparse_region *region) {
    const struct adjust_expectation *e = context;
    const struct adjust_picture *picture = e->picture;
    const int first = adjust_view(picture->state, 0);
    INVARIANT(first + 1 < e->adjustment->views);
    const struct camera_view *view = &e->adjustment->view[first];
    double px[2] = {left_px[0], left_px[1]}, direction[3], middle[2], J[2][ADJUST_TERMS];
    adjust_to_sensor(&picture->window[0], px);
    double range[2] = {1 / picture->depth_far_mm, 1 / picture->depth_near_mm};
    if (!camera_view_ray(&view[0], px, direction) || !(direction[2] > 0) ||
        !clip_depths(view, direction, range) ||
        !project_right(view, direction, 0.5 * (range[0] + range[1]), middle, J) ||
        !project_right(view, direction, range[1], region->from, NULL) ||
        !project_right(view, direction, range[0], region->to, NULL)) {
        return false;
    }
    const double dx = region->to[0] - region->from[0], dy = region->to[1] - region->from[1];
    const double length = sqrt(dx * dx + dy * dy);
    const double along[2] = {length > 0 ? dx / length : 1, length > 0 ? dy / length : 0};
    double across_gradient[ADJUST_TERMS_MAX] = {0}, along_gradient[ADJUST_TERMS_MAX] = {0};
    for (int c = 0; c < ADJUST_TERMS; c++) {
        along_gradient[first * VIEW_TERMS + c] = along[0] * J[0][c] + along[1] * J[1][c];
        across_gradient[first * VIEW_TERMS + c] = along[0] * J[1][c] - along[1] * J[0][c];
    }
    // Distortion bends the line.
    const double bend =
        along[0] * (middle[1] - region->from[1]) - along[1] * (middle[0] - region->from[0]);
    const int skip = picture->window[1].skip;
    region->across =
        e->across_px + ((bend < 0 ? -bend : bend) +
                        search_sigmas * adjust_posterior_sigma(e->adjustment, across_gradient)) /
                           skip;
    region->beyond =
        e->across_px + search_sigmas * adjust_posterior_sigma(e->adjustment, along_gradient) / skip;
    adjust_from_sensor(&picture->window[1], region->from);
    adjust_from_sensor(&picture->window[1], region->to);
    return true;
}
