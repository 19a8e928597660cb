// SPDX-License-Identifier: Apache-2.0
#include "rig/auto/autofocus.h"

#include <math.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
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
    FRAME_US = 4000,  // time from frame to frame of a region, in addition to the exposure
    REST_READINGS = 4,
    TURN_US = 5000,
    SHARE_US = 150000,           // interval between readings of the other lens during a sweep
    POSITION_DELAY_US = 400000,  // delay until the readings around a time have come
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

// Where a search is.
enum focuser_state {
    FOCUSER_WAITING,  // waits for what the other lens finds
    FOCUSER_READY,    // may take its next step
    FOCUSER_MOVING,   // takes a step without frames: the other lens may have the camera port
    FOCUSER_ENDED
};

// One search.
struct focuser {
    struct rig *rig;
    unsigned side;
    const struct rig_autofocus_options *options;
    struct rig_focus *focus;
    struct focuser *other;  // NULL: only this lens is focused
    enum focuser_state state;
    struct focus_step step;
    struct focus_event event;
    struct rig_region region;
    bool has_port;  // its frames arrive
    struct rig_lens_move move;
    int failed;        // why its move failed
    uint64_t turn_us;  // not stepped earlier while the other lens sweeps
    bool followed;     // begun where the other lens, whose search had not ended, saw a peak
    bool repeated;
    uint64_t begin_us;
    bool own_control;           // moves the camera's own focus instead of a motorized lens
    uint32_t full_exposure_us;  // 0: the search has no other one
    uint16_t full_gain_q3;
    double counts_per_s;
    struct pending *pending;  // PENDING_MAX, of the sweep under way
    unsigned waiting;
    double last_position;  // position of the last sample of this leg
    bool has_last;
};

static const struct lens_axis_settings *axis_of(const struct focuser *self) {
    return &self->rig->profile.lens.axis[LENS_FOCUS];
}

// ---- frames

static int take_sample(struct focuser *self, uint64_t not_before_us, enum focus_leg leg,
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
    const int32_t counts = (int32_t)math_round(position);
    return rig_lens_move_begin(self->rig, &self->move, 1u << self->side, LENS_FOCUS, counts, when);
}

static int step_own(struct focuser *self, uint64_t until_us) {
    const int error = rig_lens_move_step(self->rig, &self->move, until_us);
    self->failed = error != ERROR_OK ? error : self->failed;
    return error;
}

