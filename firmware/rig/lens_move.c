// SPDX-License-Identifier: Apache-2.0
#include "rig/lens_move.h"

#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/health.h"
#include "rig/base/poll.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"
#include "rig/base/watchdog.h"
#include "rig/lens_read.h"
#include "rig/safe.h"

enum {
    US_PER_S = 1000000,
    COMMAND_US = 100000,  // a command has been sent by then
    HALT_US = 500000,     // longest time for a lens
    TURN_US = 200000,
    LEGS_PER_APPROACH = 2,
    LEG_READINGS = 12,  // granted to a leg even on a slow line, however long they take
};

// A lens that is moving.
struct mover {
    unsigned side;
    struct rig_lens *lens;
    enum lens_axis axis;
    enum { STARTING, GOING_BACK, GOING_UP, ARRIVED } phase;
    int32_t target;
    int32_t low;       // where an approach from below starts
    int32_t waypoint;  // of this approach
    const struct lens_axis_settings *settings;
    // The present leg, in readings of the potentiometer.
    int32_t goal, begin, command;
    int32_t readings[LENS_READ_MEDIAN];
    uint32_t count, sent;  // of this leg
    int32_t middle;
    int32_t mark;                  // position when it last moved
    uint32_t since_mark, settled;  // numbers of readings
    uint64_t since_us, mark_us, deadline_us;
    bool been_back, far;
    int32_t offset_before;
    int32_t rest_position;  // where the previous approach ended off its target; INT32_MIN: not yet
    uint32_t trims, path, done;
};

static int32_t distance(int32_t a, int32_t b) {
    return a < b ? b - a : a - b;
}

static int32_t within(int32_t value, int32_t min, int32_t max) {
    return value < min ? min : value > max ? max : value;
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
    return target - settings->min >= run_up(settings);
}

uint64_t lens_move_stall_us(const struct rig_profile *profile, enum lens_axis axis) {
    return LENS_MOVE_STALL_US + travel_us(profile, axis, 2 * LENS_MOVE_STEP_COUNTS);
}

static uint64_t leg_us(const struct rig_profile *profile, enum lens_axis axis, int32_t counts) {
    return travel_us(profile, axis, counts) + 3 * lens_move_stall_us(profile, axis);
}

uint64_t lens_move_jam_us(const struct rig_profile *profile, enum lens_axis axis) {
    // Down, up, and down once more; each with the first readings of a leg.
    return 3 * (lens_move_stall_us(profile, axis) + LENS_MOVE_STALL_US);
}

uint64_t lens_move_limit_us(const struct rig_profile *profile, enum lens_axis axis,
                            int32_t distance_counts) {
    const int32_t beside = run_up(&profile->lens.axis[axis]) + 2 * LENS_MOVE_OFFSET_COUNTS;
    return (uint64_t)RIG_SIDES * LENS_READ_MEDIAN * LENS_READ_INVALID_US + LENS_MOVE_REST_US +
           LEGS_PER_APPROACH *
               leg_us(profile, axis, distance_counts + run_up(&profile->lens.axis[axis])) +
           (uint64_t)LENS_MOVE_TRIMS * LEGS_PER_APPROACH * leg_us(profile, axis, beside);
}

static int send(struct rig *self, const struct mover *mover) {
    const struct lens_drive *drive = &mover->lens->drive;
    const uint64_t deadline_us = rig_now_us(self) + COMMAND_US;
    const int error = lens_go(drive, mover->axis, mover->command, deadline_us);
    if (error != ERROR_OK) {
        rig_part_used(self, lens_read_part(mover->side), error);
        return rig_part_failed(self, lens_read_part(mover->side), error,
                               "the move command cannot be sent (check the serial line)");
    }
    mover->lens->commanded[mover->axis] = mover->target;
    return ERROR_OK;
}

// ---- legs

