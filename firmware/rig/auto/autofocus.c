// SPDX-License-Identifier: Apache-2.0
#include "rig/auto/autofocus.h"

#include <math.h>

#include "core/error.h"
#include "core/invariant.h"
#include "rig/auto/focus_frame.h"
#include "rig/auto/focus_mover.h"
#include "rig/base/poll.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"
#include "rig/lens_move.h"
#include "rig/lens_read.h"
#include "rig/rig_optics.h"
#include "rig/rig_region.h"

enum {
    US_PER_S = 1000000,
    US_PER_MS = 1000,
    Q4 = 16,
    // Windows below half of the range are still measured well: the search may be darker by this.
    DARKER = 4,
    GAIN_MAX_Q3 = 64,
    FRAME_US = 4000,  // between frames of a region, besides their exposure
    REST_READINGS = 4,
    TURN_US = 5000,
    AHEAD_COUNTS = 60,
    POSITION_DELAY_US = 400000,  // until the readings around a time have come
    PENDING_MAX = 128,
    RESTS_WITHIN = 2,  // counts
};

// The narrowest peak: a fine texture's sharpness falls to half at this diameter of the blur on each
// side. The ring may move through as much during an exposure.
static const double narrow_peak_px = 2, unknown_peak_counts = 2;
// However wide the peak, it is to be seen in many frames.
static const double longest_counts = 6;
// Motors are faster than the slowest that does not count as jammed.
static const double faster = 2;

// A frame whose ring position is not known yet.
struct pending {
    uint64_t exposed_us;
    struct focus_sample sample;
};

// The way of the other lens to where it will be searched.
struct ahead {
    unsigned side;
    bool begun;
    struct rig_lens_move move;
};

// One search.
struct focuser {
    struct rig *rig;
    unsigned side;
    const struct rig_autofocus_options *options;
    struct rig_focus *focus;
    struct rig_region region;
    struct rig_lens_move move;
    struct ahead *ahead;  // NULL: no other lens
    uint64_t begin_us;
    bool own_control;           // of the camera's focus, instead of a motorized lens
    uint32_t full_exposure_us;  // 0: the search has no other one
    uint16_t full_gain_q3;
    double counts_per_s;
    struct pending pending[PENDING_MAX];
    unsigned waiting;
    double last_position;  // of a sample of this leg
    bool has_last;
};

static const struct lens_axis_settings *axis_of(const struct focuser *self) {
    return &self->rig->profile.lens.axis[LENS_FOCUS];
}

// ---- frames

static int take(struct focuser *self, uint64_t not_before_us, enum focus_leg leg,
                struct pending *taken) {
    struct rig_region_frame frame;
    const int error = rig_region_take(self->rig, &self->region, not_before_us, &frame);
    if (error != ERROR_OK) {
        return error;
    }
    taken->exposed_us = frame.exposed_us;
    taken->sample = focus_frame_measure(&frame, self->options->measure, self->rig->profile.bridge);
    taken->sample.time_ms = (uint32_t)((frame.exposed_us - self->begin_us) / US_PER_MS);
    taken->sample.leg = (uint8_t)leg;
    self->focus->frames++;
    raw_image_release(&frame.image);
    return ERROR_OK;
}

// ---- moves

static int begin_move(struct focuser *self, double position, enum rig_lens_move_when when) {
    const int32_t counts = (int32_t)lround(position);
    return rig_lens_move_begin(self->rig, &self->move, 1u << self->side, LENS_FOCUS, counts, when);
}

// Steps the moves under way. An error of the other lens shows when its turn comes.
static int step_moves(struct focuser *self, uint64_t until_us) {
    struct ahead *ahead = self->ahead;
    if (ahead == NULL || !ahead->begun || rig_lens_move_done(&ahead->move)) {
        return rig_lens_move_step(self->rig, &self->move, until_us);
    }
    const uint64_t soon_us = rig_now_us(self->rig) + TURN_US;
    (void)rig_lens_move_step(self->rig, &ahead->move, until_us < soon_us ? until_us : soon_us);
    return rig_lens_move_step(self->rig, &self->move, until_us < soon_us ? until_us : soon_us);
}

