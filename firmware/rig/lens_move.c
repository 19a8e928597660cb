// SPDX-License-Identifier: Apache-2.0
#include "rig/lens_move.h"

#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/poll.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"
#include "rig/base/watchdog.h"
#include "rig/safe.h"

enum {
    COMMAND_US = 100000,  // a command has been sent by then
    HALT_US = 500000,     // longest time for a reading
    TURN_US = 200000,
    PAUSE_US = 200000,  // a longer one between steps does not count
};

static uint8_t bit_of(const struct lens_mover *mover) {
    return (uint8_t)(1u << mover->axis);
}

static const struct lens_abilities *abilities_of(const struct lens_mover *mover) {
    INVARIANT(mover->lens->drive.controller != NULL);
    return &mover->lens->drive.controller->driver->abilities;
}

// ---- the way to rest, which cannot be cancelled

// The turn of the next mover that needs it, from `first` on; `count` if none does.
static void take_turn(struct rig *self, struct rig_lens_move *move, unsigned first) {
    move->turn = first;
    while (move->turn < move->count && !lens_mover_is_under_way(&move->movers[move->turn])) {
        move->turn++;
    }
    move->alike = 0;
    move->asked_us = rig_now_us(self);
}

static int end_move(struct rig *self, struct rig_lens_move *move) {
    const int error = move->error;
    for (unsigned i = 0; i < move->count; i++) {
        struct rig_lens *lens = move->movers[i].lens;
        lens->moving = (uint8_t)(lens->moving & ~bit_of(&move->movers[i]));
    }
    move->phase = LENS_MOVE_DONE;
    if (error != ERROR_OK) {
        self->last_error = move->reason;
    }
    return error == ERROR_OK ? ERROR_OK : rig_end(self, error);
}

static int turn_to_rest(struct rig *self, struct rig_lens_move *move) {
    take_turn(self, move, 0);
    move->phase = LENS_MOVE_RESTING;
    return move->turn == move->count ? end_move(self, move) : ERROR_OK;
}

// The next motor to stop, or the wait for all of them.
static void stop_next(struct rig *self, struct rig_lens_move *move, unsigned first) {
    for (take_turn(self, move, first); move->turn < move->count;
         take_turn(self, move, move->turn + 1)) {
        struct lens_mover *mover = &move->movers[move->turn];
        mover->lens->commanded[mover->axis] = INT32_MIN;
        if (lens_stop(&mover->lens->drive, rig_now_us(self) + COMMAND_US) != ERROR_OK &&
            abilities_of(mover)->reads_position) {
            return;  // step_stopping sends the motor to its present position
        }
    }
    move->phase = LENS_MOVE_TURNING;
    move->asked_us = rig_now_us(self);
}

// The first error is reported, at rest.
static void begin_stop(struct rig *self, struct rig_lens_move *move, int error) {
    INVARIANT(move->phase == LENS_MOVE_GOING && error != ERROR_OK);
    move->error = error;
    move->reason = self->last_error;
    move->phase = LENS_MOVE_STOPPING;
    move->stop_us = rig_now_us(self);
    stop_next(self, move, 0);
}

enum resting { RESTING_NOT_YET, RESTING_READ, RESTING_GIVEN_UP };

// Takes a reading of the mover whose turn it is.
static enum resting read_resting(struct rig *self, struct rig_lens_move *move, uint64_t deadline_us,
                                 uint64_t until_us, struct lens_reading *reading) {
    const struct lens_mover *mover = &move->movers[move->turn];
    struct lens_reading readings[LENS_AXES];
    mover->lens->stopped_at_us = move->asked_us;  // not earlier, as far as known
    if (rig_now_us(self) + RIG_POLL_US >= deadline_us) {
        return RESTING_GIVEN_UP;
    }
    (void)rig_watchdog_feed(self);  // motor first
    const int error = lens_read_try(self, mover->side, move->asked_us, until_us, readings);
    if (error == ERROR_TIMEOUT) {
        return RESTING_NOT_YET;
    }
    move->asked_us = rig_now_us(self);
    *reading = readings[mover->axis];
    return error == ERROR_OK ? RESTING_READ : RESTING_GIVEN_UP;
}

