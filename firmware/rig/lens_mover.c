// SPDX-License-Identifier: Apache-2.0
#include "rig/lens_mover.h"

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "rig/base/health.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"

enum {
    US_PER_S = 1000000,
    COMMAND_US = 100000,  // a command has been sent by then
    LEGS_PER_APPROACH = 2,
    RUNNING_COUNTS = 40,  // largest distance that a running motor covers during some readings
    RECENT_US = 1000000,
    LEG_READINGS = 12,  // granted to a leg even on a slow line, however long they take
};

static int32_t distance(int32_t a, int32_t b) {
    return a < b ? b - a : a - b;
}

static uint64_t travel_us(const struct rig_profile *profile, enum lens_axis axis, int32_t counts) {
    const int32_t counts_per_s = profile->lens.axis[axis].counts_per_s;
    INVARIANT(counts_per_s > 0 && counts >= 0);
    return (uint64_t)counts * US_PER_S / (uint64_t)counts_per_s;
}

// How far below its target an approach starts.
static int32_t run_up(const struct lens_axis_settings *settings) {
    INVARIANT(settings->backlash_counts >= 0 && settings->tolerance_counts >= 0);
    const int32_t counts = settings->backlash_counts + settings->tolerance_counts;
    return counts > LENS_MOVE_STEP_COUNTS ? counts : LENS_MOVE_STEP_COUNTS;
}

bool lens_move_has_room(const struct lens_axis_settings *settings, int32_t target) {
    const bool below = settings->approach == LENS_FROM_BELOW;
    return (below ? target - settings->min : settings->max - target) >= run_up(settings);
}

uint64_t lens_move_stall_us(const struct rig_profile *profile, enum lens_axis axis) {
    return LENS_MOVE_STALL_US + travel_us(profile, axis, 2 * LENS_MOVE_STEP_COUNTS);
}

static uint64_t leg_us(const struct rig_profile *profile, enum lens_axis axis, int32_t counts) {
    return travel_us(profile, axis, counts) + 3 * lens_move_stall_us(profile, axis);
}

uint64_t lens_move_limit_us(const struct rig_profile *profile, enum lens_axis axis,
                            int32_t distance_counts) {
    const int32_t beside = run_up(&profile->lens.axis[axis]) + 2 * LENS_MOVE_OFFSET_COUNTS;
    return (uint64_t)RIG_SIDES * LENS_READ_MEDIAN * LENS_READ_INVALID_US + LENS_MOVE_REST_US +
           LEGS_PER_APPROACH *
               leg_us(profile, axis, distance_counts + run_up(&profile->lens.axis[axis])) +
           (uint64_t)LENS_MOVE_TRIMS * LEGS_PER_APPROACH * leg_us(profile, axis, beside);
}

static int send(struct rig *self, const struct lens_mover *mover) {
    const struct lens_drive *drive = &mover->lens->drive;
    const uint64_t deadline_us = rig_now_us(self) + COMMAND_US;
    const int error = lens_go(drive, mover->axis, mover->sign * mover->command, deadline_us);
    if (error != ERROR_OK) {
        rig_part_used(self, rig_part_of(RIG_PART_LEFT_LENS, mover->side), error);
        return rig_part_failed(
            self, rig_part_of(RIG_PART_LEFT_LENS, mover->side), error,
            "the move command cannot be sent (check the line to its controller)");
    }
    mover->lens->commanded[mover->axis] = mover->sign * mover->target;
    mover->lens->rest_us[mover->axis] = UINT64_MAX;
    return ERROR_OK;
}

// ---- legs

