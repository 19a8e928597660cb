// SPDX-License-Identifier: Apache-2.0
// Part of triangulate.c, which includes it for each `number`: of 64 bits for all values, and of 32
// bits for those that fit. It defines
//     NAME(name)                the name of that form
//     SCALED(a, b, bits)        a b / 2^bits, rounded down
//     DISTANCE(um, b, bits)     the same for a coordinate of up to 44 bits
//     PRODUCT(a, b)             a b, in 64 bits
//     MULTIPLE(a, b)            a b, a of 64 bits
//     DIVIDED(value, ray)       value / parallax, for value >= 0
//     IS_FAR(condition)         a condition that numbers of 32 bits never meet

// A ray of the left camera, and the parallax of its match.
struct NAME(ray) {
    number x_q27, y_q27;
    int64_t e_q32;  // residual vertical disparity
    number parallax_q16;
    struct reciprocal reciprocal;  // of a parallax of 32 bits
};

// Position and distance of the closest approach of the rays, relative to B/D.
struct NAME(passing) {
    number left_q26, right_q26;  // s and t as 1 + these
    number inverse_root_n_q30;
    number sensitivity_q16;  // change of the parallax per residual: (q x + 2 k) / N
};

static inline struct NAME(passing)
    NAME(find_passing)(const struct NAME(ray) * ray, number e_q27, number k_q30) {
    const number kx_q27 = SCALED(k_q30, ray->x_q27, 30);
    const number q_q27 = ray->y_q27 + kx_q27;
    const number k_q27 = k_q30 >> 3;
    const number k2_q26 = SCALED(k_q27, k_q27, 28);
    const number n_q26 = ((number)1 << 26) + k2_q26 + SCALED(q_q27, q_q27, 28);
    int shift;
    const uint32_t m_q30 = root_normalise(n_q26, &shift);
    // n = n_q26 2^-26 = m_q30 2^-30 2^(4 - shift)
    const number inverse_q30 = (number)(root_inverse_q30(m_q30) >> ((4 - shift) / 2));
    INVARIANT(shift <= 4 && inverse_q30 > 0);
    const number inverse_n_q29 = SCALED(inverse_q30, inverse_q30, 31);
    const number qkx_q26 = SCALED(q_q27, kx_q27, 28);
    const number qe_q26 = SCALED(q_q27, e_q27, 28);
    const number qx_q26 = SCALED(q_q27, ray->x_q27, 28);
    return (struct NAME(passing)){
        .left_q26 = SCALED(qe_q26 - qkx_q26 - k2_q26, inverse_n_q29, 29),
        .right_q26 = SCALED(-qkx_q26 - k2_q26, inverse_n_q29, 29),
        .inverse_root_n_q30 = inverse_q30,
        .sensitivity_q16 = SCALED(qx_q26 + k_q27, inverse_n_q29, 39),
    };
}

// Standard deviation along the left ray for a depth and a parallax in pixels.
static inline uint32_t NAME(predict_sigma_um)(const struct triangulate_plan *plan,
                                              const struct NAME(ray) * ray, number z_um,
                                              uint32_t sigma_q8, number sensitivity_q16) {
    const number along_q12 = (number)(sigma_q8 < 65535 ? sigma_q8 : 65535) * 16;
    const number across_q12 = SCALED(plan->vertical_sigma_q12, sensitivity_q16, 16);
    const number variance_q24 = along_q12 * along_q12 + across_q12 * across_q12;
    const number length2_q12 =
        (1 << 12) + SCALED(ray->x_q27, ray->x_q27, 42) + SCALED(ray->y_q27, ray->y_q27, 42);
    // Coarser if the variance is large, so that the product stays below 2^62.
    const int coarser = IS_FAR(variance_q24 >= (int64_t)1 << 42) ? 16 : 0;
    const number deviation_q18 = (number)root_of(PRODUCT(variance_q24 >> coarser, length2_q12))
                                 << coarser / 2;
    const number max_q18 = (number)((int64_t)1 << 31);
    INVARIANT(z_um >= 0 && z_um <= LIMIT_UM && deviation_q18 >= 0);
    const number sigma_um_q2 = (number)DIVIDED(
        PRODUCT(z_um, IS_FAR(deviation_q18 > max_q18) ? max_q18 : deviation_q18), ray);
    const number sigma_um = (sigma_um_q2 + 2) >> 2;
    return IS_FAR(sigma_um > UINT32_MAX) ? UINT32_MAX : (uint32_t)sigma_um;
}

