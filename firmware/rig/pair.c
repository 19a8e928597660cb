// SPDX-License-Identifier: Apache-2.0
#include "rig/pair.h"

#include "core/error.h"
#include "core/invariant.h"
#include "focus/position_fit.h"
#include "rig/base/health.h"
#include "rig/base/poll.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"
#include "rig/pair_merge.h"
#include "rig/rig_camera.h"
#include "rig/safe.h"
#include "rig/trigger.h"
#include "stereo/image/image_change.h"

enum {
    PAIR_ATTEMPTS = 3,  // attempts if frames of cameras with their own ports are too far apart
    US_PER_MS = 1000,
};

static bool merges(const struct pair_options *options) {
    return options->average != 0 || options->bracket != 0;
}

static unsigned frames_of(const struct pair_options *options) {
    return options->check_static ? RIG_SIDES + 1 : RIG_SIDES;
}

static void report(const struct rig *rig, const struct pair_options *options, uint32_t done) {
    if (rig->observer.progress != NULL) {
        rig->observer.progress(rig->observer.self, "frames", done, frames_of(options));
    }
}

static int64_t skew_of(const struct pair_frame frames[RIG_SIDES]) {
    return (int64_t)(frames[RIG_RIGHT].begin_us - frames[RIG_LEFT].begin_us);
}

// One port: takes the right camera after the left one. The left frame should not end long before
// the right camera's settings are in force; otherwise a long exposure set earlier would separate
// the two.
static int take_in_turn(struct rig *rig, const struct pair_options *options,
                        struct pair_frame frames[RIG_SIDES]) {
    const uint64_t settled_at_us = rig->camera[RIG_RIGHT].settled_at_us;
    const uint64_t frame_us = rig_camera_frame_us(rig, RIG_LEFT), now_us = rig_now_us(rig);
    const uint64_t begin_us = settled_at_us > now_us + frame_us ? settled_at_us - frame_us : now_us;
    int error = pair_take_frame(rig, RIG_LEFT, begin_us, &frames[RIG_LEFT]);
    if (error != ERROR_OK) {
        return error;
    }
    report(rig, options, 1);
    return pair_take_frame(rig, RIG_RIGHT, frames[RIG_LEFT].end_us, &frames[RIG_RIGHT]);
}

// Cameras with their own ports run freely. The right frame nearest in time is wanted, which may
// begin half a frame before the left one.
static int take_nearest(struct rig *rig, const struct pair_options *options,
                        struct pair_frame frames[RIG_SIDES]) {
    struct pair_frame *left = &frames[RIG_LEFT], *right = &frames[RIG_RIGHT];
    // The actual frame period in this light is the time from one left frame to the next, whatever
    // the driver reports.
    int error = pair_take_frame(rig, RIG_LEFT, rig_now_us(rig), left);
    const uint64_t first_us = left->begin_us;
    const uint32_t first_sequence = left->sequence;
    // A driver buffers a few frames, and drops later ones when it is full. Drain the right camera
    // just before the left frame that counts, so that the next frames are kept.
    if (error == ERROR_OK) {
        error = pair_take_frame(rig, RIG_RIGHT, rig_now_us(rig), right);
    }
    if (error == ERROR_OK) {
        error = pair_take_frame(rig, RIG_LEFT, rig_now_us(rig), left);
    }
    if (error != ERROR_OK) {
        return error;
    }
    report(rig, options, 1);
    const uint32_t frames_on = left->sequence - first_sequence;
    const uint64_t half_us = (left->begin_us - first_us) / (frames_on != 0 ? frames_on : 1) / 2;
    return pair_take_frame(rig, RIG_RIGHT, left->begin_us > half_us ? left->begin_us - half_us : 0,
                           right);
}

static bool are_apart(const struct rig *rig, const struct pair_frame frames[RIG_SIDES]) {
    const int64_t skew_us = skew_of(frames);
    return (skew_us < 0 ? -skew_us : skew_us) > rig->profile.skew_limit_us;
}

// Takes both frames of one pulse. `faults`: of each frame.
static int take_pulse(struct rig *rig, struct pair_frame frames[RIG_SIDES],
                      uint32_t faults[RIG_SIDES]) {
    pair_release(frames);
    int error = trigger_fire(rig);
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        struct hal_camera_frame frame;
        error = trigger_take(rig, side, &frame);
        if (error == ERROR_OK) {
            faults[side] = frame.faults;
            error = pair_keep_frame(rig, side, &frame, &frames[side]);
        }
    }
    return error;
}

