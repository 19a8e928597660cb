// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/rectify_window.h"

#include <math.h>
#include <stdint.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/geometry/geometry.h"

enum {
    SIDE_SAMPLES = RECTIFY_OUTLINE_POINTS / 4,  // samples on each of the four sides of an image
    ROW_LEVELS = 256,
};

// The rectified pair of a lens that is not Brown-Conrady ends at this slope left, right, above and
// below: 55 degrees off the axis. A pinhole stretches the rim by the square of 1 / cosine, and the
// plane of 160 degrees would be eleven focal lengths wide.
static const double WIDE_SLOPE_MAX = 1.4281480067421144;

// Rays flatter than this on the rectified plane are useless: 83 degrees off its axis.
static const double FACING_MIN = 0.125;

// Pixel number i of the outline of an image, clockwise from the top left.
static void outline_pixel(const struct lens *lens, int i, double pixel_px[2]) {
    const double right = lens->width_px - 1, bottom = lens->height_px - 1;
    const double share = (double)(i % SIDE_SAMPLES) / SIDE_SAMPLES;
    INVARIANT(i >= 0 && i < RECTIFY_OUTLINE_POINTS);
    switch (i / SIDE_SAMPLES) {
        case 0:
            pixel_px[0] = share * right, pixel_px[1] = 0;
            break;
        case 1:
            pixel_px[0] = right, pixel_px[1] = share * bottom;
            break;
        case 2:
            pixel_px[0] = (1.0 - share) * right, pixel_px[1] = bottom;
            break;
        default:
            pixel_px[0] = 0, pixel_px[1] = (1.0 - share) * bottom;
            break;
    }
}

// Direction of the border's pixel, or, if the lens does not see that far, of the rim of its view on
// the line from the principal point to it; 90 degrees off the axis for an equidistant lens without
// such a rim. Returns false if neither exists: the pixel is 89.9 degrees or more off the axis of a
// lens whose view has no rim.
static bool outline_ray(const struct lens *lens, double view_radius, int i, double ray[3]) {
    double pixel_px[2];
    outline_pixel(lens, i, pixel_px);
    if (lens_ray(lens, pixel_px, ray) && lens_sees(view_radius, ray)) {
        return true;
    }
    const bool rim = view_radius < INFINITY;
    if (!rim && lens->kind != LENS_EQUIDISTANT) {
        return false;
    }
    const double x = (pixel_px[0] - lens->cx_px) / lens->fx_px;
    const double y = (pixel_px[1] - lens->cy_px) / lens->fy_px;
    const double length = sqrt(x * x + y * y);
    INVARIANT(length > 0);
    ray[0] = x * (rim ? view_radius : 1.0) / length;
    ray[1] = y * (rim ? view_radius : 1.0) / length;
    ray[2] = rim ? 1.0 : 0.0;
    return true;
}

// Moves a ray of the outline towards the axis of the rectified plane, onto the edge of the field
// that a rectified pair can show. The axis is inside the view, so that what is left is the part of
// the view inside that field.
static void limit_field(const double R_rect_camera[9], double ray_camera[3], double ray_rect[3]) {
    const double x = ray_rect[0] < 0 ? -ray_rect[0] : ray_rect[0];
    const double y = ray_rect[1] < 0 ? -ray_rect[1] : ray_rect[1];
    const double largest = math_max(x, y);
    INVARIANT(largest >= 0);
    if (!(largest > 0) || (ray_rect[2] > 0 && largest <= WIDE_SLOPE_MAX * ray_rect[2])) {
        return;
    }
    ray_rect[0] *= WIDE_SLOPE_MAX / largest;
    ray_rect[1] *= WIDE_SLOPE_MAX / largest;
    ray_rect[2] = 1.0;
    geometry_rotate_back(R_rect_camera, ray_rect, ray_camera);
}

int rectify_window_trace(const struct lens *lens, const double R_rect_camera[9],
                         struct rectify_outline *outline) {
    const double view_radius = lens_view_radius(lens);
    outline->depth_ratio.min = INFINITY;
    outline->depth_ratio.max = 0;
    for (int i = 0; i < RECTIFY_OUTLINE_POINTS; i++) {
        double ray_camera[3], ray_rect[3];
        if (!outline_ray(lens, view_radius, i, ray_camera)) {
            return ERROR_OVERLAP;
        }
        geometry_rotate(R_rect_camera, ray_camera, ray_rect);
        if (lens->kind != LENS_BROWN_CONRADY) {
            limit_field(R_rect_camera, ray_camera, ray_rect);
        }
        const double length = geometry_norm(ray_camera);
        if (!(ray_rect[2] > FACING_MIN * length) || !(ray_camera[2] > 1e-3 * length)) {
            return ERROR_OVERLAP;
        }
        outline->slope[i][0] = ray_rect[0] / ray_rect[2];
        outline->slope[i][1] = ray_rect[1] / ray_rect[2];
        const double ratio = ray_rect[2] / ray_camera[2];
        outline->depth_ratio.min = math_min(outline->depth_ratio.min, ratio);
        outline->depth_ratio.max = math_max(outline->depth_ratio.max, ratio);
    }
    INVARIANT(outline->depth_ratio.min > 0);
    return ERROR_OK;
}