static int begin_leg(struct rig *self, struct lens_mover *mover, int32_t goal) {
    const int32_t wanted = goal + mover->lens->offset[mover->axis];
    mover->goal = goal;
    mover->begin = mover->middle;
    mover->command = math_clamp_int(wanted, mover->min, mover->max);
    mover->count = mover->since_mark = mover->settled = 0;
    mover->sent = 1;
    mover->mark = mover->begin;
    mover->since_us = mover->mark_us = rig_now_us(self);
    // "Moving" may be another motor of the lens.
    const bool any = mover->lens->drive.controller->driver->abilities.reports_moving;
    const int32_t way = any ? mover->max - mover->min : distance(mover->begin, goal);
    mover->deadline_us = mover->since_us + leg_us(&self->profile, mover->axis, way);
    return send(self, mover);
}

// Starts towards the waypoint.
static int begin_approach(struct rig *self, struct lens_mover *mover) {
    mover->phase = LENS_MOVER_GOING_BACK;
    mover->been_back = true;
    return begin_leg(self, mover, mover->waypoint);
}

// It is already at its target, approached from below.
static bool is_at_target(const struct lens_mover *mover) {
    return !mover->forced && mover->lens->commanded[mover->axis] == mover->sign * mover->target &&
           distance(mover->middle, mover->target) <= mover->settings->tolerance_counts;
}

static int start(struct rig *self, struct lens_mover *mover) {
    if (is_at_target(mover)) {
        mover->phase = LENS_MOVER_ARRIVED;
        return ERROR_OK;
    }
    if (mover->coarse) {
        mover->path = (uint32_t)distance(mover->middle, mover->target);
        mover->phase = LENS_MOVER_GOING_UP;
        return begin_leg(self, mover, mover->target);
    }
    // While the motor runs, its position is not known well.
    const bool runs = mover->lens->rest_us[mover->axis] == UINT64_MAX;
    if (runs && mover->middle + RUNNING_COUNTS > mover->waypoint &&
        mover->waypoint < mover->target) {
        mover->path = (uint32_t)(distance(mover->middle, mover->waypoint) +
                                 distance(mover->waypoint, mover->target));
        return begin_approach(self, mover);
    }
    const int32_t down = mover->middle > mover->waypoint ? mover->middle - mover->waypoint : 0;
    const int32_t up = distance(down > 0 ? mover->waypoint : mover->middle, mover->target);
    mover->path = (uint32_t)(down + up);
    if (down > 0 && mover->waypoint < mover->target) {
        return begin_approach(self, mover);
    }
    mover->phase = LENS_MOVER_GOING_UP;
    return begin_leg(self, mover, mover->target);
}

static int jammed(struct rig *self, struct lens_mover *mover) {
    static const char *const texts[LENS_AXES] = {
        "zoom is stuck at # and does not move to # (free the ring, then move it again)",
        "focus is stuck at # and does not move to # (free the ring, then move it again)",
        "iris is stuck at # and does not move to # (free the ring, then move it again)",
    };
    mover->lens->offset[mover->axis] = mover->offset_before;  // restored: the jam looked like drift
    rig_part_used(self, rig_part_of(RIG_PART_LEFT_LENS, mover->side), ERROR_JAMMED);
    return rig_part_error(
        self, rig_part_of(RIG_PART_LEFT_LENS, mover->side), ERROR_JAMMED, texts[mover->axis],
        (const int32_t[]){mover->sign * mover->middle, mover->sign * mover->goal});
}

int lens_mover_late(struct rig *self, struct lens_mover *mover) {
    mover->lens->offset[mover->axis] = mover->offset_before;
    rig_part_used(self, rig_part_of(RIG_PART_LEFT_LENS, mover->side), ERROR_TIMEOUT);
    return rig_part_error(
        self, rig_part_of(RIG_PART_LEFT_LENS, mover->side), ERROR_TIMEOUT,
        "it is at # and does not arrive at # in time (check the motor, and the "
        "profile's speeds and tolerance)",
        (const int32_t[]){mover->sign * mover->middle, mover->sign * mover->goal});
}