// The first side whose frame has faults; RIG_SIDES: both frames are good.
static unsigned damaged_side(const uint32_t faults[RIG_SIDES]) {
    unsigned side = RIG_LEFT;
    while (side < RIG_SIDES && faults[side] == 0) {
        side++;
    }
    return side;
}

// Triggered cameras: both frames begin with the same pulse. If one frame is missing or damaged, the
// other camera's frame of that pulse is dropped too.
static int take_triggered(struct rig *rig, const struct pair_options *options,
                          struct pair_frame frames[RIG_SIDES]) {
    int missed = 0, damaged = 0, apart = 0;
    for (;;) {
        uint32_t faults[RIG_SIDES] = {0, 0};
        const int error = take_pulse(rig, frames, faults);
        missed += error == ERROR_TIMEOUT;
        if (error != ERROR_OK && (error != ERROR_TIMEOUT || missed == TRIGGER_ATTEMPTS)) {
            return error;
        }
        const unsigned bad = damaged_side(faults);
        const bool whole = bad == RIG_SIDES;
        damaged = whole ? 0 : damaged + 1;
        if (damaged == PAIR_FRAME_ATTEMPTS) {
            return rig_camera_torn(rig, bad, faults[bad]);
        }
        if (error == ERROR_OK && whole) {
            apart++;
            if (apart == PAIR_ATTEMPTS || !are_apart(rig, frames)) {
                report(rig, options, 1);
                return ERROR_OK;
            }
        }
    }
}

static int take_both(struct rig *rig, const struct pair_options *options,
                     struct pair_frame frames[RIG_SIDES]) {
    if (rig->profile.bridge) {
        return take_in_turn(rig, options, frames);
    }
    if (rig->profile.trigger) {
        return take_triggered(rig, options, frames);
    }
    // A frame may have been lost, and cameras of different speeds coincide only at times.
    for (int attempt = 1;; attempt++) {
        const int error = take_nearest(rig, options, frames);
        if (error != ERROR_OK || attempt == PAIR_ATTEMPTS || !are_apart(rig, frames)) {
            return error;
        }
    }
}

// ---- camera axes

static int read_servo(struct rig *rig, unsigned side, uint16_t *pan_q4, bool *turning) {
    struct fpga_bridge_servo servo;
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_SERVO, side);
    const int error = rig_part_used(rig, part, fpga_bridge_servo_read(&rig->bridge, side, &servo));
    if (error != ERROR_OK) {
        return rig_bus_failed(rig, part, error);
    }
    *pan_q4 = servo.actual_q4;
    *turning = servo.actual_q4 != servo.target_q4;
    return ERROR_OK;
}

static int read_axes(struct rig *rig, unsigned side, unsigned readings, struct pair_axes *axes) {
    bool turning = false;
    int error = ERROR_OK;
    axes->pan_q4 = 0;
    for (unsigned axis = 0; axis < LENS_AXES; axis++) {
        axes->lens[axis] = (struct lens_mean){INT32_MIN, 0};
    }
    if (rig->camera[side].pan_q4 != 0) {
        error = read_servo(rig, side, &axes->pan_q4, &turning);
    }
    if (error == ERROR_OK && turning) {
        error = rig_part_error(
            rig, rig_part_of(RIG_PART_LEFT_SERVO, side), ERROR_MOVED,
            "it is still turning (wait until it has stopped, then capture again)", NULL);
    }
    if (error != ERROR_OK || !rig_has_lens(&rig->profile, side)) {
        return error;
    }
    return rig_lens_read_mean(rig, side, readings, axes->lens);
}

static int read_all_axes(struct rig *rig, unsigned readings, struct pair_axes all_axes[RIG_SIDES]) {
    int error = ERROR_OK;
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        error = read_axes(rig, side, readings, &all_axes[side]);
    }
    return error;
}

static int compare_axes(struct rig *rig, unsigned side, const struct pair_frame *frame) {
    const struct pair_axes *before = &frame->before, *after = &frame->after;
    if (before->pan_q4 != after->pan_q4) {
        const int32_t numbers[] = {before->pan_q4 / 16, after->pan_q4 / 16};
        return rig_part_error(rig, rig_part_of(RIG_PART_LEFT_SERVO, side), ERROR_MOVED,
                              "it turned from # us to # us during the pair (capture again)",
                              numbers);
    }
    static const char *const moved[LENS_AXES] = {
        "its zoom moved from # to # during the pair (capture again)",
        "its focus moved from # to # during the pair (capture again)",
        "its iris moved from # to # during the pair (capture again)",
    };
    for (unsigned axis = 0; axis < LENS_AXES; axis++) {
        const int32_t from_q4 = before->lens[axis].position_q4;
        const int32_t to_q4 = after->lens[axis].position_q4;
        if (from_q4 == INT32_MIN || to_q4 == INT32_MIN) {
            continue;
        }
        const int32_t numbers[] = {position_fit_counts(from_q4), position_fit_counts(to_q4)};
        const int32_t way_q4 = from_q4 > to_q4 ? from_q4 - to_q4 : to_q4 - from_q4;
        if (way_q4 > 16 * rig->profile.lens.axis[axis].tolerance_counts) {
            return rig_part_error(rig, rig_part_of(RIG_PART_LEFT_LENS, side), ERROR_MOVED,
                                  moved[axis], numbers);
        }
    }
    return ERROR_OK;
}

