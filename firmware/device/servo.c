// SPDX-License-Identifier: Apache-2.0
#include "device/servo.h"

#include "core/error.h"
#include "core/invariant.h"

enum { Q4_PER_US = 16, URAD_PER_RAD = 1000000, US_PER_S = 1000000 };

struct servo_model servo_hs322hd(void) {
    return (struct servo_model){
        .centre_q4 = 1500 * Q4_PER_US,
        .min_q4 = 600 * Q4_PER_US,
        .max_q4 = 2400 * Q4_PER_US,
        .dead_band_q4 = 5 * Q4_PER_US,
        .q4_per_rad = 9442,     // 10.3 us per degree
        .urad_per_s = 5500000,  // 60 degrees in 0.19 s, rounded down
        .settle_us = 100000,    // assumed; not measured with a camera on the horn
    };
}

// a / b rounded to nearest, halves away from 0; b > 0.
static int64_t nearest(int64_t a, int64_t b) {
    return (a < 0 ? a - b / 2 : a + b / 2) / b;
}

int servo_width_q4(const struct servo_model *model, int32_t angle_urad, uint16_t *width_q4) {
    INVARIANT(model->min_q4 <= model->centre_q4 && model->centre_q4 <= model->max_q4);
    const int64_t width =
        model->centre_q4 + nearest((int64_t)angle_urad * model->q4_per_rad, URAD_PER_RAD);
    if (width < model->min_q4 || width > model->max_q4) {
        return ERROR_RANGE;
    }
    *width_q4 = (uint16_t)width;
    return ERROR_OK;
}

int32_t servo_angle_urad(const struct servo_model *model, uint16_t width_q4) {
    INVARIANT(model->q4_per_rad > 0);
    const int64_t from_centre_q4 = (int64_t)width_q4 - model->centre_q4;
    const int64_t angle = nearest(from_centre_q4 * URAD_PER_RAD, model->q4_per_rad);
    if (angle < INT32_MIN) {
        return INT32_MIN;
    }
    return angle > INT32_MAX ? INT32_MAX : (int32_t)angle;
}

// Time in which the horn turns by such a change, rounded up.
static uint64_t turn_us(const struct servo_model *model, uint64_t way_q4) {
    INVARIANT(way_q4 <= UINT16_MAX);
    const uint64_t q4_urad_per_rad_s = (uint64_t)model->q4_per_rad * model->urad_per_s;
    const uint64_t scale = (uint64_t)URAD_PER_RAD * US_PER_S;
    return (way_q4 * scale + q4_urad_per_rad_s - 1) / q4_urad_per_rad_s;
}

uint64_t servo_travel_us(const struct servo_model *model, uint16_t from_q4, uint16_t to_q4,
                         uint16_t slew_q4, uint32_t period_us) {
    INVARIANT(model->q4_per_rad > 0 && model->urad_per_s > 0);
    const uint32_t way_q4 = (uint32_t)(from_q4 < to_q4 ? to_q4 - from_q4 : from_q4 - to_q4);
    if (way_q4 == 0) {
        return 0;
    }
    const uint32_t step_q4 = slew_q4 == 0 || slew_q4 > way_q4 ? way_q4 : slew_q4;
    const uint32_t steps = (way_q4 + step_q4 - 1) / step_q4;
    // The largest delay is that after the first step or after the last one: between them the
    // remaining angle changes evenly. The servo sees a step when its pulse ends.
    const uint64_t first_us = turn_us(model, way_q4);
    const uint64_t last_us =
        (uint64_t)(steps - 1) * period_us + turn_us(model, way_q4 - (steps - 1) * step_q4);
    const uint64_t pulse_us = (uint64_t)model->max_q4 / Q4_PER_US + 1;
    return period_us + pulse_us + (first_us > last_us ? first_us : last_us) + model->settle_us;
}