// Sends a motor to where three readings see it. If none come, it continues to its target, and stops
// there.
static void step_stopping(struct rig *self, struct rig_lens_move *move, uint64_t until_us) {
    const uint64_t reading_us = move->asked_us + HALT_US;
    const uint64_t all_us = move->stop_us + LENS_MOVE_REST_US - TURN_US;
    const uint64_t deadline_us = reading_us < all_us ? reading_us : all_us;
    struct lens_reading reading;
    switch (read_resting(self, move, deadline_us, until_us, &reading)) {
        case RESTING_NOT_YET:
            return;
        case RESTING_READ:
            move->readings[move->alike++] = reading.position;
            if (move->alike < LENS_READ_MEDIAN) {
                return;
            }
            lens_mover_hold(self, &move->movers[move->turn], move->readings);
            break;
        case RESTING_GIVEN_UP:
            break;
    }
    stop_next(self, move, move->turn + 1);
}

// A motor takes a moment to reverse, and is at rest meanwhile.
static int step_turning(struct rig *self, struct rig_lens_move *move, uint64_t until_us) {
    const struct hal_clock *clock = self->ports.clock;
    const uint64_t now_us = rig_now_us(self), end_us = move->asked_us + TURN_US;
    (void)rig_watchdog_feed(self);
    if (now_us >= end_us) {
        return turn_to_rest(self, move);
    }
    const uint64_t poll_us = now_us + RIG_POLL_US;
    if (until_us > now_us) {
        clock->operations->wait_until_us(clock->self, until_us < poll_us ? until_us : poll_us);
    }
    return ERROR_OK;
}

// A motor that cannot be stopped ends its leg.
static uint64_t rest_deadline_us(const struct rig_lens_move *move) {
    const struct lens_mover *mover = &move->movers[move->turn];
    const bool ends_its_leg = abilities_of(mover)->reports_moving && !abilities_of(mover)->stops;
    const uint64_t rest_us = move->stop_us + LENS_MOVE_REST_US;
    return ends_its_leg && mover->deadline_us > rest_us ? mover->deadline_us : rest_us;
}

// Whether readings repeat, which they do not while the motor moves.
static bool is_at_rest(struct rig_lens_move *move, const struct lens_reading *reading) {
    const int32_t way = reading->position - move->readings[0];
    const int32_t tolerance = move->movers[move->turn].settings->tolerance_counts;
    const bool same = move->alike > 0 && -tolerance <= way && way <= tolerance;
    move->alike = same ? move->alike + 1 : 1;
    if (reading->moving) {
        move->alike = 0;
    }
    move->readings[0] = same ? move->readings[0] : reading->position;
    return move->alike == LENS_READ_MEDIAN;
}

static int step_resting(struct rig *self, struct rig_lens_move *move, uint64_t until_us) {
    struct lens_reading reading;
    const enum resting resting =
        read_resting(self, move, rest_deadline_us(move), until_us, &reading);
    if (resting == RESTING_NOT_YET || (resting == RESTING_READ && !is_at_rest(move, &reading))) {
        return ERROR_OK;
    }
    if (resting == RESTING_READ) {
        const struct lens_mover *mover = &move->movers[move->turn];
        mover->lens->rest_us[mover->axis] = reading.time_us;
    }
    take_turn(self, move, move->turn + 1);
    return move->turn == move->count ? end_move(self, move) : ERROR_OK;
}

// ---- the move

static void report_progress(struct rig *self, const struct rig_lens_move *move) {
    uint32_t done = 0, path = 0;
    for (unsigned i = 0; i < move->count; i++) {
        const struct lens_mover *mover = &move->movers[i];
        if (mover->phase == LENS_MOVER_STARTING) {
            return;
        }
        done += mover->phase == LENS_MOVER_ARRIVED ? mover->path : mover->done;
        path += mover->path;
    }
    if (self->observer.progress != NULL && path > 0) {
        self->observer.progress(self->observer.self, lens_axis_names[move->movers[0].axis], done,
                                path);
    }
}

