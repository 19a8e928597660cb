// SPDX-License-Identifier: Apache-2.0
#include "rig/pair_merge.h"

#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/health.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"

enum {
    BLACK_MAX = 127,  // limit for a register, which is external data: half the range of 8 bits
};

// A merged pair in the making.
struct merging {
    struct rig *rig;
    const struct pair_options *options;
    struct pair *pair;
    struct merge_bracket bracket;  // chosen from the first left frame
    struct merge_plan plan;        // plan of the side under way, or of the last one
    uint64_t last_begin_us;        // time when the last frame of the present side began
    uint32_t done;                 // frames
};

static unsigned frames_of(const struct pair_options *options) {
    return options->average != 0 ? options->average : options->bracket;
}

static void report(struct merging *self, uint32_t done) {
    const struct rig_observer *observer = &self->rig->observer;
    self->done = done;
    if (observer->progress != NULL) {
        observer->progress(observer->self, "frames", done,
                           RIG_SIDES * frames_of(self->options) + 1);
    }
}

static int32_t saturate_us(uint64_t exposure_us) {
    if (exposure_us < 1) {
        return 1;
    }
    return exposure_us < INT32_MAX ? (int32_t)exposure_us : INT32_MAX;
}

static int set_exposure(struct merging *self, unsigned side, uint64_t exposure_us) {
    struct rig *rig = self->rig;
    if (exposure_us < 1 || exposure_us > RIG_EXPOSURE_MAX_US) {
        const int32_t number = saturate_us(exposure_us);
        return rig_reject(rig, rig_part_of(RIG_PART_LEFT_CAMERA, side), ERROR_RANGE,
                          "the bracket's exposure # us is not supported (open the iris, or use "
                          "fewer exposures)",
                          &number);
    }
    uint32_t applied_us = 0;
    return rig_exposure(rig, 1u << side, (uint32_t)exposure_us, &applied_us);
}

// Whatever happened meanwhile; a rig that is safe has no exposure.
static int restore_exposure(struct merging *self, unsigned side, uint32_t exposure_us, int error) {
    struct rig *rig = self->rig;
    if (rig->state != RIG_READY || rig->camera[side].exposure_us == exposure_us) {
        return error;
    }
    const struct rig_error last_error = rig->last_error, rejected = rig->rejected;
    uint32_t applied_us = 0;
    const int restored = rig_exposure(rig, 1u << side, exposure_us, &applied_us);
    if (error == ERROR_OK) {
        return restored;
    }
    rig->last_error = last_error;
    rig->rejected = rejected;
    return error;
}

static int read_black(struct rig *rig, unsigned side, uint16_t *black) {
    *black = 0;
    if (!rig->profile.bridge) {
        return ERROR_OK;
    }
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_SENSOR, side);
    const int error = rig_part_used(rig, part, mt9t001_black(&rig->camera[side].sensor, black));
    if (error != ERROR_OK) {
        return rig_bus_failed(rig, part, error);
    }
    const int32_t number = *black;
    return number <= BLACK_MAX
               ? ERROR_OK
               : rig_part_error(rig, part, ERROR_VERIFY,
                                "its black level # is impossible (run bringup)", &number);
}

static int take_frame(struct merging *self, unsigned side, struct pair_frame *frame) {
    const int error = pair_take_frame(self->rig, side, rig_now_us(self->rig), frame);
    self->last_begin_us = error == ERROR_OK ? frame->begin_us : self->last_begin_us;
    return error;
}

