// SPDX-License-Identifier: Apache-2.0
/// A hobby servo as pulse widths: which angle is which width, how long it takes to get there.
/// HiTec HS-322HD: 1500 us is the middle, 600 .. 2400 us are safe, 10.3 us a degree, 60 degrees in
/// 0.19 s at 4.8 V, dead band 5 us.
#ifndef VERGENCE_DEVICE_SERVO_H
#define VERGENCE_DEVICE_SERVO_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// All widths in 1/16 us. The angle is that of the horn, positive for longer pulses, in
/// microradians (rad * 1e6).
struct servo_model {
    uint16_t centre_q4;          ///< width at angle 0
    uint16_t least_q4, most_q4;  ///< never outside, whatever is asked
    uint16_t dead_band_q4;       ///< a change of at most so much may move nothing
    uint32_t q4_per_rad;
    uint32_t urad_per_s;  ///< at its slowest supply
    uint32_t settle_us;   ///< after the motion, until it has come to rest
};

/// The HS-322HD.
struct servo_model servo_hs322hd(void);

/// The width nearest to an angle. ERROR_RANGE: outside the limits; nothing is stored then.
int servo_width_q4(const struct servo_model *model, int32_t angle_urad, uint16_t *width_q4);
/// The angle of a width; to the width of an angle and back it moves by at most half a 1/16 us
/// (53 urad with the HS-322HD).
int32_t servo_angle_urad(const struct servo_model *model, uint16_t width_q4);
/// Longest time until the horn, at rest before, rests again after a new width was asked for: it is
/// taken with the next pulse and goes from one to the other by at most `slew_q4` (0: at once) with
/// each pulse, one every `period_us`. 0 when both are the same.
uint64_t servo_travel_us(const struct servo_model *model, uint16_t from_q4, uint16_t to_q4,
                         uint16_t slew_q4, uint32_t period_us);

#ifdef __cplusplus
}
#endif

#endif
