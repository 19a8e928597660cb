// SPDX-License-Identifier: Apache-2.0
// Mid-point of two rays in closed form. In the rect frame, with everything divided by the focal
// length, the left ray is a = (x, y, 1) from the origin and the right one is b = (x - D, y + e, 1)
// from (B, 0, 0): D is the parallax, e the residual vertical disparity. With
//     k = e / D,  q = y + k x,  N = 1 + k^2 + q^2
// the cross product is a x b = -D (k, 1, -q), and the closest points lie at depths
//     left:  s = B/D (1 + (q (e - k x) - k^2) / N)
//     right: t = B/D (1 - (q k x + k^2) / N)
// at a distance of B |k| / sqrt(N) from each other. Without e both are B/D.
//
// A standard deviation of D moves the point along the left ray by depth / D times the ray's length.
// A scatter of e moves it too, but only where (q x + 2 k) / N is not small, that is in the image's
// corners: the derivative of (s + t) / 2 by e is -(B/D) (q (x - D/2) + 2 k) / (N D), of which D/2
// is left out. Elsewhere e turns the rays past each other at the same depth.
#include "stereo/geometry/triangulate.h"

#include <math.h>

#include "core/double/reciprocal.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "core/root.h"

static const int64_t LIMIT_UM = 2000000000;

// Numbers of 32 bits are for parallaxes from 1 to 4096 px, and smaller standard deviations.
enum { NARROW_MIN_Q16 = 1 << 16, NARROW_MAX_Q16 = 1 << 28, NARROW_SIGMA_Q8 = 1 << 11 };

static bool is_within(double value, double limit) {
    return value >= -limit && value <= limit;
}

// value 2^bits, rounded; the caller has checked the range.
static int64_t fixed(double value, int bits) {
    const double scaled = value * (double)((int64_t)1 << bits);
    INVARIANT(is_within(scaled, 9.2e18));
    return (int64_t)(scaled < 0 ? scaled - 0.5 : scaled + 0.5);
}

static bool fits(const struct rectify_plan *plan) {
    const double slope_left = -plan->cx_left_px / plan->f_px;
    const double slope_right = (plan->width_px - plan->cx_left_px) / plan->f_px;
    const double slope_top = -plan->cy_px / plan->fy_px;
    const double slope_bottom = (plan->height_px - plan->cy_px) / plan->fy_px;
    return plan->f_px >= 1 && plan->f_px <= 1e6 && plan->fy_px >= 1 && plan->fy_px <= 1e6 &&
           plan->baseline_mm > 0 && plan->baseline_mm <= 1e5 &&
           is_within(slope_left, TRIANGULATE_SLOPE_MAX) &&
           is_within(slope_right, TRIANGULATE_SLOPE_MAX) &&
           is_within(slope_top, TRIANGULATE_SLOPE_MAX) &&
           is_within(slope_bottom, TRIANGULATE_SLOPE_MAX) &&
           is_within(plan->cx_left_px - plan->cx_right_px, 1e7);
}

static int add_vertical(const struct rectify_plan *plan,
                        const struct triangulate_vertical *vertical,
                        struct triangulate_plan *result) {
    if (!is_within(vertical->offset_px, 256) || !is_within(vertical->slope_x, 0.25) ||
        !is_within(vertical->slope_y, 0.25) ||
        !(vertical->rms_px >= 0 && vertical->rms_px <= 256)) {
        return ERROR_RANGE;
    }
    const double slope_x = vertical->slope_x < 0 ? -vertical->slope_x : vertical->slope_x;
    const double slope_y = vertical->slope_y < 0 ? -vertical->slope_y : vertical->slope_y;
    const double offset_px = vertical->offset_px < 0 ? -vertical->offset_px : vertical->offset_px;
    const double max_px = offset_px + 0.5 * (slope_x * plan->width_px + slope_y * plan->height_px);
    const double aspect = plan->f_px / plan->fy_px;
    if (aspect > 16 || max_px > 0.25 * plan->fy_px) {
        return ERROR_RANGE;
    }
    const double corner_px = vertical->offset_px - 0.5 * (vertical->slope_x * plan->width_px +
                                                          vertical->slope_y * plan->height_px);
    result->has_vertical = true;
    result->vertical_max_q16 = fixed(aspect * max_px, 16) + 1;
    result->vertical_q32 = fixed(aspect * corner_px, 32);
    result->vertical_slope_x_q32 = fixed(aspect * vertical->slope_x, 32);
    result->vertical_slope_y_q32 = fixed(aspect * vertical->slope_y, 32);
    result->vertical_sigma_q12 = (int32_t)fixed(aspect * vertical->rms_px, 12);
    return ERROR_OK;
}