// Passed the waypoint. From above it goes below first, if there is room.
static int continue_up(struct rig *self, struct lens_mover *mover) {
    if (mover->goal > mover->target && mover->low < mover->target) {
        return begin_leg(self, mover, mover->low);
    }
    mover->phase = LENS_MOVER_GOING_UP;
    return begin_leg(self, mover, mover->target);
}

// Start far enough away to distinguish a jam from drift; without room below, start above.
static int begin_long_approach(struct rig *self, struct lens_mover *mover) {
    const int32_t target = mover->target, middle = mover->middle;
    const int32_t run = run_up(mover->settings) + LENS_MOVE_OFFSET_COUNTS;
    const int32_t below = (middle < target ? middle : target) - run;
    const int32_t above = (middle > target ? middle : target) + run;
    mover->waypoint = below >= mover->min ? below : above;
    mover->far = true;
    return begin_approach(self, mover);
}

// It moved, and stopped off the target: approach again, corrected by the error.
static int update_offset(struct rig *self, struct lens_mover *mover) {
    const int32_t beside = mover->middle - mover->target;
    const int32_t tolerance = mover->settings->tolerance_counts;
    int32_t *offset = &mover->lens->offset[mover->axis];
    const int32_t wanted =
        math_clamp_int(*offset - beside, -LENS_MOVE_OFFSET_COUNTS, LENS_MOVE_OFFSET_COUNTS);
    const int32_t command = math_clamp_int(mover->target + wanted, mover->min, mover->max);
    const bool at_end = command == mover->command;
    const bool again = mover->rest_position != INT32_MIN &&
                       distance(mover->rest_position, mover->middle) <= tolerance;
    if (at_end && again) {
        mover->lens->stopped_at_us = mover->lens->rest_us[mover->axis] = mover->mark_us;
        mover->phase = LENS_MOVER_ARRIVED;
        return ERROR_OK;
    }
    if (mover->trims == LENS_MOVE_TRIMS) {
        return lens_mover_late(self, mover);
    }
    mover->trims++;
    mover->rest_position = mover->middle;
    *offset = at_end ? *offset : wanted;
    return begin_long_approach(self, mover);
}

// One count at a time: more than typical noise, and less than the tolerance.
static void follow_drift(const struct lens_mover *mover) {
    enum { NOISE_COUNTS = 2 };
    const int32_t beside = mover->middle - mover->target;
    int32_t *offset = &mover->lens->offset[mover->axis];
    const int32_t step = (beside <= -NOISE_COUNTS) - (beside >= NOISE_COUNTS);
    *offset = math_clamp_int(*offset + step, -LENS_MOVE_OFFSET_COUNTS, LENS_MOVE_OFFSET_COUNTS);
}

// The present leg of a coarse move is over: near its goal, or past it.
static bool is_near(const struct lens_mover *mover, bool moving) {
    const bool reads_position = mover->lens->drive.controller->driver->abilities.reads_position;
    const bool past =
        mover->goal < mover->begin ? mover->middle < mover->goal : mover->middle > mover->goal;
    // To an end of the range it goes as far as it can.
    const bool at_end = mover->goal == mover->min || mover->goal == mover->max;
    const int32_t near = at_end ? mover->settings->tolerance_counts : LENS_MOVE_STEP_COUNTS;
    return reads_position ? past || distance(mover->middle, mover->goal) <= near : !moving;
}

// The target is not approached as a later move may need it.
static void end_coarse(struct lens_mover *mover) {
    mover->lens->commanded[mover->axis] = INT32_MIN;
    mover->phase = LENS_MOVER_ARRIVED;
}