// Until the ring is at rest. `error`: why it is to rest before it has arrived, or 0.
static int finish_move(struct focuser *self, int error) {
    int moved = ERROR_OK;
    if (error != ERROR_OK) {
        rig_lens_move_cancel(self->rig, &self->move);
    }
    while (moved == ERROR_OK && !rig_lens_move_done(&self->move)) {
        moved = step_moves(self, rig_now_us(self->rig) + RIG_POLL_US);
    }
    return error != ERROR_OK ? error : moved;
}

// Adds the frames whose position is known by now; `all`: those that will not be known are dropped.
static void resolve(struct focuser *self, double spacing, bool all) {
    const uint64_t now_us = rig_now_us(self->rig);
    unsigned kept = 0;
    for (unsigned i = 0; i < self->waiting; i++) {
        struct pending *pending = &self->pending[i];
        int32_t position_q4 = 0;
        uint16_t sigma_q4 = 0;
        if (!all && pending->exposed_us + POSITION_DELAY_US > now_us) {
            self->pending[kept++] = *pending;
            continue;
        }
        if (rig_lens_position_at(self->rig, self->side, LENS_FOCUS, pending->exposed_us,
                                 &position_q4, &sigma_q4) != ERROR_OK) {
            continue;
        }
        const double position = (double)position_q4 / Q4;
        // At rest at the ends frames would repeat.
        if (self->has_last && fabs(position - self->last_position) < spacing / 2) {
            continue;
        }
        self->last_position = position;
        self->has_last = true;
        pending->sample.position = (float)position;
        focus_search_add(&self->focus->search, &pending->sample);
    }
    self->waiting = kept;
}

static bool is_at(const struct focuser *self, double position) {
    const int32_t seen = self->rig->camera[self->side].lens.readings[LENS_FOCUS].position;
    return fabs(seen - position) <= axis_of(self)->tolerance_counts;
}

// Takes the frame of a sweep that is not exposed before `*next_us`, and sets that of the next one.
static int take_next(struct focuser *self, const struct focus_step *step, uint64_t *next_us) {
    const uint64_t interval_us = (uint64_t)(step->spacing / self->counts_per_s * US_PER_S);
    const uint32_t exposure_us = self->rig->camera[self->side].exposure_us;
    struct pending *pending = &self->pending[self->waiting];
    int error = ERROR_OK;
    // The motor is watched while the frame is exposed.
    while (error == ERROR_OK && !rig_lens_move_done(&self->move) &&
           rig_now_us(self->rig) < *next_us + exposure_us) {
        error = step_moves(self, *next_us + exposure_us);
    }
    if (error == ERROR_OK) {
        error = take(self, *next_us, step->leg, pending);
    }
    if (error != ERROR_OK) {
        return error;
    }
    // Of frames that come hardly faster, every one and not every second.
    const bool every = interval_us < 3 * (uint64_t)(exposure_us + FRAME_US) / 2;
    *next_us = pending->exposed_us + (every ? interval_us / 2 : interval_us) - exposure_us / 2;
    self->waiting++;
    return ERROR_OK;
}

// Moves, with frames.
static int sweep(struct focuser *self, const struct focus_step *step) {
    uint64_t next_us = rig_now_us(self->rig);
    int error = begin_move(self, step->position, LENS_MOVE_COARSE);
    self->waiting = 0;
    self->has_last = false;
    if (error != ERROR_OK) {
        return error;
    }
    while (error == ERROR_OK && !rig_lens_move_done(&self->move)) {
        const bool no_frame = is_at(self, step->position) || self->waiting == PENDING_MAX;
        error = step_moves(self, no_frame ? rig_now_us(self->rig) + RIG_POLL_US : 0);
        if (error == ERROR_OK && !no_frame) {
            error = take_next(self, step, &next_us);
        }
        resolve(self, step->spacing, false);
    }
    error = finish_move(self, error);
    resolve(self, step->spacing, true);
    return error;
}

static int look(void *focuser, const struct focus_step *step, double position) {
    struct focuser *self = focuser;
    for (unsigned i = 0; i < step->frames; i++) {
        struct pending taken;
        const uint64_t rest_us = self->rig->camera[self->side].lens.stopped_at_us;
        const int error = take(self, rest_us, step->leg, &taken);
        if (error != ERROR_OK) {
            return error;
        }
        taken.sample.position = (float)position;
        focus_search_add(&self->focus->search, &taken.sample);
    }
    return ERROR_OK;
}

