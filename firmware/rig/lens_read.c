// SPDX-License-Identifier: Apache-2.0
#include "rig/lens_read.h"

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "focus/position_fit.h"
#include "rig/base/health.h"
#include "rig/base/poll.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"
#include "rig/safe.h"

enum { BOTH = 1u << RIG_LEFT | 1u << RIG_RIGHT };

int32_t lens_read_median(const int32_t values[LENS_READ_MEDIAN]) {
    const int32_t a = values[0], b = values[1], c = values[2];
    const int32_t min = a < b ? a : b, max = a < b ? b : a;
    return math_clamp_int(c, min, max);
}

int lens_read_ready(struct rig *self, unsigned sides, enum lens_axis axis) {
    if (sides == 0 || (sides & ~(unsigned)BOTH) != 0 || (unsigned)axis > LENS_AXES) {
        return rig_part_error(self, RIG_PART_NONE, ERROR_ARGUMENT, "no such lens or axis", NULL);
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        if ((sides & 1u << side) == 0) {
            continue;
        }
        if (!rig_has_lens(&self->profile, side)) {
            return rig_part_error(self, rig_part_of(RIG_PART_LEFT_LENS, side), ERROR_NOT_CONNECTED,
                                  "the profile has no motorized lens there", NULL);
        }
        if (self->state != RIG_READY) {
            return rig_part_error(self, rig_part_of(RIG_PART_LEFT_LENS, side), ERROR_NOT_READY,
                                  "the rig is not up (run bringup)", NULL);
        }
        if (axis < LENS_AXES && !rig_has_axis(&self->profile, side, axis)) {
            return rig_part_error(self, rig_part_of(RIG_PART_LEFT_LENS, side), ERROR_NOT_CONNECTED,
                                  "its controller does not support this axis", NULL);
        }
    }
    return ERROR_OK;
}

static void copy(struct lens_reading *to, const struct lens_reading *from) {
    for (unsigned axis = 0; axis < LENS_AXES; axis++) {
        to[axis] = from[axis];
    }
}

// Keeps a reading for positions at earlier times.
static void keep(struct rig_lens *lens, const struct lens_reading readings[LENS_AXES]) {
    if (readings[0].sampled_us == 0) {
        return;
    }
    struct rig_lens_track *track = &lens->track[lens->tracked++ % RIG_LENS_TRACK];
    track->sampled_us = readings[0].sampled_us;
    for (unsigned axis = 0; axis < LENS_AXES; axis++) {
        track->position[axis] = readings[axis].position;
    }
}

int lens_read_try(struct rig *self, unsigned side, uint64_t since_us, uint64_t until_us,
                  struct lens_reading readings[LENS_AXES]) {
    struct rig_lens *lens = &self->camera[side].lens;
    const uint64_t last_us = lens->readings[0].time_us;
    if (last_us != 0 && last_us >= since_us) {  // another move of this lens has read it
        copy(readings, lens->readings);
        return ERROR_OK;
    }
    const int error = lens_read(&lens->drive, until_us, readings);
    if (error == ERROR_TIMEOUT) {
        return error;
    }
    rig_part_used(self, rig_part_of(RIG_PART_LEFT_LENS, side), error);
    if (error != ERROR_OK) {
        return rig_part_failed(self, rig_part_of(RIG_PART_LEFT_LENS, side), error,
                               "the line to its controller failed (check adapter and cable)");
    }
    copy(lens->readings, readings);
    keep(lens, readings);
    return readings[0].time_us >= since_us ? ERROR_OK : ERROR_TIMEOUT;
}

int lens_read_timeout(struct rig *self, unsigned side, uint64_t since_us, uint64_t now_us) {
    const uint64_t last_rx_us = lens_last_rx(&self->camera[side].lens.drive);
    const bool silent =
        now_us - (last_rx_us > since_us ? last_rx_us : since_us) >= LENS_READ_SILENCE_US;
    if (!silent && now_us - since_us < LENS_READ_INVALID_US) {
        return ERROR_OK;
    }
    rig_part_used(self, rig_part_of(RIG_PART_LEFT_LENS, side), ERROR_TIMEOUT);
    return rig_part_error(
        self, rig_part_of(RIG_PART_LEFT_LENS, side), ERROR_TIMEOUT,
        silent ? "no reply for # ms (check the controller's supply and its line)"
               : "no valid reply for # ms (check the controller's supply and its line)",
        (const int32_t[]){(silent ? LENS_READ_SILENCE_US : LENS_READ_INVALID_US) / 1000});
}