// The mid-point in the rect frame: z (x, y, 1) + (shift_x, shift_y, 0).
struct NAME(meeting) {
    number z_q8, shift_x_q8, shift_y_q8;  // um
    uint32_t miss_um;
    number sensitivity_q16;
};

// With a residual vertical disparity. Returns false if the rays do not meet.
static inline bool NAME(meet_off_row)(const struct triangulate_plan *plan,
                                      const struct NAME(ray) * ray, number plain_q8,
                                      struct NAME(meeting) * meeting) {
    const number e_q16 = (number)(ray->e_q32 >> 16);
    if (IS_FAR(e_q16 > ray->parallax_q16 || -e_q16 > ray->parallax_q16)) {
        return false;
    }
    // Its magnitude is below 1/4.
    const number e_q27 = (number)(MULTIPLE(plan->pixel_slope_x_q43, e_q16) >> 32);
    const int64_t size_q46 = (ray->e_q32 < 0 ? -ray->e_q32 : ray->e_q32) << 14;
    const number size_q30 = (number)DIVIDED(size_q46, ray);
    const number k_q30 = ray->e_q32 < 0 ? -size_q30 : size_q30;
    const struct NAME(passing) passing = NAME(find_passing)(ray, e_q27, k_q30);
    const number one_q26 = 1 << 26, baseline_um = plan->baseline_um;
    if (IS_FAR(passing.left_q26 <= -one_q26 || passing.right_q26 <= -one_q26)) {
        return false;  // the point is behind a camera
    }
    const number tk_q26 = SCALED(k_q30, one_q26 + passing.right_q26, 30);
    const int64_t apart_q16 = PRODUCT(baseline_um, size_q30) >> 14;
    *meeting = (struct NAME(meeting)){
        .z_q8 = plain_q8 + DISTANCE(plain_q8, (passing.left_q26 + passing.right_q26) / 2, 26),
        // The right point is at (B, 0, 0) + t b: adds half of its offset from (x, y, 1) t.
        .shift_x_q8 = SCALED(-baseline_um, passing.right_q26, 19),
        .shift_y_q8 = SCALED(baseline_um, tk_q26, 19),
        .miss_um = (uint32_t)((MULTIPLE(apart_q16, passing.inverse_root_n_q30 >> 14) +
                               ((int64_t)1 << 31)) >>
                              32),
        .sensitivity_q16 = passing.sensitivity_q16,
    };
    return true;
}

// Rotates a point of the rect frame into the left camera's.
static inline void NAME(turn_back)(const struct triangulate_plan *plan, const number rect_q8[3],
                                   number left_um[3]) {
    for (int row = 0; row < 3; row++) {
        const int32_t *R = plan->R_left_rect_q30 + 3 * row;
        const number sum_q8 = DISTANCE(rect_q8[0], R[0], 30) + DISTANCE(rect_q8[1], R[1], 30) +
                              DISTANCE(rect_q8[2], R[2], 30);
        left_um[row] = (sum_q8 + 128) >> 8;
    }
}

static bool NAME(match)(const struct triangulate_plan *plan, const struct NAME(ray) * ray,
                        uint32_t sigma_q8, struct triangulate_point *point) {
    const number range = (number)DIVIDED(plan->f_baseline_um_q16 + ray->parallax_q16 / 2, ray);
    if (IS_FAR(range > LIMIT_UM << plan->range_shift)) {
        return false;
    }
    const number plain_q8 = range << (8 - plan->range_shift);
    struct NAME(meeting) meeting = {.z_q8 = plain_q8};
    if (plan->has_vertical && !NAME(meet_off_row)(plan, ray, plain_q8, &meeting)) {
        return false;
    }
    const number z_q8 = meeting.z_q8;
    if (IS_FAR(z_q8 <= 0 || z_q8 > LIMIT_UM * 256)) {
        return false;
    }
    const number rect_q8[3] = {DISTANCE(z_q8, ray->x_q27, 27) + meeting.shift_x_q8,
                               DISTANCE(z_q8, ray->y_q27, 27) + meeting.shift_y_q8, z_q8};
    number left_um[3];
    if (IS_FAR(!is_near(rect_q8, LIMIT_UM * 256))) {
        return false;
    }
    NAME(turn_back)(plan, rect_q8, left_um);
    if (IS_FAR(!is_near(left_um, LIMIT_UM))) {
        return false;
    }
    point->x_um = (int32_t)left_um[0];
    point->y_um = (int32_t)left_um[1];
    point->z_um = (int32_t)left_um[2];
    point->miss_um = meeting.miss_um;
    point->sigma_um =
        NAME(predict_sigma_um)(plan, ray, z_q8 >> 8, sigma_q8, meeting.sensitivity_q16);
    return true;
}
