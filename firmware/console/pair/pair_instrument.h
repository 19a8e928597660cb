// SPDX-License-Identifier: Apache-2.0
/// The instrument that took a pair's frames, so that pairs can be compared without a profile.
#ifndef VERGENCE_CONSOLE_PAIR_PAIR_INSTRUMENT_H
#define VERGENCE_CONSOLE_PAIR_PAIR_INSTRUMENT_H

#include <stdint.h>

#include "rig/rig.h"

enum { PAIR_INSTRUMENT_NAME_BYTES = 65 };

struct pair_instrument {
    char camera[RIG_SIDES][PAIR_INSTRUMENT_NAME_BYTES];  // serial number or port; "" if unknown
    /// Pulse of the servo's middle in 1/16 us, and pulse per angle; 0 0: no servo.
    uint16_t servo_centre_q4[RIG_SIDES];
    uint32_t servo_q4_per_rad[RIG_SIDES];
    // As in struct rig_profile.
    uint32_t pan_repeatability_urad, lens_repeatability_counts, lens_zoom_ppm;
};

#endif
