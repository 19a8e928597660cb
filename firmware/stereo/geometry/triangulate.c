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

#include "core/error.h"
#include "core/invariant.h"
#include "core/root.h"

static const int64_t LIMIT_UM = 2000000000;

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
    result->vertical_q32 = fixed(aspect * corner_px, 32);
    result->vertical_slope_x_q32 = fixed(aspect * vertical->slope_x, 32);
    result->vertical_slope_y_q32 = fixed(aspect * vertical->slope_y, 32);
    result->vertical_sigma_q12 = fixed(aspect * vertical->rms_px, 12);
    return ERROR_OK;
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
        .baseline_um = fixed(1e3 * plan->baseline_mm, 0),
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
    *result = made;
    return ERROR_OK;
}

// value factor / 2^bits for |value| < 2^44, |factor| < 2^32 and bits >= 16, without overflow.
static int64_t scale(int64_t value, int64_t factor, int bits) {
    const int64_t high = value >> 16, low = value & 0xffff;
    return (high * factor + ((low * factor) >> 16)) >> (bits - 16);
}

// Position and distance of the closest approach of the rays, relative to B/D.
struct passing {
    int64_t left_q26, right_q26;  // s and t as 1 + these
    int64_t inverse_root_n_q30;
    int64_t sensitivity_q16;  // change of the parallax per residual: (q x + 2 k) / N
};

static struct passing find_passing(int64_t x_q27, int64_t y_q27, int64_t e_q27, int64_t k_q30) {
    const int64_t kx_q27 = (k_q30 * x_q27) >> 30;
    const int64_t q_q27 = y_q27 + kx_q27;
    const int64_t k_q27 = k_q30 >> 3;
    const int64_t k2_q26 = (k_q27 * k_q27) >> 28;
    const int64_t n_q26 = ((int64_t)1 << 26) + k2_q26 + ((q_q27 * q_q27) >> 28);
    int shift;
    const int64_t m_q30 = root_normalise(n_q26, &shift);
    // n = n_q26 2^-26 = m_q30 2^-30 2^(4 - shift)
    const int64_t inverse_q30 = root_inverse_q30(m_q30) >> ((4 - shift) / 2);
    INVARIANT(shift <= 4 && inverse_q30 > 0);
    const int64_t inverse_n_q29 = (inverse_q30 * inverse_q30) >> 31;
    const int64_t qkx_q26 = (q_q27 * kx_q27) >> 28;
    const int64_t qe_q26 = (q_q27 * e_q27) >> 28;
    const int64_t qx_q26 = (q_q27 * x_q27) >> 28;
    return (struct passing){
        .left_q26 = ((qe_q26 - qkx_q26 - k2_q26) * inverse_n_q29) >> 29,
        .right_q26 = ((-qkx_q26 - k2_q26) * inverse_n_q29) >> 29,
        .inverse_root_n_q30 = inverse_q30,
        .sensitivity_q16 = ((qx_q26 + k_q27) * inverse_n_q29) >> 39,
    };
}

// Standard deviation along the left ray for a depth and a parallax in pixels.
static uint32_t predict_sigma_um(const struct triangulate_plan *plan, int64_t x_q27, int64_t y_q27,
                                 int64_t z_um, int64_t parallax_q16, uint32_t sigma_q8,
                                 int64_t sensitivity_q16) {
    const int64_t along_q12 = (int64_t)(sigma_q8 < 65535 ? sigma_q8 : 65535) * 16;
    const int64_t across_q12 = (plan->vertical_sigma_q12 * sensitivity_q16) >> 16;
    const int64_t variance_q24 = along_q12 * along_q12 + across_q12 * across_q12;
    const int64_t length2_q12 =
        ((int64_t)1 << 12) + ((x_q27 * x_q27) >> 42) + ((y_q27 * y_q27) >> 42);
    // Coarser if the variance is large, so that the product stays below 2^62.
    const bool is_large = variance_q24 >= (int64_t)1 << 42;
    const int64_t product = (is_large ? variance_q24 >> 16 : variance_q24) * length2_q12;
    const int64_t max_q18 = (int64_t)1 << 31;
    const int64_t deviation_q18 = is_large ? root_of(product) << 8 : root_of(product);
    INVARIANT(z_um >= 0 && z_um <= LIMIT_UM && deviation_q18 >= 0);
    const int64_t sigma_um_q2 =
        z_um * (deviation_q18 < max_q18 ? deviation_q18 : max_q18) / parallax_q16;
    const int64_t sigma_um = (sigma_um_q2 + 2) >> 2;
    return sigma_um < UINT32_MAX ? (uint32_t)sigma_um : UINT32_MAX;
}

static bool is_near(int64_t a, int64_t b, int64_t c, int64_t limit) {
    return a >= -limit && a <= limit && b >= -limit && b <= limit && c >= -limit && c <= limit;
}

// The mid-point in the rect frame: z (x, y, 1) + (shift_x, shift_y, 0).
struct meeting {
    int64_t z_q8, shift_x_q8, shift_y_q8;  // um
    int64_t miss_um;
    int64_t sensitivity_q16;
};