// Requests readings from now on.
static int read_now(struct rig *self, unsigned side, struct lens_reading readings[LENS_AXES]) {
    const uint64_t since_us = rig_now_us(self);
    for (;;) {
        int error = lens_read_try(self, side, since_us, rig_now_us(self) + RIG_POLL_US, readings);
        if (error != ERROR_TIMEOUT) {
            return error;
        }
        error = lens_read_timeout(self, side, since_us, rig_now_us(self));
        if (error != ERROR_OK) {
            return error;
        }
        error = rig_poll(self);
        if (error != ERROR_OK) {
            return error;
        }
    }
}

int rig_lens_read_mean(struct rig *self, unsigned side, unsigned readings,
                       struct lens_mean means[LENS_AXES]) {
    struct position_sample samples[LENS_AXES][POSITION_FIT_MAX];
    INVARIANT(readings > 0 && readings <= POSITION_FIT_MAX);
    int error = lens_read_ready(self, side < RIG_SIDES ? 1u << side : 0, LENS_AXES);
    for (unsigned i = 0; i < readings && error == ERROR_OK; i++) {
        struct lens_reading reading[LENS_AXES];
        error = read_now(self, side, reading);
        for (unsigned axis = 0; axis < LENS_AXES && error == ERROR_OK; axis++) {
            samples[axis][i] =
                (struct position_sample){reading[axis].sampled_us, reading[axis].position};
        }
        error = error == ERROR_OK ? rig_poll(self) : error;
    }
    for (unsigned axis = 0; axis < LENS_AXES && error == ERROR_OK; axis++) {
        means[axis] = (struct lens_mean){INT32_MIN, 0};
        if (rig_has_axis(&self->profile, side, (enum lens_axis)axis)) {
            position_fit_mean(samples[axis], readings, &means[axis].position_q4,
                              &means[axis].sigma_q4);
        }
        self->camera[side].lens.measured[axis] = means[axis];
    }
    return rig_end(self, error);
}

int32_t lens_mean_counts(const struct lens_mean *mean) {
    return mean->position_q4 == INT32_MIN ? INT32_MIN : position_fit_counts(mean->position_q4);
}

int rig_lens_read(struct rig *self, unsigned side, int32_t positions[LENS_AXES]) {
    struct lens_mean means[LENS_AXES];
    const int error = rig_lens_read_mean(self, side, RIG_LENS_READINGS, means);
    for (unsigned axis = 0; axis < LENS_AXES && error == ERROR_OK; axis++) {
        positions[axis] = lens_mean_counts(&means[axis]);
    }
    return error;
}

// The readings of an axis from `since_us` on, in the order of time; returns their number.
static unsigned track_of(const struct rig_lens *lens, enum lens_axis axis, uint64_t since_us,
                         struct position_sample samples[RIG_LENS_TRACK]) {
    unsigned count = 0;
    const uint32_t kept = lens->tracked < RIG_LENS_TRACK ? lens->tracked : RIG_LENS_TRACK;
    for (uint32_t i = lens->tracked - kept; i != lens->tracked; i++) {
        const struct rig_lens_track *track = &lens->track[i % RIG_LENS_TRACK];
        if (track->sampled_us >= since_us) {
            samples[count++] = (struct position_sample){track->sampled_us, track->position[axis]};
        }
    }
    return count;
}

int rig_lens_position_at(const struct rig *self, unsigned side, enum lens_axis axis,
                         uint64_t time_us, int32_t *position_q4, uint16_t *sigma_q4) {
    struct position_sample samples[RIG_LENS_TRACK];
    INVARIANT(side < RIG_SIDES && (unsigned)axis < LENS_AXES);
    _Static_assert((int)RIG_LENS_TRACK <= (int)POSITION_FIT_MAX, "a fit takes all readings");
    const struct rig_lens *lens = &self->camera[side].lens;
    if (!rig_has_axis(&self->profile, side, axis) || lens->drive.controller == NULL) {
        return ERROR_NOT_CONNECTED;
    }
    if (time_us < lens->rest_us[axis]) {
        return lens->drive.controller->driver->abilities.reads_position
                   ? position_fit_at(samples, track_of(lens, axis, 0, samples), time_us,
                                     position_q4, sigma_q4)
                   : ERROR_UNSUPPORTED;
    }
    const unsigned count = track_of(lens, axis, lens->rest_us[axis], samples);
    if (count == 0) {
        return ERROR_NOT_READY;
    }
    position_fit_mean(samples, count, position_q4, sigma_q4);
    return ERROR_OK;
}

int rig_lens_limits(struct rig *self, unsigned side, enum lens_axis axis,
                    struct lens_limits *limits) {
    if ((unsigned)axis >= LENS_AXES) {
        return ERROR_ARGUMENT;
    }
    const int error = lens_read_ready(self, side < RIG_SIDES ? 1u << side : 0, axis);
    if (error == ERROR_OK) {
        *limits = (struct lens_limits){self->profile.lens.axis[axis].min,
                                       self->profile.lens.axis[axis].max};
    }
    return error;
}