static int begin_leg(struct rig *self, struct mover *mover, int32_t goal) {
    const int32_t wanted = goal + mover->lens->offset[mover->axis];
    mover->goal = goal;
    mover->begin = mover->middle;
    mover->command = within(wanted, mover->settings->min, mover->settings->max);
    mover->count = mover->since_mark = mover->settled = 0;
    mover->sent = 1;
    mover->mark = mover->begin;
    mover->since_us = mover->mark_us = rig_now_us(self);
    mover->deadline_us =
        mover->since_us + leg_us(&self->profile, mover->axis, distance(mover->begin, goal));
    return send(self, mover);
}

// Starts towards the waypoint.
static int begin_approach(struct rig *self, struct mover *mover) {
    mover->phase = GOING_BACK;
    mover->been_back = true;
    return begin_leg(self, mover, mover->waypoint);
}

// It is already at its target, approached from below.
static bool there(const struct mover *mover) {
    return mover->lens->commanded[mover->axis] == mover->target &&
           distance(mover->middle, mover->target) <= mover->settings->tolerance_counts;
}

static int start(struct rig *self, struct mover *mover) {
    if (there(mover)) {
        mover->phase = ARRIVED;
        return ERROR_OK;
    }
    const int32_t down = mover->middle > mover->waypoint ? mover->middle - mover->waypoint : 0;
    const int32_t up = distance(down > 0 ? mover->waypoint : mover->middle, mover->target);
    mover->path = (uint32_t)(down + up);
    if (down > 0 && mover->waypoint < mover->target) {
        return begin_approach(self, mover);
    }
    mover->phase = GOING_UP;
    return begin_leg(self, mover, mover->target);
}

static int jammed(struct rig *self, struct mover *mover) {
    static const char *const texts[LENS_AXES] = {
        "zoom is stuck at # and does not move to # (free the ring, then move it again)",
        "focus is stuck at # and does not move to # (free the ring, then move it again)",
        "iris is stuck at # and does not move to # (free the ring, then move it again)",
    };
    mover->lens->offset[mover->axis] = mover->offset_before;  // that was not drift
    rig_part_used(self, lens_read_part(mover->side), ERROR_JAMMED);
    return rig_part_error(self, lens_read_part(mover->side), ERROR_JAMMED, texts[mover->axis],
                          (const int32_t[]){mover->middle, mover->goal});
}

static int not_there(struct rig *self, struct mover *mover) {
    mover->lens->offset[mover->axis] = mover->offset_before;
    rig_part_used(self, lens_read_part(mover->side), ERROR_TIMEOUT);
    return rig_part_error(self, lens_read_part(mover->side), ERROR_TIMEOUT,
                          "it is at # and does not arrive at # in time (check the motor, and the "
                          "profile's speeds and tolerance)",
                          (const int32_t[]){mover->middle, mover->goal});
}

// Passed the waypoint. From above it goes below first, if there is room.
static int continue_up(struct rig *self, struct mover *mover) {
    if (mover->goal > mover->target && mover->low < mover->target) {
        return begin_leg(self, mover, mover->low);
    }
    mover->phase = GOING_UP;
    return begin_leg(self, mover, mover->target);
}

// Start far enough away to distinguish a jam from drift; without room below, start above.
static int begin_long_approach(struct rig *self, struct mover *mover) {
    const int32_t target = mover->target, middle = mover->middle;
    const int32_t run = run_up(mover->settings) + LENS_MOVE_OFFSET_COUNTS;
    const int32_t below = (middle < target ? middle : target) - run;
    const int32_t above = (middle > target ? middle : target) + run;
    mover->waypoint = below >= mover->settings->min ? below : above;
    mover->far = true;
    return begin_approach(self, mover);
}

// It moved, and stopped off the target: approach again, corrected by the error.
static int update_offset(struct rig *self, struct mover *mover) {
    const int32_t beside = mover->middle - mover->target;
    const int32_t tolerance = mover->settings->tolerance_counts;
    int32_t *offset = &mover->lens->offset[mover->axis];
    const int32_t wanted =
        within(*offset - beside, -LENS_MOVE_OFFSET_COUNTS, LENS_MOVE_OFFSET_COUNTS);
    const int32_t command =
        within(mover->target + wanted, mover->settings->min, mover->settings->max);
    const bool at_end = command == mover->command;
    const bool again = mover->rest_position != INT32_MIN &&
                       distance(mover->rest_position, mover->middle) <= tolerance;
    if (at_end && again) {
        mover->lens->stopped_at_us = mover->mark_us;
        mover->phase = ARRIVED;
        return ERROR_OK;
    }
    if (mover->trims == LENS_MOVE_TRIMS) {
        return not_there(self, mover);
    }
    mover->trims++;
    mover->rest_position = mover->middle;
    *offset = at_end ? *offset : wanted;
    return begin_long_approach(self, mover);
}