// Takes the first frame, at the first of the exposures. That of the left camera at the present
// exposure decides which these are.
static int take_first(struct merging *self, unsigned side, struct pair_frame *frame) {
    const bool brackets = self->options->bracket != 0;
    const uint32_t exposure_us = self->rig->camera[side].exposure_us;
    int error = ERROR_OK;
    if (side == RIG_LEFT) {
        error = take_frame(self, side, frame);
        if (error != ERROR_OK || !brackets) {
            return error;
        }
        self->bracket = merge_bracket_for(&frame->image, self->plan.black, self->options->bracket);
    }
    if (brackets && self->bracket.shorter) {
        INVARIANT(self->bracket.factor > 1);
        error = set_exposure(self, side, exposure_us / self->bracket.factor);
    } else if (side == RIG_LEFT) {
        return ERROR_OK;  // this frame is the first one
    }
    return error == ERROR_OK ? take_frame(self, side, frame) : error;
}

static void add_part(struct pair_frame *merged, const struct pair_frame *frame) {
    struct pair_part *last = &merged->part[merged->parts > 0 ? merged->parts - 1 : 0];
    if (merged->parts > 0 && last->exposure_us == frame->exposure_us &&
        last->gain_q3 == frame->gain_q3) {
        last->frames++;
        return;
    }
    INVARIANT(merged->parts < PAIR_PARTS_MAX);
    merged->part[merged->parts++] = (struct pair_part){frame->exposure_us, frame->gain_q3, 1};
}

static int add_frame(struct merging *self, unsigned side, struct merge_exposures *merge,
                     const struct pair_frame *frame) {
    const struct merge_exposure exposure = {frame->exposure_us, frame->gain_q3};
    uint32_t changed_permille = 0;
    if (merge_exposures_add(merge, &frame->image, &exposure, &changed_permille) != ERROR_OK) {
        return rig_reject(self->rig, rig_part_of(RIG_PART_LEFT_CAMERA, side), ERROR_RANGE,
                          "its exposures do not grow as requested (use average)", NULL);
    }
    struct pair *pair = self->pair;
    pair->change_permille =
        changed_permille > pair->change_permille ? changed_permille : pair->change_permille;
    report(self, self->done + 1);
    return pair_check_change(self->rig, side, changed_permille);
}

// Takes the other frames and adds all. `frame` is the first one, then the last.
static int add_frames(struct merging *self, unsigned side, struct merge_exposures *merge,
                      struct pair_frame *frame, struct pair_frame *merged) {
    uint64_t exposure_us = frame->exposure_us;
    for (unsigned i = 0;; i++) {
        int error = add_frame(self, side, merge, frame);
        if (error != ERROR_OK) {
            return error;
        }
        add_part(merged, frame);
        merged->end_us = frame->end_us;
        if (i + 1 == frames_of(self->options)) {
            return ERROR_OK;
        }
        if (self->options->bracket != 0) {
            exposure_us *= self->bracket.factor;
            error = set_exposure(self, side, exposure_us);
        }
        if (error != ERROR_OK) {
            return error;
        }
        error = take_frame(self, side, frame);
        if (error != ERROR_OK) {
            return error;
        }
    }
}

static struct merge_exposure last_exposure(const struct merging *self,
                                           const struct pair_frame *frame) {
    uint64_t exposure_us = frame->exposure_us;
    for (unsigned i = 1; self->options->bracket != 0 && i < self->options->bracket; i++) {
        exposure_us *= self->bracket.factor;
    }
    return (struct merge_exposure){
        (uint32_t)(exposure_us < RIG_EXPOSURE_MAX_US ? exposure_us : RIG_EXPOSURE_MAX_US),
        frame->gain_q3};
}

static int merge_in(struct merging *self, unsigned side, uint32_t *sums, struct pair_frame *frame,
                    struct pair_frame *merged) {
    struct merge_exposures merge;
    int error = merge_exposures_begin(&merge, &self->plan, sums);
    if (error != ERROR_OK) {
        return rig_reject(self->rig, rig_part_of(RIG_PART_LEFT_CAMERA, side), error,
                          "its exposures are too far apart to be merged", NULL);
    }
    error = add_frames(self, side, &merge, frame, merged);
    if (error != ERROR_OK) {
        return error;
    }
    const struct pair_memory *memory = self->options->memory;
    raw_image_release(&frame->image);
    uint16_t *values = memory->allocate(merge_exposures_values(&self->plan.form) * sizeof *values);
    if (values == NULL) {
        return ERROR_MEMORY;
    }
    merge_exposures_end(&merge, values);
    merged->image = self->plan.form;
    merged->image.data = values;
    merged->image.stride = (ptrdiff_t)raw_image_row_values(&self->plan.form);
    merged->image.bits = MERGE_BITS;
    merged->image.release = memory->release;
    merged->image.owner = values;
    return ERROR_OK;
}

