// SPDX-License-Identifier: Apache-2.0
/// Whether two frames of one camera show the same scene, by what their noise allows. For rig/
/// alone.
#ifndef VERGENCE_RIG_PAIR_CHANGE_H
#define VERGENCE_RIG_PAIR_CHANGE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Two frames of one size, without gaps between rows.
struct pair_change_frames {
    const uint16_t *before, *after;
    uint32_t width, height;  ///< values; more than one a pixel where there are colours
    uint8_t bits;            ///< of a value
    uint16_t gain_q3;        ///< of the sensor; 0: not known
};

/// Parts in a thousand of the picture, in squares of 4 x 4 values, whose sums differ by more than
/// five times the noise of their difference. Assumed is the noise of a sensor whose pixels hold
/// 5000 electrons (the MT9T001's hold more) and are read with 1.5 / 1024 of their range, both times
/// the gain; four times the gain where it is not known.
uint32_t pair_change_permille(const struct pair_change_frames *frames);

#ifdef __cplusplus
}
#endif

#endif