static double largest_slope_x(const struct rectify_plan *plan) {
    return math_max(plan->cx_left_px, plan->width_px - plan->cx_left_px) / plan->f_px;
}

static double largest_slope_y(const struct rectify_plan *plan) {
    return math_max(plan->cy_px, plan->height_px - plan->cy_px) / plan->fy_px;
}

// The least parallax from which on numbers of 32 bits are enough for all pixels.
static uint32_t find_narrow(const struct rectify_plan *plan, const struct triangulate_plan *made) {
    const double slope_x = largest_slope_x(plan), slope_y = largest_slope_y(plan);
    if (slope_x > 1 || slope_y > 1 || made->baseline_um >= 1 << 21 ||
        made->vertical_sigma_q12 >= 1 << 14) {
        return NARROW_MAX_Q16;
    }
    // With |k| <= 1/4, a point is at 5/4 B/D at most. Then its distance is below 0.9 2^31, and it
    // is shifted by less than 0.02 2^31.
    const double z_max_q8 = 0.9 * 2147483648.0 / sqrt(1 + slope_x * slope_x + slope_y * slope_y);
    const double f_baseline_um_q24 = plan->f_px * plan->baseline_mm * 1e3 * (1 << 24);
    const double near_q16 = 1.25 * f_baseline_um_q24 / z_max_q8;
    const double least_q16 = 1 + math_max(near_q16, 4.0 * (double)made->vertical_max_q16);
    return (uint32_t)math_min(math_max(least_q16, NARROW_MIN_Q16), NARROW_MAX_Q16);
}

int triangulate_plan_make(const struct rectify_plan *plan,
                          const struct triangulate_vertical *vertical,
                          struct triangulate_plan *result) {
    if (!fits(plan)) {
        return ERROR_RANGE;
    }
    struct triangulate_plan made = {
        .pixel_slope_x_q43 = fixed(1.0 / plan->f_px, 43),
        .pixel_slope_y_q43 = fixed(1.0 / plan->fy_px, 43),
        .left_slope_x_q43 = fixed(-plan->cx_left_px / plan->f_px, 43),
        .top_slope_y_q43 = fixed(-plan->cy_px / plan->fy_px, 43),
        .offset_q16 = fixed(plan->cx_left_px - plan->cx_right_px, 16),
        .baseline_um = (int32_t)fixed(1e3 * plan->baseline_mm, 0),
    };
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++) {
            const double element = plan->R_rect_left[3 * column + row];
            INVARIANT(is_within(element, 1.000001));
            made.R_left_rect_q30[3 * row + column] = (int32_t)fixed(element, 30);
        }
    }
    const double f_baseline_um = plan->f_px * plan->baseline_mm * 1e3;
    made.range_shift = 8;
    while (made.range_shift > 0 &&
           f_baseline_um >= (double)((int64_t)1 << (46 - made.range_shift))) {
        made.range_shift--;
    }
    made.f_baseline_um_q16 = fixed(f_baseline_um, 16 + made.range_shift);
    if (vertical != NULL && vertical->samples > 0) {
        const int error = add_vertical(plan, vertical, &made);
        if (error != ERROR_OK) {
            return error;
        }
    }
    made.narrow_min_q16 = find_narrow(plan, &made);
    *result = made;
    return ERROR_OK;
}