// Merges what follows the first frame.
static int merge_with(struct merging *self, unsigned side, struct pair_frame *frame,
                      struct pair_frame *merged) {
    const struct pair_memory *memory = self->options->memory;
    *merged = *frame;
    merged->image = (struct raw_image){.data = NULL};
    self->plan.form = frame->image;
    self->plan.form.release = NULL;
    self->plan.form.owner = NULL;
    self->plan.frames = frames_of(self->options);
    self->plan.first = (struct merge_exposure){frame->exposure_us, frame->gain_q3};
    self->plan.last = last_exposure(self, frame);
    uint32_t *sums = memory->allocate(merge_exposures_values(&frame->image) * sizeof *sums);
    if (sums == NULL) {
        return ERROR_MEMORY;
    }
    const int error = merge_in(self, side, sums, frame, merged);
    memory->release(sums);
    return error;
}

static int merge_side(struct merging *self, unsigned side) {
    const uint32_t exposure_us = self->rig->camera[side].exposure_us;
    struct pair_frame frame = {.image = {.data = NULL}};
    int error = read_black(self->rig, side, &self->plan.black);
    error = error == ERROR_OK ? take_first(self, side, &frame) : error;
    error = error == ERROR_OK ? merge_with(self, side, &frame, &self->pair->frame[side]) : error;
    raw_image_release(&frame.image);
    return restore_exposure(self, side, exposure_us, error);
}

// Compares another left frame, after all others, with the merged one.
static int compare_last(struct merging *self, const struct merge_plan *plan) {
    struct pair *pair = self->pair;
    struct pair_frame again = {.image = {.data = NULL}};
    const int error = take_frame(self, RIG_LEFT, &again);
    if (error != ERROR_OK) {
        return error;
    }
    const struct merge_exposure exposure = {again.exposure_us, again.gain_q3};
    const uint32_t changed_permille =
        merge_exposures_changed(plan, &pair->frame[RIG_LEFT].image, &again.image, &exposure);
    raw_image_release(&again.image);
    pair->change_permille =
        changed_permille > pair->change_permille ? changed_permille : pair->change_permille;
    report(self, self->done + 1);
    return pair_check_change(self->rig, RIG_LEFT, changed_permille);
}

int pair_merge_take(struct rig *rig, const struct pair_options *options, struct pair *pair) {
    struct merging self = {.rig = rig, .options = options, .pair = pair};
    INVARIANT(frames_of(options) >= 2 && options->average <= PAIR_AVERAGE_MAX);
    INVARIANT(options->bracket <= PAIR_BRACKET_MAX);
    if (options->bracket != 0 && !rig->profile.bridge) {
        return rig_reject(rig, RIG_PART_LEFT_CAMERA, ERROR_UNSUPPORTED,
                          "a bracket requires linear frames with a known black level, as from "
                          "cameras behind a bridge (use average)",
                          NULL);
    }
    report(&self, 0);
    pair->checked = true;
    int error = merge_side(&self, RIG_LEFT);
    const struct merge_plan left = self.plan;
    if (error != ERROR_OK) {
        return error;
    }
    error = merge_side(&self, RIG_RIGHT);
    if (error != ERROR_OK) {
        return error;
    }
    pair->skew_us = (int64_t)(self.last_begin_us - pair->frame[RIG_LEFT].begin_us);
    return compare_last(&self, &left);
}