// No movement for too long.
static int stalled(struct rig *self, struct lens_mover *mover) {
    const int32_t left = distance(mover->middle, mover->goal);
    const int32_t way = distance(mover->begin, mover->goal);
    const int32_t moved = distance(mover->middle, mover->begin);
    const int32_t tolerance = mover->settings->tolerance_counts;
    const bool back = mover->phase == LENS_MOVER_GOING_BACK;
    if (left > LENS_MOVE_OFFSET_COUNTS + (mover->far ? LENS_MOVE_OFFSET_COUNTS : 0)) {
        return jammed(self, mover);
    }
    if (mover->coarse) {
        end_coarse(mover);
        return ERROR_OK;
    }
    if (!back) {
        return update_offset(self, mover);
    }
    // Whatever the drift, a long leg moves the motor at least by the run-up, and past the target.
    const bool past = mover->waypoint > mover->target || mover->middle < mover->target - tolerance;
    const int32_t min = mover->far ? run_up(mover->settings) : way;
    if (past && 2 * moved >= min) {
        return continue_up(self, mover);
    }
    return mover->far ? jammed(self, mover) : begin_long_approach(self, mover);
}

// ---- readings

static int assess(struct rig *self, struct lens_mover *mover) {
    const uint64_t now_us = rig_now_us(self);
    const uint64_t still_us = now_us - mover->mark_us;
    const uint64_t stall_us = lens_move_stall_us(&self->profile, mover->axis);
    if (mover->settled >= LENS_MOVE_SETTLED_READINGS) {
        if (mover->phase == LENS_MOVER_GOING_BACK) {
            return continue_up(self, mover);
        }
        follow_drift(mover);
        mover->lens->stopped_at_us = now_us;
        mover->lens->rest_us[mover->axis] = mover->settled_us;
        mover->phase = LENS_MOVER_ARRIVED;
        return ERROR_OK;
    }
    if (still_us >= stall_us && mover->since_mark >= LENS_MOVE_STALL_READINGS) {
        return stalled(self, mover);
    }
    if (now_us >= mover->deadline_us && mover->count >= LEG_READINGS) {
        return lens_mover_late(self, mover);
    }
    const bool begun = distance(mover->middle, mover->begin) > mover->settings->tolerance_counts;
    if (!begun && still_us >= mover->sent * stall_us / LENS_MOVE_COMMANDS) {
        mover->sent++;  // the previous one may have been lost
        return send(self, mover);
    }
    return ERROR_OK;
}

static void record_way(struct lens_mover *mover) {
    const bool back = mover->phase == LENS_MOVER_GOING_BACK;
    const int32_t ahead = back ? distance(mover->target, mover->waypoint) : 0;
    const uint32_t left = (uint32_t)(distance(mover->middle, mover->goal) + ahead);
    const uint32_t done = left < mover->path ? mover->path - left : 0;
    mover->done = done > mover->done ? done : mover->done;
}

// On the way back, beyond is also fine.
static bool is_at_goal(const struct lens_mover *mover) {
    const bool past =
        mover->waypoint < mover->target ? mover->middle < mover->goal : mover->middle > mover->goal;
    return distance(mover->middle, mover->goal) <= mover->settings->tolerance_counts ||
           (mover->phase == LENS_MOVER_GOING_BACK && past);
}

// At its start the previous readings count too if they are recent and the motor rests, or if the
// way need not be exact.
static void take_previous(struct lens_mover *mover, uint64_t now_us) {
    const struct rig_lens *lens = mover->lens;
    const bool rests = lens->rest_us[mover->axis] != UINT64_MAX;
    if (lens->tracked < LENS_READ_MEDIAN || !(rests || mover->coarse)) {
        return;
    }
    for (uint32_t i = LENS_READ_MEDIAN; i > 1; i--) {
        const struct rig_lens_track *track = &lens->track[(lens->tracked - i) % RIG_LENS_TRACK];
        if (track->sampled_us + RECENT_US < now_us ||
            (rests && track->sampled_us < lens->rest_us[mover->axis])) {
            return;
        }
        mover->readings[i - 2] = mover->sign * track->position[mover->axis];
    }
    mover->count = LENS_READ_MEDIAN - 1;
}