// Where products of 64 bits are slow, points that fit are made of 32 bits.
#if UINTPTR_MAX <= UINT32_MAX
#define HAS_NARROW 1
#else
#define HAS_NARROW 0
#endif

// a b, as long as it fits.
static inline int64_t multiple(int64_t a, int32_t b) {
#if HAS_NARROW
    const uint32_t size = b < 0 ? 0 - (uint32_t)b : (uint32_t)b, low = low_half((uint64_t)a);
    const uint32_t high = high_half((uint64_t)a) * size + product_high(low, size);
    const int64_t product = (int64_t)join(high, low * size);
    return b < 0 ? -product : product;
#else
    return a * b;
#endif
}

struct triangulate_certain triangulate_find_certain(const struct rectify_plan *plan,
                                                    const struct triangulate_plan *made,
                                                    int32_t near_um, int32_t far_um) {
    // Of all of these 1/1000 and 10 um are left, for the rounding.
    const double more = 1.001, least_um = 10;
    const double slope_x = largest_slope_x(plan), slope_y = largest_slope_y(plan);
    const double length = sqrt(1 + slope_x * slope_x + slope_y * slope_y);
    const double *R =
        plan->R_rect_left;  // its last column turns (x, y, 1) into the left camera's z
    const double tilt_x = R[2] < 0 ? -R[2] : R[2], tilt_y = R[5] < 0 ? -R[5] : R[5];
    const double z_min = R[8] - tilt_x * slope_x - tilt_y * slope_y;
    const double z_max = R[8] + tilt_x * slope_x + tilt_y * slope_y;
    const double baseline_um = 1e3 * plan->baseline_mm, f_baseline_um = plan->f_px * baseline_um;
    const double far = math_min(far_um, (double)LIMIT_UM / more / length * z_min) - least_um;
    const double e_px = (double)made->vertical_max_q16 / 65536;
    struct triangulate_certain none = {.least_q8 = 1, .most_q8 = 0};
    if (!(z_min > 0 && far > 0)) {
        return none;
    }
    // |q| / N <= 1/2, so that neither point is further than this from B/D, in units of it.
    const double first_px = math_max(16 * e_px, 0.5 * f_baseline_um / far * z_max);
    const double k = e_px / first_px;
    const double off = 0.5 * e_px / plan->f_px + 0.5 * k * slope_x + k * k;
    const double shift_um = baseline_um * (off * tilt_x + k * tilt_y) + least_um;
    if (!(off < 0.5 && far > shift_um)) {
        return none;
    }
    const double least_px =
        math_max(first_px, f_baseline_um * (1 + off) * z_max / (far - shift_um)) * more;
    const double most_px = f_baseline_um * (1 - off) * z_min / (near_um + shift_um) / more;
    const double offset_px = plan->cx_left_px - plan->cx_right_px, limit = 1 << 30;
    const struct triangulate_certain certain = {
        .least_q8 = (int32_t)math_ceil(math_min(256 * (least_px + offset_px) + 1, limit)),
        .most_q8 = (int32_t)math_floor(math_min(256 * (most_px + offset_px) - 1, limit))};
    return certain.least_q8 <= certain.most_q8 ? certain : none;
}

// value factor / 2^bits for |value| < 2^44, |factor| < 2^32 and bits >= 16, without overflow.
static int64_t scale(int64_t value, int64_t factor, int bits) {
    const int64_t high = value >> 16, low = value & 0xffff;
    return (high * factor + ((low * factor) >> 16)) >> (bits - 16);
}

static bool is_near(const int64_t point[3], int64_t limit) {
    return point[0] >= -limit && point[0] <= limit && point[1] >= -limit && point[1] <= limit &&
           point[2] >= -limit && point[2] <= limit;
}