// The line should not be idle until the next step. But both lenses share it: if the other one has a
// move of its own, it comes first.
static int ask_now(struct rig *self, const struct lens_mover *mover, unsigned last_side) {
    struct lens_reading readings[LENS_AXES];
    if (mover->side == last_side && self->camera[RIG_RIGHT - last_side].lens.moving != 0) {
        return ERROR_OK;
    }
    const int error = lens_read_try(self, mover->side, mover->since_us, 0, readings);
    return error == ERROR_TIMEOUT ? ERROR_OK : error;
}

// The lenses are read in turn until all have arrived.
static int next_turn(struct rig *self, struct rig_lens_move *move) {
    const unsigned last_side = move->movers[move->turn].side;
    move->asked_us = rig_now_us(self);
    for (unsigned i = 1; i <= move->count; i++) {
        const unsigned next = (move->turn + i) % move->count;
        if (move->turn + i == move->count) {
            report_progress(self, move);
        }
        if (move->movers[next].phase != LENS_MOVER_ARRIVED) {
            move->turn = next;
            return ask_now(self, &move->movers[next], last_side);
        }
    }
    return end_move(self, move);
}

// Whether a reading that has not come may still come.
static int check_time(struct rig *self, struct rig_lens_move *move) {
    struct lens_mover *mover = &move->movers[move->turn];
    const uint64_t now_us = rig_now_us(self);
    const int error = lens_read_timeout(self, mover->side, move->asked_us, now_us);
    return error == ERROR_OK && now_us >= move->deadline_us ? lens_mover_late(self, mover) : error;
}

// The time limits are for moves that are stepped.
static void allow_pause(struct rig *self, struct rig_lens_move *move, uint64_t pause_us) {
    move->asked_us = rig_now_us(self);
    move->deadline_us += pause_us;
    for (unsigned i = 0; i < move->count; i++) {
        move->movers[i].deadline_us += pause_us;
    }
}

static int step_going(struct rig *self, struct rig_lens_move *move, uint64_t until_us) {
    struct lens_mover *mover = &move->movers[move->turn];
    struct lens_reading readings[LENS_AXES];
    int error = rig_poll(self);
    if (error == ERROR_OK && self->state != RIG_READY) {
        error = ERROR_NOT_READY;  // the last error says why
    }
    const uint64_t pause_us = rig_now_us(self) - move->stepped_us;
    if (pause_us > PAUSE_US) {
        allow_pause(self, move, pause_us);
    }
    if (error == ERROR_OK) {
        error = lens_read_try(self, mover->side, mover->since_us, until_us, readings);
        if (error == ERROR_TIMEOUT) {
            error = check_time(self, move);
        } else if (error == ERROR_OK) {
            error = lens_mover_take(self, mover, &readings[mover->axis]);
            error = error == ERROR_OK ? next_turn(self, move) : error;
        }
    }
    if (error != ERROR_OK) {
        begin_stop(self, move, error);
    }
    move->stepped_us = rig_now_us(self);
    return ERROR_OK;
}

// A bring-up takes the axes away.
static bool has_axes(const struct rig_lens_move *move) {
    for (unsigned i = 0; i < move->count; i++) {
        if ((move->movers[i].lens->moving & bit_of(&move->movers[i])) == 0) {
            return false;
        }
    }
    return true;
}

int rig_lens_move_step(struct rig *self, struct rig_lens_move *move, uint64_t until_us) {
    INVARIANT(move->count <= RIG_SIDES);
    INVARIANT(move->phase == LENS_MOVE_DONE || move->phase == LENS_MOVE_TURNING ||
              move->turn < move->count);
    if (move->phase != LENS_MOVE_DONE && !has_axes(move)) {
        move->phase = LENS_MOVE_DONE;
        return rig_part_error(self, rig_part_of(RIG_PART_LEFT_LENS, move->movers[0].side),
                              ERROR_NOT_READY, "the rig was brought up again during a move", NULL);
    }
    switch (move->phase) {
        case LENS_MOVE_GOING:
            return step_going(self, move, until_us);
        case LENS_MOVE_STOPPING:
            step_stopping(self, move, until_us);
            return ERROR_OK;
        case LENS_MOVE_TURNING:
            return step_turning(self, move, until_us);
        case LENS_MOVE_RESTING:
            return step_resting(self, move, until_us);
        case LENS_MOVE_DONE:
            break;
    }
    return ERROR_OK;
}

