// SPDX-License-Identifier: Apache-2.0
/// One axis of one lens on its way to a target: what each reading of its position leads to. It
/// sends commands, but never waits. For rig/ only; rig/lens_move.h explains the approach.
///
/// Positions here grow towards the target's side: with an approach from above they are negated, so
/// that the last leg always goes up.
#ifndef VERGENCE_RIG_LENS_MOVER_H
#define VERGENCE_RIG_LENS_MOVER_H

#include "rig/lens_read.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    LENS_MOVE_STEP_COUNTS = 8,
    LENS_MOVE_STALL_US = 1000000,
    LENS_MOVE_STALL_READINGS = 5,
    LENS_MOVE_COMMANDS = 4,  ///< commands to a motor that does not start, within lens_move_stall_us
    LENS_MOVE_SETTLED_READINGS = 4,
    LENS_MOVE_TRIMS = 3,
    LENS_MOVE_OFFSET_COUNTS = 20,
    LENS_MOVE_REST_US = 2500000,  ///< longest time to stop
};

enum lens_mover_phase {
    LENS_MOVER_STARTING,  ///< its position is not known yet
    LENS_MOVER_GOING_BACK,
    LENS_MOVER_GOING_UP,
    LENS_MOVER_ARRIVED,
};

/// An axis that is moving. Owned by the caller.
struct lens_mover {
    unsigned side;
    enum lens_axis axis;
    struct rig_lens *lens;
    const struct lens_axis_settings *settings;
    enum lens_mover_phase phase;
    int32_t sign;  ///< -1: positions are negated
    int32_t min, max, target;
    int32_t low;       ///< position where an approach starts
    int32_t waypoint;  ///< waypoint of the present approach
    // The present leg, in readings of the position.
    int32_t goal, begin, command;
    int32_t readings[LENS_READ_MEDIAN];
    uint32_t count;  ///< number of readings in the present leg
    int32_t middle;
    int32_t mark;         ///< position when it last moved
    uint32_t since_mark;  ///< number of readings
    uint32_t settled;     ///< number of readings
    uint64_t settled_us;  ///< time of the second settled reading
    uint32_t sent;
    uint64_t since_us;  ///< later readings count
    uint64_t mark_us, deadline_us;
    bool been_back, far;
    bool forced;  ///< also to the present target
    bool coarse;  ///< done near the target
    int32_t offset_before;
    uint32_t trims;
    /// Where the previous approach ended off its target; INT32_MIN: nowhere yet.
    int32_t rest_position;
    uint32_t path, done;  ///< counts of the whole path and of the part done, to display progress
};

/// Time without progress after which a motor counts as jammed: LENS_MOVE_STALL_US, plus twice the
/// time in which the slowest motor moves LENS_MOVE_STEP_COUNTS.
uint64_t lens_move_stall_us(const struct rig_profile *profile, enum lens_axis axis);

/// Whether there is room for the approach of a target: it must be far enough from the limit on that
/// side. Otherwise the motor's play remains, up to its backlash.
bool lens_move_has_room(const struct lens_axis_settings *settings, int32_t target);

/// Upper bound of the duration of a call of rig_lens_move_to, for lenses at most `distance` counts
/// away from their targets.
uint64_t lens_move_limit_us(const struct rig_profile *profile, enum lens_axis axis,
                            int32_t distance);

/// Prepares a move to a position within the range of the axis. Sends nothing.
void lens_mover_init(struct rig *self, struct lens_mover *mover, unsigned side, enum lens_axis axis,
                     int32_t position);

/// Takes a reading that was requested at `since_us` or later, and sends what follows from it.
/// Returns 0, ERROR_JAMMED, ERROR_TIMEOUT or an error of the line, with `last_error` set.
int lens_mover_take(struct rig *self, struct lens_mover *mover, const struct lens_reading *reading);

/// Ends a move that takes too long. Returns ERROR_TIMEOUT with `last_error` set.
int lens_mover_late(struct rig *self, struct lens_mover *mover);

/// Whether its motor was sent somewhere and has not arrived.
bool lens_mover_is_under_way(const struct lens_mover *mover);

/// Sends the motor to its present position, of which two of three new readings may be outliers.
void lens_mover_hold(struct rig *self, const struct lens_mover *mover,
                     const int32_t readings[LENS_READ_MEDIAN]);

#ifdef __cplusplus
}
#endif

#endif