static int read_position(struct focuser *self, struct focus_event *event) {
    struct lens_mean means[LENS_AXES];
    const int error = rig_lens_read_mean(self->rig, self->side, REST_READINGS, means);
    event->position = (double)means[LENS_FOCUS].position_q4 / Q4;
    event->deviation = (double)means[LENS_FOCUS].sigma_q4 / Q4;
    return error;
}

// Takes the frames of the rest of the search with the exposure and gain from before it.
static int slow_down(struct focuser *self) {
    uint32_t applied_us = 0;
    uint16_t applied_q3 = 0;
    int error = rig_region_exposure(self->rig, &self->region, self->full_exposure_us, &applied_us);
    if (error == ERROR_OK) {
        error = rig_region_gain(self->rig, &self->region, self->full_gain_q3, &applied_q3);
    }
    self->full_exposure_us = 0;
    return error;
}

// Carries out a step.
static int carry_out(struct focuser *self, const struct focus_step *step,
                     struct focus_event *event) {
    int error = step->slow && self->full_exposure_us != 0 ? slow_down(self) : ERROR_OK;
    if (error != ERROR_OK) {
        return error;
    }
    switch (step->kind) {
        case FOCUS_STEP_GO:
            error = begin_move(self, step->position, LENS_MOVE_COARSE);
            error = error == ERROR_OK ? finish_move(self, ERROR_OK) : error;
            break;
        case FOCUS_STEP_SWEEP:
            error = sweep(self, step);
            break;
        case FOCUS_STEP_APPROACH:
            error = begin_move(self, step->position, LENS_MOVE_ALWAYS);
            error = error == ERROR_OK ? finish_move(self, ERROR_OK) : error;
            break;
        case FOCUS_STEP_LOOK:
            error = read_position(self, event);
            return error == ERROR_OK ? look(self, step, event->position) : error;
        case FOCUS_STEP_END:
            INVARIANT(false);
            break;
    }
    event->jammed = error == ERROR_JAMMED;
    event->position = self->rig->camera[self->side].lens.readings[LENS_FOCUS].position;
    event->deviation = axis_of(self)->tolerance_counts;
    return error;
}

// ---- before and after

// A shorter exposure for the search, with a higher gain, where the ring would move too far
// meanwhile. `*ratio`: how much noisier the relative values become.
static int shorten_exposure(struct focuser *self, double counts_max, double *ratio) {
    const struct rig_camera *camera = &self->rig->camera[self->side];
    const uint32_t before_us = camera->exposure_us;
    const uint16_t gain_q3 = camera->gain_q3;
    const double wanted_us = counts_max / self->counts_per_s * US_PER_S;
    // Of constant light any exposure is a multiple.
    const double flicker_us = fmax(rig_mains_half_us(&self->rig->profile), 1);
    *ratio = 1;
    if (!self->rig->profile.bridge || before_us <= flicker_us || before_us <= wanted_us ||
        gain_q3 == 0) {
        return ERROR_OK;
    }
    const double brighter = gain_q3 < GAIN_MAX_Q3 ? (double)GAIN_MAX_Q3 / gain_q3 : 1;
    double exposure_us = fmax(fmax(wanted_us, before_us / (brighter * DARKER)), flicker_us);
    exposure_us = floor(exposure_us / flicker_us) * flicker_us;
    const double shorter = before_us / exposure_us;
    self->full_exposure_us = before_us;
    self->full_gain_q3 = gain_q3;
    uint32_t applied_us = 0;
    uint16_t applied_q3 = 0;
    int error = rig_region_exposure(self->rig, &self->region, (uint32_t)exposure_us, &applied_us);
    if (error == ERROR_OK) {
        error = rig_region_gain(self->rig, &self->region,
                                (uint16_t)fmin(gain_q3 * shorter, GAIN_MAX_Q3), &applied_q3);
    }
    *ratio = shorter;
    return error;
}

// Whether the search may begin where the peak is expected. The nearer or the farther of two peaks
// may be elsewhere.
static bool may_expect(const struct rig_autofocus_options *options) {
    return !options->whole_range && !options->curve_only && options->choice == FOCUS_STRONGER;
}