// Steps the moves under way. Both lenses are read over one line, and frames of a ring that moves
// need many of its readings: the other lens is read now and then meanwhile.
static int step_moves(struct focuser *self, uint64_t until_us) {
    struct focuser *other = self->other;
    const uint64_t now_us = rig_now_us(self->rig);
    if (other == NULL || rig_lens_move_done(&other->move) ||
        (self->step.kind == FOCUS_STEP_SWEEP && now_us < other->turn_us)) {
        return step_own(self, until_us);
    }
    const struct rig_lens *lens = &self->rig->camera[other->side].lens;
    const uint32_t readings = lens->tracked;
    const uint64_t soon_us = until_us < now_us + TURN_US ? until_us : now_us + TURN_US;
    const int error = step_own(other, soon_us);
    other->turn_us = lens->tracked != readings ? now_us + SHARE_US : other->turn_us;
    return error != ERROR_OK ? error : step_own(self, soon_us);
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
        error = take_sample(self, *next_us, step->leg, pending);
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
        const int error = take_sample(self, rest_us, step->leg, &taken);
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

// Its frames are those that arrive.
static int take_port(struct focuser *self) {
    int error = ERROR_OK;
    if (!self->has_port) {
        error = rig_region_choose(self->rig, &self->region);
    }
    self->has_port = error == ERROR_OK;
    if (self->other != NULL) {
        self->other->has_port = false;
    }
    return error == ERROR_OK && self->step.slow && self->full_exposure_us != 0 ? slow_down(self)
                                                                               : error;
}

// Where the ring is after a move.
static void note_rest(struct focuser *self) {
    self->event = (struct focus_event){
        .position = self->rig->camera[self->side].lens.readings[LENS_FOCUS].position,
        .deviation = axis_of(self)->tolerance_counts,
    };
}

// Carries out a step with frames.
static int see(struct focuser *self) {
    int error = take_port(self);
    if (error != ERROR_OK) {
        return error;
    }
    if (self->own_control) {
        return focus_mover_carry_out(self->rig, self->side, &self->step, look, self, &self->event);
    }
    if (self->step.kind == FOCUS_STEP_SWEEP) {
        error = sweep(self, &self->step);
        note_rest(self);
        return error;
    }
    error = read_position(self, &self->event);
    return error == ERROR_OK ? look(self, &self->step, self->event.position) : error;
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
    const double flicker_us = math_max(rig_mains_half_us(&self->rig->profile), 1);
    *ratio = 1;
    if (!self->rig->profile.bridge || before_us <= flicker_us || before_us <= wanted_us ||
        gain_q3 == 0) {
        return ERROR_OK;
    }
    const double brighter = gain_q3 < GAIN_MAX_Q3 ? (double)GAIN_MAX_Q3 / gain_q3 : 1;
    double exposure_us = math_max(math_max(wanted_us, before_us / (brighter * DARKER)), flicker_us);
    exposure_us = math_floor(exposure_us / flicker_us) * flicker_us;
    const double shorter = before_us / exposure_us;
    self->full_exposure_us = before_us;
    self->full_gain_q3 = gain_q3;
    uint32_t applied_us = 0;
    uint16_t applied_q3 = 0;
    int error = rig_region_exposure(self->rig, &self->region, (uint32_t)exposure_us, &applied_us);
    if (error == ERROR_OK) {
        error = rig_region_gain(self->rig, &self->region,
                                (uint16_t)math_min(gain_q3 * shorter, GAIN_MAX_Q3), &applied_q3);
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
        shorten_exposure(self, math_min(peak_counts, longest_counts), &options->noise_ratio);
    const uint32_t exposure_us = self->rig->camera[self->side].exposure_us;
    options->counts_per_exposure = self->counts_per_s * exposure_us / US_PER_S;
    options->counts_per_frame = self->counts_per_s * (exposure_us + FRAME_US) / US_PER_S;
    return error;
}

// What a lens found can be relied upon where the other one is to be searched.
static bool has_found(const struct focuser *self) {
    const enum focus_verdict verdict = self->focus->search.result.verdict;
    return verdict == FOCUS_FOCUSED || verdict == FOCUS_TWO_PEAKS;
}

// Whether its search has seen where the peak is, although it has not ended.
static bool has_seen_peak(const struct focuser *self) {
    const struct focus_search *search = &self->focus->search;
    const bool later = search->phase != FOCUS_SEARCH_TO_START &&
                       search->phase != FOCUS_SEARCH_SWEEP && search->phase != FOCUS_SEARCH_RETURN;
    return self->state != FOCUSER_WAITING && !self->own_control && later && !search->wide &&
           !search->slow && search->result.peak.height > 0;
}

// Where the peak is expected from what the other lens, whose search has not ended, has seen.
static bool follow(struct focuser *self, struct focus_search_options *options) {
    const struct focuser *other = self->other;
    int32_t expected = 0, half_range = 0;
    if (other == NULL || other->state == FOCUSER_ENDED || !has_seen_peak(other)) {
        return false;
    }
    const struct focus_search *seen = &other->focus->search;
    const struct focus_peak *peak = &seen->result.peak;
    const double sigma =
        math_hypot(math_max(peak->deviation, seen->spacing / 2), seen->options.run_up / 2);
    if (rig_optics_focus_from_other(self->rig, self->side, peak->position, sigma, &expected,
                                    &half_range) != ERROR_OK) {
        return false;
    }
    options->expected = expected;
    options->expected_half_range = half_range;
    return true;
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
    self->followed = may_expect(self->options) && follow(self, options);
    event->position = positions[LENS_FOCUS];
    return prepare(self, options);
}

static int begin(struct focuser *self) {
    struct focus_search_options options;
    int error = rig_region_begin(self->rig, &self->region, self->side, &self->focus->region_px, 1);
    self->has_port = error == ERROR_OK;
    if (self->other != NULL) {
        self->other->has_port = false;
    }
    if (error != ERROR_OK) {
        return error;
    }
    error = begin_search(self, &options, &self->event);
    if (error != ERROR_OK) {
        return error;
    }
    options.measure = self->options->measure;
    options.choice = self->options->choice;
    options.curve_only = self->options->curve_only;
    self->focus->was_expected = options.expected_half_range > 0;
    self->step = focus_search_begin(&self->focus->search, &options, self->event.position);
    self->state = FOCUSER_READY;
    return ERROR_OK;
}

static void learn(const struct focuser *self) {
    const struct focus_peak *peak = &self->focus->search.result.peak;
    if (has_found(self) && !self->own_control && !self->options->curve_only) {
        (void)rig_optics_learn_focus(self->rig, self->side,
                                     (int32_t)math_round(peak->position * Q4),
                                     (uint16_t)math_min(peak->deviation * Q4 + 1, UINT16_MAX), 0);
    }
}

// Whether it was searched only where the other lens, as it turned out, does not see the subject.
static bool must_repeat(const struct focuser *self) {
    const struct focus_search *search = &self->focus->search;
    int32_t expected = 0, half_range = 0;
    if (!search->near_only || self->repeated || self->other == NULL || self->side == RIG_LEFT) {
        return false;
    }
    const struct focus_search *first = &self->other->focus->search;
    if (first->result.verdict == FOCUS_SHARP_EVERYWHERE && !first->guessed) {
        return false;
    }
    if (!has_found(self->other)) {
        return self->followed;
    }
    return has_found(self) &&
           rig_optics_focus_prediction(self->rig, self->side, &expected, &half_range) == ERROR_OK &&
           fabs(search->result.peak.position - expected) > half_range;
}

// After the last step. What the other lens finds comes first.
static int end(struct focuser *self) {
    const bool second = self->other != NULL && self->side == RIG_RIGHT;
    if (second && self->other->state != FOCUSER_ENDED) {
        return ERROR_OK;
    }
    if (must_repeat(self)) {
        const int error = rig_region_end(self->rig, &self->region, false);
        self->repeated = true;
        self->state = FOCUSER_WAITING;
        return error;
    }
    learn(self);
    self->focus->duration_ms = (uint32_t)((rig_now_us(self->rig) - self->begin_us) / US_PER_MS);
    self->state = FOCUSER_ENDED;
    return ERROR_OK;
}

static int begin_next(struct focuser *self) {
    self->step = focus_search_next(&self->focus->search, &self->event);
    self->state = FOCUSER_READY;
    return ERROR_OK;
}

// The right lens is searched where the left one finds the subject, or where both found it before.
static bool may_begin(const struct focuser *self) {
    const struct focuser *other = self->other;
    int32_t expected = 0, half_range = 0;
    return other == NULL || self->side == RIG_LEFT || other->state == FOCUSER_ENDED ||
           !may_expect(self->options) || has_seen_peak(other) ||
           (other->focus->was_expected && other->focus->search.near_only &&
            rig_optics_focus_prediction(self->rig, self->side, &expected, &half_range) == ERROR_OK);
}

static bool needs_port(const struct focuser *self) {
    return self->own_control || self->step.kind == FOCUS_STEP_SWEEP ||
           self->step.kind == FOCUS_STEP_LOOK;
}

// Does what needs no frames: afterwards its motor is under way, or it waits.
static int advance(struct focuser *self) {
    int error = ERROR_OK;
    if (self->state == FOCUSER_WAITING && may_begin(self)) {
        error = begin(self);
    }
    if (error == ERROR_OK && self->state == FOCUSER_MOVING && rig_lens_move_done(&self->move)) {
        note_rest(self);
        error = begin_next(self);
    }
    if (error != ERROR_OK || self->state != FOCUSER_READY) {
        return error;
    }
    if (self->step.kind == FOCUS_STEP_END) {
        return end(self);
    }
    if (needs_port(self)) {
        return ERROR_OK;
    }
    error = begin_move(self, self->step.position,
                       self->step.kind == FOCUS_STEP_GO ? LENS_MOVE_COARSE : LENS_MOVE_ALWAYS);
    self->state = error == ERROR_OK ? FOCUSER_MOVING : self->state;
    return error;
}

// Frames of one lens, or what comes next of the moves; `*busy`: a search has not ended.
static int use_port(struct focuser *lenses, unsigned count, bool *busy) {
    struct focuser *moving = NULL;
    *busy = false;
    for (unsigned i = 0; i < count; i++) {
        struct focuser *self = &lenses[i];
        *busy = *busy || self->state != FOCUSER_ENDED;
        if (self->state == FOCUSER_READY && self->step.kind != FOCUS_STEP_END) {
            const int error = see(self);
            return error == ERROR_OK ? begin_next(self) : error;
        }
        moving = self->state == FOCUSER_MOVING ? self : moving;
    }
    if (moving == NULL) {
        return ERROR_OK;
    }
    return step_moves(moving, rig_now_us(moving->rig) + RIG_POLL_US);
}

static int search(struct focuser *lenses, unsigned count) {
    int error = ERROR_OK;
    for (bool busy = true; busy && error == ERROR_OK;) {
        for (unsigned i = 0; i < count && error == ERROR_OK; i++) {
            error = advance(&lenses[i]);
        }
        error = error == ERROR_OK ? use_port(lenses, count, &busy) : error;
    }
    return error;
}

// Motors at rest, and the cameras as they were.
static int finish(struct focuser *lenses, unsigned count, int error) {
    for (unsigned i = 0; i < count; i++) {
        struct focuser *self = &lenses[i];
        rig_lens_move_cancel(self->rig, &self->move);
        while (!rig_lens_move_done(&self->move)) {
            (void)rig_lens_move_step(self->rig, &self->move, rig_now_us(self->rig) + RIG_POLL_US);
        }
        if (self->failed == ERROR_JAMMED) {
            note_rest(self);
            self->event.jammed = true;
            (void)focus_search_next(&self->focus->search, &self->event);
        }
    }
    // The last one saw the port as the others had set it.
    for (unsigned i = count; i-- > 0;) {
        const int ended = rig_region_end(lenses[i].rig, &lenses[i].region, false);
        error = error != ERROR_OK ? error : ended;
        lenses[i].focus->done = error == ERROR_OK;
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

int rig_autofocus(struct rig *self, unsigned sides, const struct rig_autofocus_options *options) {
    INVARIANT((unsigned)options->measure < FOCUS_MEASURES);
    struct focuser lenses[RIG_SIDES];
    struct pending pending[PENDING_MAX];
    unsigned count = 0;
    int error = focus_mover_check(self, sides);
    const struct rig_rectangle region_px =
        options->region_px.width_px != 0 ? options->region_px : middle_of(self);
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        if ((sides >> side & 1) != 0) {
            struct focuser *lens = &lenses[count++];
            *lens = (struct focuser){
                .rig = self,
                .side = side,
                .options = options,
                .focus = &self->camera[side].focus,
                .begin_us = rig_now_us(self),
                .own_control = focus_mover_steps(self, side) > 0,
                .pending = pending,
            };
            lens->counts_per_s = faster * axis_of(lens)->counts_per_s;
            lens->focus->done = false;
            lens->focus->frames = 0;
            lens->focus->region_px = region_px;
            lens->focus->search.result =
                (struct focus_result){.verdict = FOCUS_PENDING, .blur_px = -1};
        }
    }
    for (unsigned i = 0; i < count && count == RIG_SIDES; i++) {
        lenses[i].other = &lenses[1 - i];
    }
    error = error == ERROR_OK ? search(lenses, count) : error;
    return finish(lenses, count, error);
}