void rig_lens_move_cancel(struct rig *self, struct rig_lens_move *move) {
    if (move->phase == LENS_MOVE_GOING) {
        begin_stop(self, move, ERROR_CANCELLED);
    }
}

bool rig_lens_move_done(const struct rig_lens_move *move) {
    return move->phase == LENS_MOVE_DONE;
}

// Whether an axis of a lens can be sent to a position now.
static int check_target(struct rig *self, unsigned side, enum lens_axis axis, int32_t position) {
    const struct lens_axis_settings *settings = &self->profile.lens.axis[axis];
    if (position < settings->min || position > settings->max) {
        return rig_part_error(self, rig_part_of(RIG_PART_LEFT_LENS, side), ERROR_RANGE,
                              "position # is outside # to #",
                              (const int32_t[]){position, settings->min, settings->max});
    }
    if ((self->camera[side].lens.moving >> axis & 1) != 0) {
        return rig_part_error(self, rig_part_of(RIG_PART_LEFT_LENS, side), ERROR_NOT_READY,
                              "another move of this axis is under way", NULL);
    }
    return ERROR_OK;
}

static int begin_move(struct rig *self, struct rig_lens_move *move, unsigned sides,
                      enum lens_axis axis, const int32_t positions[RIG_SIDES],
                      enum rig_lens_move_when when) {
    *move = (struct rig_lens_move){.phase = LENS_MOVE_DONE};
    int error = (unsigned)axis < LENS_AXES
                    ? lens_read_ready(self, sides, axis)
                    : rig_part_error(self, RIG_PART_NONE, ERROR_ARGUMENT,
                                     "no such axis (expected zoom, focus or iris)", NULL);
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        error =
            (sides >> side & 1) != 0 ? check_target(self, side, axis, positions[side]) : ERROR_OK;
    }
    if (error != ERROR_OK) {
        return error;
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        if ((sides >> side & 1) != 0) {
            struct lens_mover *mover = &move->movers[move->count++];
            lens_mover_init(self, mover, side, axis, positions[side]);
            mover->forced = when != LENS_MOVE_IF_NEEDED;
            mover->coarse = when == LENS_MOVE_COARSE;
            mover->lens->moving = (uint8_t)(mover->lens->moving | bit_of(mover));
        }
    }
    INVARIANT(move->count > 0);
    const struct lens_axis_settings *settings = &self->profile.lens.axis[axis];
    move->phase = LENS_MOVE_GOING;
    move->asked_us = move->stepped_us = rig_now_us(self);
    move->deadline_us = move->asked_us +
                        lens_move_limit_us(&self->profile, axis, settings->max - settings->min) -
                        LENS_MOVE_REST_US;
    return ERROR_OK;
}

int rig_lens_move_begin(struct rig *self, struct rig_lens_move *move, unsigned sides,
                        enum lens_axis axis, int32_t position, enum rig_lens_move_when when) {
    return begin_move(self, move, sides, axis, (const int32_t[RIG_SIDES]){position, position},
                      when);
}

int rig_lens_move_each(struct rig *self, unsigned sides, enum lens_axis axis,
                       const int32_t positions[RIG_SIDES]) {
    struct rig_lens_move move;
    int error = begin_move(self, &move, sides, axis, positions, LENS_MOVE_IF_NEEDED);
    while (error == ERROR_OK && !rig_lens_move_done(&move)) {
        error = rig_lens_move_step(self, &move, rig_now_us(self) + RIG_POLL_US);
    }
    return error;
}

int rig_lens_move_to(struct rig *self, unsigned sides, enum lens_axis axis, int32_t position) {
    return rig_lens_move_each(self, sides, axis, (const int32_t[RIG_SIDES]){position, position});
}