// The heights at which outlines are cut, `top` to `bottom`.
struct levels {
    double top, bottom;
};

static double level_height(const struct levels *levels, int level) {
    return levels->top + (levels->bottom - levels->top) * level / ROW_LEVELS;
}

static int16_t find_level(double at) {
    if (at < 0) {
        return -1;
    }
    return (int16_t)(at > ROW_LEVELS ? ROW_LEVELS + 1 : (int)at);
}

// The level of each point of an outline, give or take one; those above and below all levels are
// neighbours of the first and of the last.
static void find_levels(const struct rectify_outline *outline, const struct levels *levels,
                        int16_t level[RECTIFY_OUTLINE_POINTS]) {
    const double per_slope = ROW_LEVELS / (levels->bottom - levels->top);
    for (int i = 0; i < RECTIFY_OUTLINE_POINTS; i++) {
        level[i] = find_level((outline->slope[i][1] - levels->top) * per_slope);
    }
}

// Interval of an outline at one level; empty (low > high) if it does not reach it. Integers rule
// out the edges that are not near the level, as doubles are slow on some processors.
static void cut_outline(const struct rectify_outline *outline,
                        const int16_t point_level[RECTIFY_OUTLINE_POINTS],
                        const struct levels *levels, int level, double *low, double *high) {
    const double y = level_height(levels, level);
    *low = INFINITY;
    *high = -INFINITY;
    for (int i = 0; i < RECTIFY_OUTLINE_POINTS; i++) {
        const int next = i + 1 < RECTIFY_OUTLINE_POINTS ? i + 1 : 0;
        const int above = level - 1, below = level + 1;
        if ((point_level[i] < above && point_level[next] < above) ||
            (point_level[i] > below && point_level[next] > below)) {
            continue;
        }
        const double *a = outline->slope[i], *b = outline->slope[next];
        if (y < math_min(a[1], b[1]) || y > math_max(a[1], b[1])) {
            continue;
        }
        const double share = a[1] == b[1] ? 0 : (y - a[1]) / (b[1] - a[1]);
        const double x = a[0] + share * (b[0] - a[0]);
        *low = math_min(*low, x);
        *high = math_max(*high, x);
    }
}

// The heights that both outlines have; false if there are none.
static bool find_shared_heights(const struct rectify_outline *left,
                                const struct rectify_outline *right, struct levels *levels) {
    const struct rectify_outline *both[2] = {left, right};
    *levels = (struct levels){-INFINITY, INFINITY};
    for (int side = 0; side < 2; side++) {
        double low = INFINITY, high = -INFINITY;
        for (int i = 0; i < RECTIFY_OUTLINE_POINTS; i++) {
            low = math_min(low, both[side]->slope[i][1]);
            high = math_max(high, both[side]->slope[i][1]);
        }
        levels->top = math_max(levels->top, low);
        levels->bottom = math_min(levels->bottom, high);
    }
    return levels->top < levels->bottom;
}

bool rectify_window_find(const struct rectify_outline *left, const struct rectify_outline *right,
                         double parallax_far, double parallax_near, struct rectify_window *window) {
    INVARIANT(parallax_far >= 0 && parallax_far < parallax_near);
    struct levels levels;
    int16_t left_level[RECTIFY_OUTLINE_POINTS], right_level[RECTIFY_OUTLINE_POINTS];
    *window =
        (struct rectify_window){INFINITY, -INFINITY, INFINITY, -INFINITY, INFINITY, -INFINITY};
    if (!find_shared_heights(left, right, &levels)) {
        return false;
    }
    find_levels(left, &levels, left_level);
    find_levels(right, &levels, right_level);
    for (int level = 0; level <= ROW_LEVELS; level++) {
        const double y = level_height(&levels, level);
        double left_low, left_high, right_low, right_high;
        cut_outline(left, left_level, &levels, level, &left_low, &left_high);
        cut_outline(right, right_level, &levels, level, &right_low, &right_high);
        const double low = math_max(left_low, right_low + parallax_far);
        const double high = math_min(left_high, right_high + parallax_near);
        if (!(low < high)) {
            continue;
        }
        window->left_low = math_min(window->left_low, low);
        window->left_high = math_max(window->left_high, high);
        window->right_low = math_min(window->right_low, math_max(right_low, low - parallax_near));
        window->right_high =
            math_max(window->right_high, math_min(right_high, high - parallax_far));
        window->top = math_min(window->top, y);
        window->bottom = math_max(window->bottom, y);
    }
    return window->left_low < window->left_high && window->top < window->bottom;
}