static struct focus_search_options options_of(const struct focuser *self) {
    const struct lens_axis_settings *axis = axis_of(self);
    const struct rig_rectangle *region = &self->focus->region_px;
    struct focus_search_options options = {
        .min = axis->min,
        .max = axis->max,
        .from_above = axis->approach == LENS_FROM_ABOVE,
        .run_up = axis->backlash_counts + axis->tolerance_counts,
        .tolerance = RESTS_WITHIN,
        .noise_ratio = 1,
        .region_px = region->width_px < region->height_px ? region->width_px : region->height_px,
    };
    double blur_px = 0;
    int32_t expected = 0, half_range = 0;
    if (rig_optics_blur_per_count(self->rig, self->side, &blur_px) == ERROR_OK) {
        options.blur_per_count_px = blur_px;
    }
    if (may_expect(self->options) &&
        rig_optics_focus_prediction(self->rig, self->side, &expected, &half_range) == ERROR_OK) {
        options.expected = expected;
        options.expected_half_range = half_range;
    }
    return options;
}

// Exposure, gain and speed decide how much of a peak a moving ring can show.
static int prepare(struct focuser *self, struct focus_search_options *options) {
    const double peak_counts = options->blur_per_count_px > 0
                                   ? narrow_peak_px / options->blur_per_count_px
                                   : unknown_peak_counts;
    const int error =
        shorten_exposure(self, fmin(peak_counts, longest_counts), &options->noise_ratio);
    const uint32_t exposure_us = self->rig->camera[self->side].exposure_us;
    options->counts_per_exposure = self->counts_per_s * exposure_us / US_PER_S;
    options->counts_per_frame = self->counts_per_s * (exposure_us + FRAME_US) / US_PER_S;
    return error;
}

// Where the search of the other lens will begin: to the side of approach of its peak, which is
// predicted, or near that of this lens once that is known.
static bool begin_of_other(const struct focuser *self, double *counts) {
    const struct focus_search *machine = &self->focus->search;
    const struct lens_axis_settings *axis = axis_of(self);
    const double back = axis->approach == LENS_FROM_ABOVE ? 1 : -1;
    int32_t expected = 0, half_range = 0;
    if (may_expect(self->options) &&
        rig_optics_focus_prediction(self->rig, self->ahead->side, &expected, &half_range) ==
            ERROR_OK) {
        *counts = expected + back * (half_range + axis->backlash_counts + axis->tolerance_counts);
    } else if (machine->phase != FOCUS_SEARCH_TO_START && machine->result.peak.height > 0) {
        *counts = machine->result.peak.position + back * AHEAD_COUNTS;
    } else {
        return false;
    }
    *counts = fmin(fmax(*counts, axis->min), axis->max);
    return true;
}

static void send_ahead(struct focuser *self) {
    struct ahead *ahead = self->ahead;
    double counts = 0;
    if (ahead == NULL || ahead->begun || self->options->curve_only ||
        !begin_of_other(self, &counts)) {
        return;
    }
    ahead->begun = rig_lens_move_begin(self->rig, &ahead->move, 1u << ahead->side, LENS_FOCUS,
                                       (int32_t)lround(counts), LENS_MOVE_COARSE) == ERROR_OK;
}

// What is known before, and where the ring is.
static int begin_search(struct focuser *self, struct focus_search_options *options,
                        struct focus_event *event) {
    if (self->own_control) {
        *options = focus_mover_options(self->rig, self->side);
        event->position = focus_mover_position(self->rig, self->side);
        return ERROR_OK;
    }
    int32_t positions[LENS_AXES];
    const int error = rig_lens_read(self->rig, self->side, positions);
    if (error != ERROR_OK) {
        return error;
    }
    // What the optics know depends on the positions.
    *options = options_of(self);
    event->position = positions[LENS_FOCUS];
    return prepare(self, options);
}

static int search(struct focuser *self) {
    struct focus_search *machine = &self->focus->search;
    struct focus_search_options options;
    struct focus_event event = {.position = 0};
    int error = begin_search(self, &options, &event);
    if (error != ERROR_OK) {
        return error;
    }
    options.measure = self->options->measure;
    options.choice = self->options->choice;
    options.curve_only = self->options->curve_only;
    self->focus->was_expected = options.expected_half_range > 0;
    struct focus_step step = focus_search_begin(machine, &options, event.position);
    send_ahead(self);
    while (step.kind != FOCUS_STEP_END) {
        error = self->own_control
                    ? focus_mover_carry_out(self->rig, self->side, &step, look, self, &event)
                    : carry_out(self, &step, &event);
        if (error != ERROR_OK && !event.jammed) {
            return error;
        }
        step = focus_search_next(machine, &event);
        send_ahead(self);
    }
    return error;
}

