// SPDX-License-Identifier: Apache-2.0
/// The lens controller Image Labs V3LC with up to two lenses, over RS-232 at 9600 8N1.
///
/// No manual is public. What stands here are the commands of its sibling V1LC as seen in public
/// code (ezod/visionplatform, v1lc.py), lines of ASCII with LF, with a digit in front for the lens;
/// positions are 300 .. 850, those of a V1LC 44 .. 180. A move gets no answer; `?` gets the three
/// positions (lens_v3lc_answer.h). That the digit names the lens is our assumption.
///
/// The controller is known to send rubbish for the iris now and then, and bytes may be lost,
/// changed, late or in pieces. So an answer is believed when it is whole, of the right lens, and
/// all its values can be positions; else the question is asked again. A V1LC's iris is always
/// random: it has none here. Only one question is on its way: after a silence the next waits until
/// the line has been quiet, so that the late answer is not taken for that to the next. How long a
/// silence is, is learnt: some more than twice what the last answer took.
///
/// What cannot be told: a digit that was changed into another, and a command of which bytes were
/// lost and that means something all the same ("2Z600" without its 2 moves lens 1). Who moves
/// lenses looks at more than one reading, and at both lenses.
#ifndef VERGENCE_DEVICE_LENS_V3LC_H
#define VERGENCE_DEVICE_LENS_V3LC_H

#include "device/lens_drive.h"
#include "device/lens_v3lc_answer.h"
#include "hal/clock.h"
#include "hal/uart.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    LENS_V3LC_LENSES = 2,
    LENS_V3LC_LEAST = 300,
    LENS_V3LC_MOST = 850,
    LENS_V1LC_LEAST = 44,
    LENS_V1LC_MOST = 180,
    /// A reading may be so far outside the commands' range: the end stops are, and potentiometers
    /// drift.
    LENS_V3LC_BEYOND = 40,
    /// An answer takes 57 ms at 9600 baud. A question without one for the patience is asked again;
    /// it is learnt within these.
    LENS_V3LC_PATIENCE_LEAST_US = 200000,
    LENS_V3LC_PATIENCE_MOST_US = 1600000,
};

/// What happened on the line; all wrap.
struct lens_v3lc_counts {
    uint32_t asked;     ///< status questions
    uint32_t answered;  ///< answers that were believed
    uint32_t silent;    ///< questions without one in time
    uint32_t rubbish;   ///< answers and lines that made no sense, values out of range
    uint32_t late;      ///< answers to earlier questions, or of the other lens
};

/// The controller. The caller owns it, and UART and clock, which must outlive it. `single`: a V1LC,
/// whose commands have no digit.
struct lens_v3lc {
    const struct hal_uart *uart;
    const struct hal_clock *clock;
    bool single;
    bool waiting;  ///< a question is on its way
    uint8_t lens;  ///< whose it is
    bool spoilt;   ///< its answer came and made no sense
    bool broken;   ///< the next line to the controller begins with the end of one cut short
    uint32_t patience_us;
    uint64_t quiet_us;  ///< nobody has sent since: the last byte of either side
    uint64_t heard_us;  ///< its last byte; 0: none came
    struct lens_v3lc_answer answer;
    int16_t believed[LENS_V3LC_VALUES];  ///< of the last answer that was
    struct lens_v3lc_counts counts;
    struct lens_v3lc_lens {
        struct lens_v3lc *controller;
        uint8_t number;
        uint8_t unanswered;          ///< questions that may still be answered
        uint64_t first_us, last_us;  ///< when the first and the last of these were asked
    } lenses[LENS_V3LC_LENSES];
};

/// Stores the pointers. Nothing is sent.
void lens_v3lc_init(struct lens_v3lc *self, const struct hal_uart *uart,
                    const struct hal_clock *clock, bool single);

/// One of its lenses (0 .. LENS_V3LC_LENSES - 1; 0 alone when `single`).
///
/// Its `read` may give up at its deadline with ERROR_TIMEOUT while the question is on its way, and
/// the next `read` of the same lens waits on for that answer: short deadlines do no harm. `time_us`
/// of a reading tells when it was asked for.
struct lens_drive lens_v3lc_lens(struct lens_v3lc *self, unsigned number);

#ifdef __cplusplus
}
#endif

#endif
