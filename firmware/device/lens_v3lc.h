// SPDX-License-Identifier: Apache-2.0
/// Driver of the lens controller Image Labs V3LC, with up to two lenses, on RS-232 at 9600 8N1.
///
/// No manual is public. The protocol is that of its sibling V1LC as seen in public code
/// (ezod/visionplatform, v1lc.py): lines of ASCII with LF, with a digit in front for the lens;
/// positions are 300 .. 850, those of a V1LC 44 .. 180. A move gets no answer; `?` gets the three
/// positions (lens_v3lc_answer.h). That the digit selects the lens is our assumption.
///
/// The controller is known to send wrong iris values now and then, and bytes may be lost, changed,
/// late or in pieces. So an answer is accepted only if it is complete, of the right lens, and all
/// its values are possible positions; otherwise the question is repeated. A V1LC's iris value is
/// always random, so this driver gives it no iris axis. Only one question is outstanding: after a
/// timeout the next one waits until the line has been quiet, so that the late answer is not taken
/// for that to the next question. A question to the other lens waits as long: each lens gets its
/// own answer, also when both are read in turn with short deadlines. The timeout adapts: a little
/// more than twice the time of the last answer. `time_us` of a reading is the time of the question.
/// `sampled_us` is the time when its last byte reaches the controller, behind those of commands
/// before it, plus the driver's `sample_us`: 0, as positions are assumed to be sampled before the
/// answer begins. The time when the answer arrives says less, as it depends on the controller's
/// delay.
///
/// Not detectable: a digit changed into another one, and a command that lost bytes but is still
/// valid ("2Z600" without its 2 moves lens 1). Code that moves lenses therefore checks several
/// readings, and both lenses.
#ifndef VERGENCE_DEVICE_LENS_V3LC_H
#define VERGENCE_DEVICE_LENS_V3LC_H

#include "device/lens_driver.h"
#include "device/lens_v3lc_answer.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    /// Tolerance of readings outside the commands' range: the end stops are there, and
    /// potentiometers drift.
    LENS_V3LC_BEYOND = 40,
    /// An answer takes 57 ms at 9600 baud. A question without an answer is repeated after a
    /// timeout, which adapts within these limits.
    LENS_V3LC_TIMEOUT_MIN_US = 200000,
    LENS_V3LC_TIMEOUT_MAX_US = 1600000,
};

/// Statistics of the line; all wrap.
struct lens_v3lc_counts {
    uint32_t asked;     ///< status questions
    uint32_t answered;  ///< accepted answers
    uint32_t silent;    ///< questions without an answer in time
    uint32_t garbage;   ///< invalid answers and lines, values out of range
    uint32_t late;      ///< answers to earlier questions, or of the other lens
};

/// The state of the controller.
struct lens_v3lc {
    struct lens_controller *controller;
    bool single;     ///< a V1LC, whose commands have no digit
    bool waiting;    ///< a question is outstanding
    uint8_t lens;    ///< its lens
    bool corrupted;  ///< its answer came and was invalid
    bool broken;     ///< the next line to the controller begins with the rest of a truncated one
    uint32_t timeout_us;
    uint64_t quiet_us;    ///< time of the last byte in either direction
    uint64_t last_rx_us;  ///< time of its last byte; 0: none
    uint64_t heard_us;    ///< time when it was last listened to
    uint64_t sent_us;     ///< time at which the line has sent all bytes written so far
    struct lens_v3lc_answer answer;
    struct lens_v3lc_counts counts;
    struct lens_v3lc_lens {
        uint8_t unanswered;          ///< questions that may still be answered
        bool fresh;                  ///< an accepted answer has not been returned yet
        uint64_t first_us, last_us;  ///< times of the first and the last unanswered question
        uint64_t accepted_us;  ///< time when the question of the accepted answer was first sent
        uint64_t asked_us;     ///< time when the last question had reached the controller
        uint64_t sampled_us;   ///< time when the accepted answer was sampled; 0: not known
        int16_t accepted[LENS_V3LC_VALUES];
    } lenses[LENS_LENSES_MAX];
};

/// The state of a controller with this driver.
struct lens_v3lc *lens_v3lc_state(struct lens_controller *controller);

#ifdef __cplusplus
}
#endif

#endif
