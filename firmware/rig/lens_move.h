// SPDX-License-Identifier: Apache-2.0
/// Moves of lenses, in steps that do not block: begin, step until done. Several moves can be under
/// way at once, of different lenses or axes, with frames between the steps; rig_lens_move_to
/// (rig/rig.h) is a loop over the steps of one.
///
///     struct rig_lens_move move;
///     int error = rig_lens_move_begin(rig, &move, sides, LENS_FOCUS, position,
///                                     LENS_MOVE_IF_NEEDED);
///     while (error == ERROR_OK && !rig_lens_move_done(&move)) {
///         error = rig_lens_move_step(rig, &move, 0);  // and what else there is to do
///     }
///
/// A motor turns its ring through gears with play, so the ring's position is repeatable only if it
/// is always approached from the same side, usually from above (device/lens_driver.c explains why).
/// A move then first goes up to target + (backlash + tolerance), unless the lens is already above
/// that, and then down. Close to the upper limit there is no room for this, and the play remains.
/// With an approach from below all of this is mirrored.
///
/// The controller reports only noisy positions. A lens has arrived when the median of three
/// readings is within the tolerance, and stays so for three more readings. It is jammed when that
/// median has not come LENS_MOVE_STEP_COUNTS nearer for lens_move_stall_us and five readings; after
/// half of that time the command is sent again, as it may have been lost. A motor that moved, but
/// stops off the target by at most LENS_MOVE_OFFSET_COUNTS (for example, because its potentiometer
/// has drifted), is sent as far the other way on the next approach, up to three times; the
/// correction is kept in the lens's `offset`. At an end of the controller's range no correction is
/// possible: the lens has arrived when a second approach ends at the same position.
///
/// A controller without position sensors that reports whether a motor runs counts as moving for as
/// long as it says so; it cannot report jams. If it cannot be stopped either, a cancelled move
/// rests when the motor has ended its leg.
///
/// A drift smaller than the tolerance is corrected by one count per move.
///
/// Measured with the simulated lenses of rigs/default.yaml (play 4, noise 1, drift 0.5 per hour), a
/// tolerance of 3 and a slowest speed of 80; 10,000 moves of zoom and focus per row, p50/p99/max
/// (VERGENCE_DRAWS=10000 motion_lens_figures_test, seed 20090915); "again": LENS_MOVE_ALWAYS to the
/// present target:
///
///                          ring's error, counts   seconds            beyond the travel time
///   one lens, up to 540    0.62  2.39  3.50       1.26  3.95  4.43   0.37  0.91  1.49
///   both lenses, up to 540 0.69  2.64  3.98       1.67  4.61  4.94   0.68  1.53  2.00
///   one lens, up to 20     0.58  2.33  3.34       0.83  1.00  1.65   0.79  0.93  1.59
///   both lenses, up to 20  0.64  2.49  4.26       1.45  1.65  2.45   1.40  1.55  2.37
///   one lens, again        0.59  2.35  3.16       0.83  0.93  3.58   0.83  0.93  3.58
///   both lenses, again     0.65  2.53  3.72       1.45  1.61  2.04   1.45  1.61  2.04
///
/// The error is that of the ring on the potentiometer's scale, on which it rests half the play
/// above; a reading takes 56 ms, and both lenses share the line. Moves that do not wait for the
/// three readings at their start, because the last ones are less than a second old, are 0.1 s
/// shorter. A coarse move takes 0.4 s less. Jams at random moments with random motors
/// (motion_lens_move_test, 10,000): reported after 1.9 s (median), p99 3.7, max 4.4.
///
/// After a jam, a failure or ERROR_CANCELLED the motors are stopped, or sent to their present
/// position, and waited for until they are at rest.
#ifndef VERGENCE_RIG_LENS_MOVE_H
#define VERGENCE_RIG_LENS_MOVE_H

#include "rig/lens_mover.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A move that is under way. The caller owns it, and does not touch its fields.
struct rig_lens_move {
    enum {
        LENS_MOVE_DONE,
        LENS_MOVE_GOING,
        LENS_MOVE_STOPPING,  ///< the motors, one after the other
        LENS_MOVE_TURNING,   ///< they may be about to reverse
        LENS_MOVE_RESTING,   ///< waiting until each motor is seen at rest
    } phase;
    int error;                ///< why it failed
    struct rig_error reason;  ///< what `last_error` was then
    struct lens_mover movers[RIG_SIDES];
    unsigned count;
    unsigned turn;         ///< the one that is read now
    uint64_t asked_us;     ///< time when the wait for a reading, or a pause, began
    uint64_t stepped_us;   ///< time when the last step ended
    uint64_t deadline_us;  ///< deadline of the whole move
    uint64_t stop_us;      ///< time when the move began to stop
    int32_t readings[LENS_READ_MEDIAN];
    unsigned alike;  ///< number of these, or of equal readings at rest
};

enum rig_lens_move_when {
    LENS_MOVE_IF_NEEDED,  ///< a lens that is at this target already, from the right side, stays
    LENS_MOVE_ALWAYS,     ///< it approaches the target again
    /// From either side, straight; done as soon as it is seen near the target or past it
    /// (LENS_MOVE_STEP_COUNTS), while the motor may still run: for ways on which another move
    /// follows.
    LENS_MOVE_COARSE,
};

/// Begins to move an axis of the lenses `sides` (bits RIG_LEFT, RIG_RIGHT) to a position. Returns
/// 0, ERROR_ARGUMENT, ERROR_NOT_CONNECTED, ERROR_RANGE, or ERROR_NOT_READY if the rig is not up or
/// another move has this axis. After an error nothing is to be done.
int rig_lens_move_begin(struct rig *self, struct rig_lens_move *move, unsigned sides,
                        enum lens_axis axis, int32_t position, enum rig_lens_move_when when);

/// Does what is due, and waits for the controller until `until_us` at most; 0: does not wait. A
/// lens should be stepped every 20 ms; it continues to its target, but arrives later, if not.
/// Returns 0 while it is under way and when it has arrived; the error of a failed or cancelled move
/// once all its motors are at rest. Checks the observer's should_stop and the bridge's watchdog.
int rig_lens_move_step(struct rig *self, struct rig_lens_move *move, uint64_t until_us);

/// Ends a move that is under way with ERROR_CANCELLED, which the step returns that sees it at rest.
void rig_lens_move_cancel(struct rig *self, struct rig_lens_move *move);

/// Whether it has arrived, or failed and its motors are at rest.
bool rig_lens_move_done(const struct rig_lens_move *move);

#ifdef __cplusplus
}
#endif

#endif