// ---- checks of a pair

static int compare_times(struct rig *rig, const struct pair *pair) {
    const int64_t apart_us = pair->skew_us < 0 ? -pair->skew_us : pair->skew_us;
    if (apart_us <= rig->profile.skew_limit_us) {
        return ERROR_OK;
    }
    const int32_t numbers[] = {(int32_t)(apart_us / US_PER_MS),
                               (int32_t)(rig->profile.skew_limit_us / US_PER_MS)};
    return rig_part_error(rig, RIG_PART_RIGHT_CAMERA, ERROR_MOVED,
                          "its frame began # ms from the left one (allowed: # ms; use a shorter "
                          "exposure, or raise rig.skew_limit)",
                          numbers);
}

static int compare_scenes(struct rig *rig, struct pair *pair) {
    struct pair_frame again = {.image = {.data = NULL}};
    const int error = pair_take_frame(rig, RIG_LEFT, pair->frame[RIG_RIGHT].end_us, &again);
    if (error != ERROR_OK) {
        return error;
    }
    const struct pair_frame *left = &pair->frame[RIG_LEFT];
    pair->change_permille = image_change_permille(&left->image, &again.image, left->gain_q3);
    raw_image_release(&again.image);
    pair->checked = true;
    return pair_check_change(rig, RIG_LEFT, pair->change_permille);
}

static int wait_for_rest(struct rig *rig) {
    int error = ERROR_OK;
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        error = rig_wait_until(rig, rig->camera[side].pan_stopped_at_us);
    }
    return error;
}

// Whether nothing moved between the frames, and they are close enough in time.
static int compare_circumstances(struct rig *rig, struct pair *pair,
                                 const struct pair_axes before[RIG_SIDES],
                                 const struct pair_axes after[RIG_SIDES], bool limits_skew) {
    int error = ERROR_OK;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        pair->frame[side].before = before[side];
        pair->frame[side].after = after[side];
        error = error == ERROR_OK ? compare_axes(rig, side, &pair->frame[side]) : error;
    }
    return error == ERROR_OK && limits_skew ? compare_times(rig, pair) : error;
}

// Takes the frames and compares the scenes in them. ERROR_MOVED: the scene changed, and the frames
// are complete.
static int take_and_compare(struct rig *rig, const struct pair_options *options,
                            struct pair *pair) {
    if (merges(options)) {
        return pair_merge_take(rig, options, pair);
    }
    report(rig, options, 0);
    const int error = take_both(rig, options, pair->frame);
    if (error != ERROR_OK) {
        // No frames, so nothing moved between them.
        return error;
    }
    report(rig, options, RIG_SIDES);
    pair->skew_us = skew_of(pair->frame);
    return options->check_static ? compare_scenes(rig, pair) : ERROR_OK;
}

// Runs all steps; `*compared`: frames and axes are complete.
static int capture(struct rig *rig, const struct pair_options *options, struct pair *pair,
                   bool *compared) {
    struct pair_axes before[RIG_SIDES], after[RIG_SIDES];
    int error = wait_for_rest(rig);
    const unsigned readings = options->readings != 0 ? options->readings : RIG_LENS_READINGS;
    if (error != ERROR_OK) {
        return error;
    }
    error = read_all_axes(rig, readings, before);
    if (error != ERROR_OK) {
        return error;
    }
    const int checked = take_and_compare(rig, options, pair);
    if (checked != ERROR_OK && checked != ERROR_MOVED) {
        return checked;
    }
    const struct rig_error last_error = rig->last_error;
    error = read_all_axes(rig, RIG_LENS_READINGS, after);
    if (error != ERROR_OK) {
        return error;
    }
    *compared = true;
    error = compare_circumstances(rig, pair, before, after, !merges(options));
    if (error == ERROR_OK && checked != ERROR_OK) {
        rig->last_error = last_error;
        error = checked;
    }
    if (!merges(options)) {
        report(rig, options, frames_of(options));
    }
    return error;
}

