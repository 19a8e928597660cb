// SPDX-License-Identifier: Apache-2.0
/// The lens controller Image Labs V3LC with up to two lenses, over RS-232 at 9600 8N1.
///
/// No manual is public. What stands here are the commands of its sibling V1LC as seen in public
/// code, lines of ASCII with LF, with a digit in front for the lens; positions are 300 .. 850.
/// A move gets no answer; `?` gets the three positions. The controller is known to send rubbish for
/// the iris now and then, and lines may be lost or split, so a reading is believed when it is in
/// the range of its sensor and complete, and asked again otherwise; see lens_v3lc_counts.
#ifndef VERGENCE_DEVICE_LENS_V3LC_H
#define VERGENCE_DEVICE_LENS_V3LC_H

#include "device/lens.h"
#include "hal/clock.h"
#include "hal/uart.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { LENS_V3LC_LENSES = 2, LENS_V3LC_LEAST = 300, LENS_V3LC_MOST = 850 };

/// What happened on the line; all wrap.
struct lens_v3lc_counts {
    uint32_t asked;     ///< status questions
    uint32_t answered;  ///< complete answers
    uint32_t silent;    ///< questions without one in time
    uint32_t rubbish;   ///< answers that made no sense
};

/// The controller. The caller owns it, and UART and clock, which must outlive it. `single`: a V1LC,
/// whose commands have no digit.
struct lens_v3lc {
    const struct hal_uart *uart;
    const struct hal_clock *clock;
    bool single;
    struct lens_v3lc_counts counts;
    struct lens_v3lc_lens {
        struct lens_v3lc *controller;
        uint8_t number;
    } lenses[LENS_V3LC_LENSES];
};

/// Stores the pointers. Nothing is sent.
void lens_v3lc_init(struct lens_v3lc *self, const struct hal_uart *uart,
                    const struct hal_clock *clock, bool single);

/// One of its lenses (0 .. LENS_V3LC_LENSES - 1; 0 alone when `single`).
struct lens lens_v3lc_lens(struct lens_v3lc *self, unsigned number);

#ifdef __cplusplus
}
#endif

#endif