#define number int64_t
#define NAME(name) name##_64
#define SCALED(a, b, bits) (((a) * (b)) >> (bits))
#define PRODUCT(a, b) ((a) * (b))
#define MULTIPLE(a, b) ((a) * (b))
#define DISTANCE(um, b, bits) scale(um, b, bits)
#if HAS_NARROW
struct ray_64;
static int64_t divided(int64_t value, const struct ray_64 *ray);
#define DIVIDED(value, ray) divided(value, ray)
#else
#define DIVIDED(value, ray) ((value) / (ray)->parallax_q16)
#endif
#define IS_FAR(condition) (condition)
#include "stereo/geometry/triangulate_text.h"
#if HAS_NARROW
// By a parallax of 32 bits, and such are the quotients up to 16 m.
static int64_t divided(int64_t value, const struct ray_64 *ray) {
    return ray->reciprocal.scaled != 0 && high_half((uint64_t)value) < ray->parallax_q16
               ? reciprocal_quotient((uint64_t)value, &ray->reciprocal)
               : value / ray->parallax_q16;
}
#endif
#undef number
#undef NAME
#undef SCALED
#undef PRODUCT
#undef MULTIPLE
#undef DISTANCE
#undef DIVIDED
#undef IS_FAR

#if HAS_NARROW
#define number int32_t
#define NAME(name) name##_32
#define SCALED(a, b, bits) product_scaled(a, b, bits)
#define PRODUCT(a, b) product_signed(a, b)
#define MULTIPLE(a, b) multiple(a, b)
#define DISTANCE(um, b, bits) SCALED(um, b, bits)
#define DIVIDED(value, ray) ((int64_t)reciprocal_quotient((uint64_t)(value), &(ray)->reciprocal))
#define IS_FAR(condition) false
#include "stereo/geometry/triangulate_text.h"
#endif

// first + each pixel, rounded from 43 to 27 binary places.
static inline int32_t slope_at(int64_t first_q43, int64_t each_q43, int pixel) {
    const int64_t half = 1 << 15;
    return (int32_t)((first_q43 + half + multiple(each_q43, pixel)) >> 16);
}

bool triangulate_match(const struct triangulate_plan *plan, int x, int y, int32_t disparity_q8,
                       uint32_t sigma_q8, struct triangulate_point *point) {
    INVARIANT(x >= 0 && x <= IMAGE_MAX_SIDE_PX && y >= 0 && y <= IMAGE_MAX_SIDE_PX);
    const int32_t x_q27 = slope_at(plan->left_slope_x_q43, plan->pixel_slope_x_q43, x);
    const int32_t y_q27 = slope_at(plan->top_slope_y_q43, plan->pixel_slope_y_q43, y);
    const int64_t e_q32 = plan->vertical_q32 + multiple(plan->vertical_slope_x_q32, x) +
                          multiple(plan->vertical_slope_y_q32, y);
    struct ray_64 ray = {.x_q27 = x_q27,
                         .y_q27 = y_q27,
                         .e_q32 = e_q32,
                         .parallax_q16 = (int64_t)disparity_q8 * 256 - plan->offset_q16};
    if (ray.parallax_q16 <= 0) {
        return false;
    }
#if HAS_NARROW
    const uint32_t narrow_q16 = low_half((uint64_t)ray.parallax_q16);
    if (narrow_q16 == ray.parallax_q16) {
        ray.reciprocal = reciprocal_of(narrow_q16);
        if (narrow_q16 >= plan->narrow_min_q16 && narrow_q16 < NARROW_MAX_Q16 &&
            sigma_q8 < NARROW_SIGMA_Q8) {
            const struct ray_32 narrow = {x_q27, y_q27, e_q32, (int32_t)narrow_q16, ray.reciprocal};
            return match_32(plan, &narrow, sigma_q8, point);
        }
    }
#endif
    return match_64(plan, &ray, sigma_q8, point);
}