// Nothing has moved, so a bad frame or a rejected bracket does not make the rig safe.
static int end(struct rig *rig, int error) {
    const bool harmless = error == ERROR_OK || error == ERROR_MOVED || error == ERROR_FRAME ||
                          error == ERROR_MEMORY || error == ERROR_CANCELLED ||
                          (error != ERROR_OK && rig->rejected.error == error);
    return harmless ? rig_end(rig, error) : rig_fail_safe(rig, error);
}

int pair_capture(struct rig *rig, const struct pair_options *options, struct pair *pair) {
    INVARIANT(options != NULL && pair != NULL);
    INVARIANT(!merges(options) || options->memory != NULL);
    if (rig->state != RIG_READY) {
        return ERROR_NOT_READY;
    }
    rig->rejected = (struct rig_error){.error = ERROR_OK};
    struct pair taken = {.number = rig->pairs + 1};
    bool compared = false;
    const int error = capture(rig, options, &taken, &compared);
    if (error != ERROR_OK) {
        pair_release(taken.frame);
    }
    if (error == ERROR_OK || (error == ERROR_MOVED && compared)) {
        *pair = taken;
    }
    rig->pairs += error == ERROR_OK;
    return end(rig, error);
}

// The part of the sensor that frames show now, and how to thin it to `max_side_px` pixels a side.
static struct rig_rectangle thinned(const struct rig *rig, unsigned side, int max_side_px,
                                    uint8_t *skip) {
    const struct mt9t001_window *window = &rig->camera[side].sensor.window;
    struct rig_rectangle where = {0, 0, rig->format.width_px, rig->format.height_px};
    *skip = 1;
    if (rig->profile.bridge) {
        const int all_px =
            window->width_px > window->height_px ? window->width_px : window->height_px;
        const int need = (all_px + max_side_px - 1) / max_side_px;
        const int apply = need > window->skip ? need : window->skip;
        *skip = (uint8_t)(apply < MT9T001_SKIP_MAX ? apply : MT9T001_SKIP_MAX);
        where = (struct rig_rectangle){window->column_px, window->row_px, window->width_px,
                                       window->height_px};
    }
    const int step_px = 2 * *skip;
    const int left_px = where.width_px % step_px, over_px = where.height_px % step_px;
    where.width_px = (uint16_t)(where.width_px - left_px);
    where.height_px = (uint16_t)(where.height_px - over_px);
    where.column_px = (uint16_t)(where.column_px + left_px / 4 * 2);
    where.row_px = (uint16_t)(where.row_px + over_px / 4 * 2);
    INVARIANT(where.width_px > 0 && where.height_px > 0);
    return where;
}

// The earliest time of which a look may show a row.
static uint64_t look_from_us(const struct rig *rig, unsigned side, bool streams) {
    const uint64_t now_us = rig_now_us(rig);
    const bool runs_freely = !rig->profile.bridge && !rig->profile.trigger;
    const uint64_t before_us = streams && runs_freely ? 2 * rig_camera_frame_us(rig, side) : 0;
    return now_us > before_us ? now_us - before_us : 0;
}

int pair_look(struct rig *rig, int max_side_px, bool streams,
              struct pair_look_frame looks[RIG_SIDES]) {
    const struct pair_options options = {.check_static = false};
    INVARIANT(max_side_px >= PAIR_LOOK_MIN_PX && max_side_px <= PAIR_LOOK_WHOLE_PX);
    if (rig->state != RIG_READY) {
        return ERROR_NOT_READY;
    }
    int error = ERROR_OK;
    rig->rejected = (struct rig_error){.error = ERROR_OK};
    report(rig, &options, 0);
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        looks[side] = (struct pair_look_frame){.frame.image.data = NULL};
    }
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        struct rig_region region;
        struct pair_look_frame *look = &looks[side];
        const struct rig_rectangle where = thinned(rig, side, max_side_px, &look->skip);
        look->column_px = where.column_px;
        look->row_px = where.row_px;
        error = rig_region_begin(rig, &region, side, &where, look->skip);
        const uint64_t from_us = look_from_us(rig, side, streams);
        error = error == ERROR_OK ? rig_region_take(rig, &region, from_us, &look->frame) : error;
        const int ended = rig_region_end(rig, &region, false);
        error = error == ERROR_OK ? ended : error;
        report(rig, &options, side + 1);
    }
    if (error != ERROR_OK) {
        pair_look_release(looks);
    }
    return error;
}

void pair_look_release(struct pair_look_frame looks[RIG_SIDES]) {
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        raw_image_release(&looks[side].frame.image);
    }
}
