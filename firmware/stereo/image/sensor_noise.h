// SPDX-License-Identifier: Apache-2.0
/// The noise that is assumed of a frame where the real one is not known: 5000 electrons full well
/// (the MT9T001 has more) and a read noise of 1.5 / 1024 of the range, both times the gain; if the
/// gain is not known, four times as much.
#ifndef VERGENCE_STEREO_IMAGE_SENSOR_NOISE_H
#define VERGENCE_STEREO_IMAGE_SENSOR_NOISE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
    SENSOR_NOISE_WELL_E = 5000,
    SENSOR_NOISE_GAIN_ONE_Q3 = 8,
    SENSOR_NOISE_GAIN_UNKNOWN_Q3 = 32,
};

/// The gain to be assumed; `gain_q3` 0: not known.
static inline uint64_t sensor_noise_gain_q3(uint16_t gain_q3) {
    return gain_q3 != 0 ? gain_q3 : SENSOR_NOISE_GAIN_UNKNOWN_Q3;
}

/// Variance of the sum of values whose light is `light` in sum, from the light alone: in 1/64.
static inline uint64_t sensor_noise_of_light_q6(int bits, uint64_t gain_q3, uint64_t light) {
    return light * (gain_q3 * SENSOR_NOISE_GAIN_ONE_Q3 << bits) / SENSOR_NOISE_WELL_E;
}

/// Variance of the sum of `values` values without light: in 1/64.
static inline uint64_t sensor_noise_of_reading_q6(int bits, uint64_t gain_q3, uint64_t values) {
    const uint64_t range = UINT64_C(1) << bits;
    return values * gain_q3 * gain_q3 * range * range / 1024 * 9 / 4 / 1024;
}

#ifdef __cplusplus
}
#endif

#endif