static int focus_side(struct rig *rig, unsigned side, const struct rig_autofocus_options *options,
                      const struct rig_rectangle *region_px, struct ahead *ahead) {
    struct rig_focus *focus = &rig->camera[side].focus;
    struct focuser self = {
        .rig = rig, .side = side, .options = options, .focus = focus, .ahead = ahead};
    self.begin_us = rig_now_us(rig);
    self.own_control = focus_mover_steps(rig, side) > 0;
    self.counts_per_s = faster * axis_of(&self)->counts_per_s;
    focus->done = false;
    focus->frames = 0;
    focus->region_px = *region_px;
    focus->search.result = (struct focus_result){.verdict = FOCUS_PENDING, .blur_px = -1};
    int error = rig_region_begin(rig, &self.region, side, region_px, 1);
    if (error == ERROR_OK) {
        error = search(&self);
    }
    const int ended = rig_region_end(rig, &self.region, false);
    error = error != ERROR_OK ? error : ended;
    focus->duration_ms = (uint32_t)((rig_now_us(rig) - self.begin_us) / US_PER_MS);
    focus->done = error == ERROR_OK;
    const struct focus_result *result = &focus->search.result;
    const bool found = result->verdict == FOCUS_FOCUSED || result->verdict == FOCUS_TWO_PEAKS;
    if (focus->done && found && !self.own_control && !options->curve_only) {
        (void)rig_optics_learn_focus(rig, side, (int32_t)lround(result->peak.position * Q4),
                                     (uint16_t)fmin(result->peak.deviation * Q4 + 1, UINT16_MAX),
                                     0);
    }
    return error;
}

static struct rig_rectangle middle_of(const struct rig *self) {
    const bool bridge = self->profile.bridge;
    const unsigned width_px = bridge ? MT9T001_WIDTH_PX : self->format.width_px;
    const unsigned height_px = bridge ? MT9T001_HEIGHT_PX : self->format.height_px;
    const unsigned wide = width_px < RIG_AUTOFOCUS_REGION_PX ? width_px : RIG_AUTOFOCUS_REGION_PX;
    const unsigned high = height_px < RIG_AUTOFOCUS_REGION_PX ? height_px : RIG_AUTOFOCUS_REGION_PX;
    return (struct rig_rectangle){.column_px = (uint16_t)((width_px - wide) / 4 * 2),
                                  .row_px = (uint16_t)((height_px - high) / 4 * 2),
                                  .width_px = (uint16_t)(wide / 2 * 2),
                                  .height_px = (uint16_t)(high / 2 * 2)};
}

// Until the other lens is where it was sent, or at rest.
static int finish_ahead(struct rig *rig, struct ahead *ahead, int error) {
    if (!ahead->begun) {
        return error;
    }
    ahead->begun = false;
    if (error != ERROR_OK) {
        rig_lens_move_cancel(rig, &ahead->move);
    }
    int moved = ERROR_OK;
    while (moved == ERROR_OK && !rig_lens_move_done(&ahead->move)) {
        moved = rig_lens_move_step(rig, &ahead->move, rig_now_us(rig) + RIG_POLL_US);
    }
    return error != ERROR_OK ? error : moved;
}

int rig_autofocus(struct rig *self, unsigned sides, const struct rig_autofocus_options *options) {
    INVARIANT((unsigned)options->measure < FOCUS_MEASURES);
    int error = focus_mover_check(self, sides);
    struct rig_rectangle region_px = options->region_px;
    if (region_px.width_px == 0) {
        region_px = middle_of(self);
    }
    struct ahead ahead = {.side = RIG_RIGHT};
    const bool both =
        sides == (1u << RIG_LEFT | 1u << RIG_RIGHT) && rig_has_lens(&self->profile, RIG_RIGHT);
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        if ((sides >> side & 1) != 0) {
            const bool first = both && side == RIG_LEFT;
            error = focus_side(self, side, options, &region_px, first ? &ahead : NULL);
            error = finish_ahead(self, &ahead, error);
        }
    }
    return error;
}
