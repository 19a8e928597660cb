// SPDX-License-Identifier: Apache-2.0
/// How rig_lens_move_to moves lenses, and how long it may take.
///
/// A motor turns its ring through gears with play, so the ring's position is repeatable only if it
/// is always approached from the same side. A move first goes down to target -
/// (lens_backlash_counts + lens_tolerance_counts), unless the lens is already below that, and then
/// up. Close to the lower limit there is no room for this, and the play remains.
///
/// The controller reports only noisy positions. A lens has arrived when the median of three
/// readings is within the tolerance, and stays so for three more readings. It is jammed when that
/// median has not come LENS_MOVE_STEP_COUNTS nearer for lens_move_stall_us and five readings; after
/// half of that time the command is sent again, as it may have been lost. A motor that moved, but
/// stops off the target by at most LENS_MOVE_OFFSET_COUNTS (for example, because its potentiometer
/// has drifted), is sent as far the other way on the next approach, up to three times; the
/// correction is kept in `lens_offset`. At an end of the controller's range no correction is
/// possible: the lens has arrived when a second approach ends at the same position.
///
/// A drift smaller than the tolerance is corrected by one count per move.
///
/// Measured with the simulated lenses of rigs/default.yaml (play 4, noise 1, drift 0.5 per hour), a
/// tolerance of 3 and a slowest speed of 80; 10,000 moves of zoom and focus per row, p50/p99/max
/// (VERGENCE_DRAWS=10000 motion_lens_figures_test, seed 20090915):
///
///                          ring's error, counts   seconds            beyond the travel time
///   one lens, up to 540    0.57  2.30  3.47       1.37  4.12  4.49   0.48  1.02  1.40
///   both lenses, up to 540 0.61  2.28  3.50       1.97  4.73  5.22   0.90  1.75  4.08
///   one lens, up to 20     0.60  2.27  3.40       0.94  1.11  1.39   0.90  1.04  1.33
///   both lenses, up to 20  0.60  2.30  3.49       1.67  1.88  5.40   1.62  1.78  5.32
///
/// The error is that of the ring on the potentiometer's scale, on which it rests half the play
/// below; a reading takes 57 ms, and both lenses share the line. Jams at random moments with random
/// motors (motion_lens_move_test, 10,000): reported after 2.1 s (median), p99 4.4, max 4.9.
///
/// After a jam, a failure or ERROR_CANCELLED the motors are stopped, or sent to their present
/// position.
#ifndef VERGENCE_RIG_LENS_MOVE_H
#define VERGENCE_RIG_LENS_MOVE_H

#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    LENS_MOVE_STEP_COUNTS = 8,
    LENS_MOVE_STALL_US = 1000000,
    LENS_MOVE_STALL_READINGS = 5,
    LENS_MOVE_COMMANDS = 4,  ///< within that time
    LENS_MOVE_SETTLED_READINGS = 4,
    LENS_MOVE_TRIMS = 3,
    LENS_MOVE_OFFSET_COUNTS = 20,
    LENS_MOVE_REST_US = 2500000,  ///< longest time to stop
};

/// Time without progress after which a motor counts as jammed: LENS_MOVE_STALL_US, plus twice the
/// time in which the slowest motor moves LENS_MOVE_STEP_COUNTS.
uint64_t lens_move_stall_us(const struct rig_profile *profile, enum lens_axis axis);

/// A jam is reported at most this long after it began, on a line that works; LENS_MOVE_REST_US
/// later the other lens is at rest. Close to a target a second approach is needed to distinguish a
/// jam from drift.
uint64_t lens_move_jam_us(const struct rig_profile *profile, enum lens_axis axis);

/// Whether there is room for the approach of a target: it must be far enough from the limit on that
/// side. Otherwise the motor's play remains, up to its backlash.
bool lens_move_has_room(const struct lens_axis_settings *settings, int32_t target);

/// Upper bound of the duration of a call of rig_lens_move_to, for lenses at most `distance` counts
/// away from their targets.
uint64_t lens_move_limit_us(const struct rig_profile *profile, enum lens_axis axis,
                            int32_t distance);

#ifdef __cplusplus
}
#endif

#endif