// Updates what the median of the last three readings says about the present leg.
static void track_leg(struct rig *self, struct lens_mover *mover,
                      const struct lens_reading *reading) {
    mover->settled = is_at_goal(mover) && !reading->moving ? mover->settled + 1 : 0;
    // The median of three readings is one reading late.
    mover->settled_us = mover->settled == 2 ? reading->time_us : mover->settled_us;
    if (reading->moving || distance(mover->middle, mover->mark) >= LENS_MOVE_STEP_COUNTS) {
        mover->mark = mover->middle;
        mover->mark_us = rig_now_us(self);
        mover->since_mark = 0;
    }
    record_way(mover);
}

// Two outliers among the first three readings can hide that it was above.
static bool must_go_back(const struct lens_mover *mover) {
    const bool above = mover->middle > mover->target + mover->settings->tolerance_counts;
    return above && !mover->coarse && !mover->been_back && mover->waypoint < mover->target;
}

int lens_mover_take(struct rig *self, struct lens_mover *mover,
                    const struct lens_reading *reading) {
    INVARIANT(mover->phase != LENS_MOVER_ARRIVED && reading->time_us >= mover->since_us);
    mover->since_us = reading->time_us + 1;
    if (mover->phase == LENS_MOVER_STARTING && mover->count == 0) {
        take_previous(mover, reading->time_us);
    }
    mover->readings[mover->count % LENS_READ_MEDIAN] = mover->sign * reading->position;
    mover->count++;
    mover->since_mark++;
    if (mover->count < LENS_READ_MEDIAN) {
        return ERROR_OK;
    }
    mover->middle = lens_read_median(mover->readings);
    if (mover->phase == LENS_MOVER_STARTING) {
        return start(self, mover);
    }
    track_leg(self, mover, reading);
    if (mover->coarse && is_near(mover, reading->moving)) {
        end_coarse(mover);
        return ERROR_OK;
    }
    return must_go_back(mover) ? begin_approach(self, mover) : assess(self, mover);
}

bool lens_mover_is_under_way(const struct lens_mover *mover) {
    return mover->phase == LENS_MOVER_GOING_BACK || mover->phase == LENS_MOVER_GOING_UP;
}

void lens_mover_init(struct rig *self, struct lens_mover *mover, unsigned side, enum lens_axis axis,
                     int32_t position) {
    struct rig_lens *lens = &self->camera[side].lens;
    const struct lens_axis_settings *settings = &self->profile.lens.axis[axis];
    const bool below = settings->approach == LENS_FROM_BELOW;
    INVARIANT(position >= settings->min && position <= settings->max);
    *mover = (struct lens_mover){
        .side = side,
        .axis = axis,
        .lens = lens,
        .settings = settings,
        .phase = LENS_MOVER_STARTING,
        .sign = below ? 1 : -1,
        .min = below ? settings->min : -settings->max,
        .max = below ? settings->max : -settings->min,
        .target = below ? position : -position,
        .since_us = rig_now_us(self),
        .offset_before = lens->offset[axis],
        .rest_position = INT32_MIN,
    };
    const int32_t low = mover->target - run_up(settings);
    mover->low = mover->waypoint = low > mover->min ? low : mover->min;
}

void lens_mover_hold(struct rig *self, const struct lens_mover *mover,
                     const int32_t readings[LENS_READ_MEDIAN]) {
    const int32_t seen = mover->sign * mover->middle;
    const int32_t two = lens_read_median((const int32_t[]){readings[0], readings[1], seen});
    const int32_t all = lens_read_median((const int32_t[]){two, readings[2], seen});
    const int32_t wanted = mover->sign * all + mover->lens->offset[mover->axis];
    const int32_t at = mover->sign * math_clamp_int(wanted, mover->min, mover->max);
    mover->lens->rest_us[mover->axis] = UINT64_MAX;
    (void)lens_go(&mover->lens->drive, mover->axis, at, rig_now_us(self) + COMMAND_US);
}