// One count at a time: more than typical noise, and less than the tolerance.
static void follow_drift(const struct mover *mover) {
    enum { NOISE_COUNTS = 2 };
    const int32_t beside = mover->middle - mover->target;
    int32_t *offset = &mover->lens->offset[mover->axis];
    const int32_t step = beside >= NOISE_COUNTS ? -1 : beside <= -NOISE_COUNTS ? 1 : 0;
    *offset = within(*offset + step, -LENS_MOVE_OFFSET_COUNTS, LENS_MOVE_OFFSET_COUNTS);
}

// No movement for too long.
static int stalled(struct rig *self, struct mover *mover) {
    const int32_t left = distance(mover->middle, mover->goal);
    const int32_t way = distance(mover->begin, mover->goal);
    const int32_t moved = distance(mover->middle, mover->begin);
    const int32_t tolerance = mover->settings->tolerance_counts;
    const bool back = mover->phase == GOING_BACK;
    if (left > LENS_MOVE_OFFSET_COUNTS + (mover->far ? LENS_MOVE_OFFSET_COUNTS : 0)) {
        return jammed(self, mover);
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

static int assess(struct rig *self, struct mover *mover) {
    const uint64_t now_us = rig_now_us(self);
    const uint64_t still_us = now_us - mover->mark_us;
    const uint64_t stall_us = lens_move_stall_us(&self->profile, mover->axis);
    if (mover->settled >= LENS_MOVE_SETTLED_READINGS) {
        if (mover->phase == GOING_BACK) {
            return continue_up(self, mover);
        }
        follow_drift(mover);
        mover->lens->stopped_at_us = now_us;
        mover->phase = ARRIVED;
        return ERROR_OK;
    }
    if (still_us >= stall_us && mover->since_mark >= LENS_MOVE_STALL_READINGS) {
        return stalled(self, mover);
    }
    if (now_us >= mover->deadline_us && mover->count >= LEG_READINGS) {
        return not_there(self, mover);
    }
    const bool begun = distance(mover->middle, mover->begin) > mover->settings->tolerance_counts;
    if (!begun && still_us >= mover->sent * stall_us / LENS_MOVE_COMMANDS) {
        mover->sent++;  // the previous one may have been lost
        return send(self, mover);
    }
    return ERROR_OK;
}

static void record_way(struct mover *mover) {
    const bool back = mover->phase == GOING_BACK;
    const int32_t ahead = back ? distance(mover->target, mover->waypoint) : 0;
    const uint32_t left = (uint32_t)(distance(mover->middle, mover->goal) + ahead);
    const uint32_t done = left < mover->path ? mover->path - left : 0;
    mover->done = done > mover->done ? done : mover->done;
}

// Records a reading of this leg.
static int take(struct rig *self, struct mover *mover, int32_t position) {
    mover->readings[mover->count % LENS_READ_MEDIAN] = position;
    mover->count++;
    mover->since_mark++;
    if (mover->count < LENS_READ_MEDIAN) {
        return ERROR_OK;
    }
    mover->middle = lens_read_median(mover->readings);
    if (mover->phase == STARTING) {
        return start(self, mover);
    }
    const int32_t left = distance(mover->middle, mover->goal);
    const bool past =
        mover->goal < mover->begin ? mover->middle < mover->goal : mover->middle > mover->goal;
    const bool there_now = left <= mover->settings->tolerance_counts ||
                           (mover->phase == GOING_BACK && past);  // beyond is also fine
    mover->settled = there_now ? mover->settled + 1 : 0;
    if (distance(mover->middle, mover->mark) >= LENS_MOVE_STEP_COUNTS) {
        mover->mark = mover->middle;
        mover->mark_us = rig_now_us(self);
        mover->since_mark = 0;
    }
    record_way(mover);
    // Two outliers among the first three readings can hide that it was above.
    const bool above = mover->middle > mover->target + mover->settings->tolerance_counts;
    if (above && !mover->been_back && mover->waypoint < mover->target) {
        return begin_approach(self, mover);
    }
    return assess(self, mover);
}

// Waits for one reading of a lens and records it.
static int look_at(struct rig *self, struct mover *mover, uint64_t deadline_us) {
    const uint64_t begin_us = rig_now_us(self);
    for (;;) {
        int error = rig_poll(self);
        if (error != ERROR_OK) {
            return error;
        }
        struct lens_reading readings[LENS_AXES];
        error = lens_read_try(self, mover->side, mover->since_us, readings);
        if (error == ERROR_OK) {
            return take(self, mover, readings[mover->axis].position);
        }
        if (error != ERROR_TIMEOUT) {
            return error;
        }
        const uint64_t now_us = rig_now_us(self);
        error = lens_read_timeout(self, mover->side, begin_us, now_us);
        if (error != ERROR_OK) {
            return error;
        }
        if (now_us >= deadline_us) {
            return not_there(self, mover);
        }
    }
}

// ---- stopping

// Takes a reading while stopping, which cannot be cancelled; false: none came.
static bool read_resting(struct rig *self, const struct mover *mover, uint64_t deadline_us,
                         int32_t *position) {
    const uint64_t since_us = rig_now_us(self);
    mover->lens->stopped_at_us = since_us;  // not earlier, as far as known
    struct lens_reading readings[LENS_AXES];
    int error = ERROR_TIMEOUT;
    while (error == ERROR_TIMEOUT && rig_now_us(self) + RIG_POLL_US < deadline_us) {
        (void)rig_watchdog_feed(self);  // motor first
        error = lens_read_try(self, mover->side, since_us, readings);
    }
    if (error == ERROR_OK) {
        *position = readings[mover->axis].position;
    }
    return error == ERROR_OK;
}

// Stops a motor, or sends it to its present position, of which two of three new readings may be
// outliers.
static void halt(struct rig *self, const struct mover *mover, uint64_t deadline_us) {
    const struct lens_drive *lens = &mover->lens->drive;
    mover->lens->commanded[mover->axis] = INT32_MIN;
    const uint64_t stopped_us = rig_now_us(self) + COMMAND_US;
    if (lens_stop(lens, stopped_us) == ERROR_OK) {
        return;
    }
    int32_t readings[LENS_READ_MEDIAN];
    for (unsigned i = 0; i < LENS_READ_MEDIAN; i++) {
        if (!read_resting(self, mover, deadline_us, &readings[i])) {
            return;  // it continues to its target, and stops there
        }
    }
    const int32_t seen = mover->middle;
    const int32_t two = lens_read_median((const int32_t[]){readings[0], readings[1], seen});
    const int32_t all = lens_read_median((const int32_t[]){two, readings[2], seen});
    const int32_t offset = mover->lens->offset[mover->axis];
    const int32_t at = within(all + offset, mover->settings->min, mover->settings->max);
    const uint64_t sent_us = rig_now_us(self) + COMMAND_US;
    (void)lens_go(lens, mover->axis, at, sent_us);
}

// Waits until a motor has stopped: until readings repeat, which they do not while it moves.
static void wait_for_rest(struct rig *self, const struct mover *mover, uint64_t deadline_us) {
    int32_t first = 0, now = 0;
    for (unsigned alike = 0; alike < LENS_READ_MEDIAN;) {
        if (!read_resting(self, mover, deadline_us, &now)) {
            return;
        }
        const bool same = alike > 0 && distance(first, now) <= mover->settings->tolerance_counts;
        alike = same ? alike + 1 : 1;
        first = same ? first : now;
    }
}

// The first error is reported.
static void bring_to_rest(struct rig *self, const struct mover *movers, unsigned count) {
    const struct rig_error last_error = self->last_error;
    const uint64_t begin_us = rig_now_us(self);
    for (unsigned i = 0; i < count; i++) {
        if (movers[i].phase == GOING_BACK || movers[i].phase == GOING_UP) {
            halt(self, &movers[i], begin_us + (i + 1) * HALT_US);
        }
    }
    // A motor takes a moment to reverse, and is at rest meanwhile.
    for (const uint64_t end_us = rig_now_us(self) + TURN_US; rig_now_us(self) < end_us;) {
        const struct hal_clock *clock = self->ports.clock;
        (void)rig_watchdog_feed(self);
        clock->operations->wait_until_us(clock->self, rig_now_us(self) + RIG_POLL_US);
    }
    for (unsigned i = 0; i < count; i++) {
        if (movers[i].phase == GOING_BACK || movers[i].phase == GOING_UP) {
            wait_for_rest(self, &movers[i], begin_us + LENS_MOVE_REST_US);
        }
    }
    self->last_error = last_error;
}

static void report_progress(struct rig *self, const struct mover *movers, unsigned count) {
    uint32_t done = 0, path = 0;
    for (unsigned i = 0; i < count; i++) {
        if (movers[i].phase == STARTING) {
            return;
        }
        done += movers[i].phase == ARRIVED ? movers[i].path : movers[i].done;
        path += movers[i].path;
    }
    if (self->observer.progress != NULL && path > 0) {
        self->observer.progress(self->observer.self, lens_axis_names[movers[0].axis], done, path);
    }
}

static bool all_arrived(const struct mover *movers, unsigned count) {
    unsigned arrived = 0;
    for (unsigned i = 0; i < count; i++) {
        arrived += movers[i].phase == ARRIVED ? 1 : 0;
    }
    return arrived == count;
}

// Polls the lenses in turn until all have arrived.
static int follow(struct rig *self, struct mover *movers, unsigned count) {
    const int32_t furthest = movers[0].settings->max - movers[0].settings->min;
    const uint64_t end_us = rig_now_us(self) +
                            lens_move_limit_us(&self->profile, movers[0].axis, furthest) -
                            LENS_MOVE_REST_US;
    int error = ERROR_OK;
    while (error == ERROR_OK && !all_arrived(movers, count)) {
        for (unsigned i = 0; i < count && error == ERROR_OK; i++) {
            if (movers[i].phase != ARRIVED) {
                error = look_at(self, &movers[i], end_us);
            }
        }
        report_progress(self, movers, count);
    }
    return error;
}

int rig_lens_move_to(struct rig *self, unsigned sides, enum lens_axis axis, int32_t position) {
    int error = (unsigned)axis < LENS_AXES
                    ? lens_read_ready(self, sides, axis)
                    : rig_part_error(self, RIG_PART_NONE, ERROR_ARGUMENT,
                                     "no such axis (expected zoom, focus or iris)", NULL);
    struct mover movers[RIG_SIDES];
    unsigned count = 0;
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        if ((sides & 1u << side) == 0) {
            continue;
        }
        struct mover *mover = &movers[count++];
        struct rig_lens *lens = &self->camera[side].lens;
        const struct lens_axis_settings *settings = &self->profile.lens.axis[axis];
        *mover = (struct mover){
            .side = side, .lens = lens, .axis = axis, .settings = settings, .phase = STARTING};
        if (position < settings->min || position > settings->max) {
            error = rig_part_error(self, lens_read_part(side), ERROR_RANGE,
                                   "position # is outside # to #",
                                   (const int32_t[]){position, settings->min, settings->max});
        }
        const int32_t below = position - run_up(mover->settings);
        mover->target = position;
        mover->low = mover->waypoint = below > settings->min ? below : settings->min;
        mover->rest_position = INT32_MIN;
        mover->offset_before = self->camera[side].lens.offset[axis];
        mover->since_us = rig_now_us(self);
    }
    if (error != ERROR_OK) {
        return error;
    }
    error = follow(self, movers, count);
    if (error != ERROR_OK) {
        bring_to_rest(self, movers, count);
    }
    return rig_end(self, error);
}