// With a residual vertical disparity. Returns false if the rays do not meet.
static bool meet_off_row(const struct triangulate_plan *plan, int x, int y, int64_t x_q27,
                         int64_t y_q27, int64_t plain_q8, int64_t parallax_q16,
                         struct meeting *meeting) {
    const int64_t e_q32 =
        plan->vertical_q32 + x * plan->vertical_slope_x_q32 + y * plan->vertical_slope_y_q32;
    const int64_t e_q16 = e_q32 >> 16;
    if (e_q16 > parallax_q16 || -e_q16 > parallax_q16) {
        return false;
    }
    const int64_t e_q27 = (e_q16 * plan->pixel_slope_x_q43) >> 32;  // its magnitude is below 1/4
    const int64_t k_q30 = e_q32 * (1 << 14) / parallax_q16;
    const struct passing passing = find_passing(x_q27, y_q27, e_q27, k_q30);
    const int64_t one_q26 = 1 << 26;
    if (passing.left_q26 <= -one_q26 || passing.right_q26 <= -one_q26) {
        return false;  // the point is behind a camera
    }
    const int64_t tk_q26 = (k_q30 * (one_q26 + passing.right_q26)) >> 30;
    const int64_t apart_q16 = (plan->baseline_um * (k_q30 < 0 ? -k_q30 : k_q30)) >> 14;
    *meeting = (struct meeting){
        .z_q8 = plain_q8 + scale(plain_q8, (passing.left_q26 + passing.right_q26) / 2, 26),
        // The right point is at (B, 0, 0) + t b: adds half of its offset from (x, y, 1) t.
        .shift_x_q8 = (-plan->baseline_um * passing.right_q26) >> 19,
        .shift_y_q8 = (plan->baseline_um * tk_q26) >> 19,
        .miss_um = (apart_q16 * (passing.inverse_root_n_q30 >> 14) + ((int64_t)1 << 31)) >> 32,
        .sensitivity_q16 = passing.sensitivity_q16,
    };
    return true;
}

// Rotates a point of the rect frame into the left camera's. Returns false if it is too far away.
static bool turn_back(const struct triangulate_plan *plan, const int64_t rect_q8[3],
                      int64_t left_um[3]) {
    for (int row = 0; row < 3; row++) {
        const int32_t *R = plan->R_left_rect_q30 + 3 * row;
        const int64_t sum_q8 =
            scale(rect_q8[0], R[0], 30) + scale(rect_q8[1], R[1], 30) + scale(rect_q8[2], R[2], 30);
        left_um[row] = (sum_q8 + 128) >> 8;
    }
    return is_near(left_um[0], left_um[1], left_um[2], LIMIT_UM);
}

bool triangulate_match(const struct triangulate_plan *plan, int x, int y, int32_t disparity_q8,
                       uint32_t sigma_q8, struct triangulate_point *point) {
    INVARIANT(x >= 0 && x <= IMAGE_MAX_SIDE_PX && y >= 0 && y <= IMAGE_MAX_SIDE_PX);
    const int64_t parallax_q16 = (int64_t)disparity_q8 * 256 - plan->offset_q16;
    if (parallax_q16 <= 0) {
        return false;
    }
    const int64_t range = (plan->f_baseline_um_q16 + parallax_q16 / 2) / parallax_q16;
    if (range > LIMIT_UM << plan->range_shift) {
        return false;
    }
    const int64_t plain_q8 = range << (8 - plan->range_shift);
    const int64_t half = 1 << 15;
    const int64_t x_q27 = (plan->left_slope_x_q43 + x * plan->pixel_slope_x_q43 + half) >> 16;
    const int64_t y_q27 = (plan->top_slope_y_q43 + y * plan->pixel_slope_y_q43 + half) >> 16;

    struct meeting meeting = {.z_q8 = plain_q8};
    if (plan->has_vertical &&
        !meet_off_row(plan, x, y, x_q27, y_q27, plain_q8, parallax_q16, &meeting)) {
        return false;
    }
    const int64_t z_q8 = meeting.z_q8;
    const int64_t limit_q8 = LIMIT_UM * 256;
    if (z_q8 <= 0 || z_q8 > limit_q8) {
        return false;
    }
    const int64_t rect_q8[3] = {scale(z_q8, x_q27, 27) + meeting.shift_x_q8,
                                scale(z_q8, y_q27, 27) + meeting.shift_y_q8, z_q8};
    int64_t left_um[3];
    if (!is_near(rect_q8[0], rect_q8[1], rect_q8[2], limit_q8) ||
        !turn_back(plan, rect_q8, left_um)) {
        return false;
    }
    point->x_um = (int32_t)left_um[0];
    point->y_um = (int32_t)left_um[1];
    point->z_um = (int32_t)left_um[2];
    point->miss_um = (uint32_t)meeting.miss_um;
    point->sigma_um = predict_sigma_um(plan, x_q27, y_q27, z_q8 >> 8, parallax_q16, sigma_q8,
                                       meeting.sensitivity_q16);
    return true;
}
