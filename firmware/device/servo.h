// SPDX-License-Identifier: Apache-2.0
/// Model of a hobby servo: pulse width of an angle, and time to get there. HiTec HS-322HD: 1500 us
/// is the middle, 600 .. 2400 us are safe, 10.3 us per degree, 60 degrees in 0.19 s at 4.8 V, dead
/// band 5 us.
#ifndef VERGENCE_DEVICE_SERVO_H
#define VERGENCE_DEVICE_SERVO_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// All widths in 1/16 us. Angles are those of the horn, positive for longer pulses, in microradians
/// (rad * 1e6).
struct servo_model {
    uint16_t centre_q4;       ///< width at angle 0
    uint16_t min_q4, max_q4;  ///< absolute limits
    uint16_t dead_band_q4;    ///< a change of at most this much may have no effect
    uint32_t q4_per_rad;
    uint32_t urad_per_s;  ///< speed at the lowest supply voltage
    uint32_t settle_us;   ///< time to settle after the motion
};

/// The HS-322HD.
struct servo_model servo_hs322hd(void);

/// The width nearest to an angle. ERROR_RANGE: outside the limits; the output is then unchanged.
int servo_width_q4(const struct servo_model *model, int32_t angle_urad, uint16_t *width_q4);
/// The angle of a width. An angle converted to a width and back changes by at most half of 1/16 us
/// (53 urad for the HS-322HD).
int32_t servo_angle_urad(const struct servo_model *model, uint16_t width_q4);
/// Longest time until a horn at rest is at rest again after a new width was requested. The change
/// starts with the next pulse, by at most `slew_q4` (0: at once) per pulse, one every `period_us`.
/// 0 if both widths are equal.
uint64_t servo_travel_us(const struct servo_model *model, uint16_t from_q4, uint16_t to_q4,
                         uint16_t slew_q4, uint32_t period_us);

#ifdef __cplusplus
}
#endif

#endif
