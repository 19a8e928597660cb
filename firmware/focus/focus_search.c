// SPDX-License-Identifier: Apache-2.0
#include "focus/focus_search.h"

#include <math.h>
#include <stddef.h>

#include "core/invariant.h"
#include "core/math.h"
#include "focus/focus_find.h"

enum {
    SWEEP_SAMPLES = 150,     // most of a sweep
    SWEEP_SAMPLES_MIN = 40,  // however wide the peak may be
    PASS_SAMPLES = 30,
    NEAR_SAMPLES = 30,  // samples of a sweep around the expected peak
    NEAR_PASS_SAMPLES = 14,
    NEAR_FRAMES = 3,   // frames on each flank of the expected peak
    PEAK_SAMPLES = 8,  // fewest samples that locate a peak
    PASSES = 3,
    STOPS = 5,
    LOOK_FRAMES = 4,
};

// A fine texture's sharpness falls to half at this diameter of the blur, in each direction.
static const double narrow_blur_px = 2;
// Curvature of a sweep, over its deviation: of a peak that is seen, and of a guess.
static const double seen_curvature = 6, guessed_curvature = 1;
// The peak of most textures falls clearly within this diameter.
static const double near_blur_px = 4;
// A ring that moves by more during an exposure, and by more than the peak is wide, is measured at
// rest.
static const double smeared_counts = 4;
// Blur below this is not seen.
static const double sharp_px = 1;
// At rest the picture shows this part of the peak's height.
static const double same_part = 0.85, changed_part = 0.5;
// The height of a peak, and what is seen of it at rest, are known to this part.
static const double height_deviation = 0.03;
// Frames differ by this part besides their noise: flicker, and rows of light.
static const double relative_spread = 0.015;
// Of the distance from the peak that is good enough, as it is known with errors: an approach that
// is accepted, and the last one if none was.
static const double accepted_part = 0.65, missed_part = 1.5;

static double within_range(const struct focus_search *self, double position) {
    return math_max(self->options.min, math_min(position, self->options.max));
}

// Towards the side that approaches begin from.
static double approach_side(const struct focus_search *self) {
    return self->options.from_above ? 1 : -1;
}

// Distance from the peak that is as good as none: half a depth of focus, but not less than the
// motor can do.
static double good_counts(const struct focus_search *self) {
    const struct focus_search_options *options = &self->options;
    const double half_depth =
        options->blur_per_count_px > 0 ? sharp_px / 2 / options->blur_per_count_px : 0;
    return math_max(options->tolerance, half_depth);
}

static bool is_at_end(const struct focus_search *self, double position) {
    return position - self->options.min < self->options.tolerance ||
           self->options.max - position < self->options.tolerance;
}

// ---- steps

static struct focus_step move_to(struct focus_search *self, double position) {
    return (struct focus_step){FOCUS_STEP_GO, FOCUS_LEG_SWEEP, within_range(self, position), 0, 0,
                               false};
}

static struct focus_step end(struct focus_search *self, const struct focus_event *event) {
    self->phase = FOCUS_SEARCH_END;
    self->result.position = event->position;
    self->result.frames = self->curve.count;
    return (struct focus_step){.kind = FOCUS_STEP_END};
}

static struct focus_step finish_at_start(struct focus_search *self, enum focus_verdict verdict) {
    self->result.verdict = verdict;
    self->phase = FOCUS_SEARCH_RETURN;
    return (struct focus_step){
        FOCUS_STEP_APPROACH, FOCUS_LEG_REST, within_range(self, self->begin), 0, 0, false};
}

static double sweep_spacing(const struct focus_search *self, double way) {
    const struct focus_search_options *options = &self->options;
    const double narrow =
        options->blur_per_count_px > 0 ? 2 * narrow_blur_px / 3 / options->blur_per_count_px : 0;
    const double spacing =
        self->near_only ? way / NEAR_SAMPLES
                        : math_min(math_max(narrow, way / SWEEP_SAMPLES), way / SWEEP_SAMPLES_MIN);
    return math_max(spacing, options->counts_per_frame);
}

static struct focus_step sweep(struct focus_search *self, enum focus_leg leg, double to,
                               double spacing) {
    self->step_begin = self->curve.count;
    return (struct focus_step){FOCUS_STEP_SWEEP, leg, within_range(self, to), spacing, 0, false};
}

// The whole range, from the nearer end.
static struct focus_step begin_cold(struct focus_search *self, double position) {
    const struct focus_search_options *options = &self->options;
    const bool down = options->max - position < position - options->min;
    self->near_only = false;
    self->curve.count = 0;
    self->result.second.height = 0;
    self->sweep_end = down ? options->min : options->max;
    self->phase = FOCUS_SEARCH_TO_START;
    return move_to(self, down ? options->max : options->min);
}

static struct focus_step begin_near(struct focus_search *self) {
    const struct focus_search_options *options = &self->options;
    // Both flanks of the peak, with a few frames on each.
    const double flank =
        options->blur_per_count_px > 0 ? near_blur_px / options->blur_per_count_px : 0;
    const double half =
        math_min((options->max - options->min) / 2,
                 math_max(options->expected_half_range,
                          math_max(flank, NEAR_FRAMES * options->counts_per_frame)));
    self->near_only = true;
    self->sweep_end = within_range(self, options->expected - approach_side(self) * half);
    self->phase = FOCUS_SEARCH_TO_START;
    return move_to(self, options->expected + approach_side(self) * (half + options->run_up));
}

struct focus_step focus_search_begin(struct focus_search *self,
                                     const struct focus_search_options *options, double position) {
    INVARIANT(options->min < options->max && options->tolerance > 0 && options->run_up >= 0);
    INVARIANT(options->counts_per_frame > 0 && options->noise_ratio >= 1);
    self->options = *options;
    self->curve.count = 0;
    self->result = (struct focus_result){.verdict = FOCUS_PENDING, .blur_px = -1};
    self->begin = position;
    self->passes = self->stops = 0;
    self->wide = self->guessed = self->slow = false;
    self->off_sum = 0;
    self->channel = self->finder = FOCUS_CHANNEL_CHOSEN;
    return options->expected_half_range > 0 ? begin_near(self) : begin_cold(self, position);
}

void focus_search_add(struct focus_search *self, const struct focus_sample *sample) {
    INVARIANT(sample->leg < FOCUS_LEGS);
    if (self->curve.count < FOCUS_SAMPLES_MAX) {
        self->curve.samples[self->curve.count++] = *sample;
    }
}

// ---- the approach and its judgement

static struct focus_step approach(struct focus_search *self, double target) {
    self->target = within_range(self, target);
    self->phase = FOCUS_SEARCH_APPROACH;
    self->step_begin = self->curve.count;
    return (struct focus_step){FOCUS_STEP_APPROACH, FOCUS_LEG_REST, self->target, 0, 0, false};
}

static struct focus_step look(struct focus_search *self, enum focus_search_phase phase) {
    self->phase = phase;
    self->step_begin = self->curve.count;
    return (struct focus_step){FOCUS_STEP_LOOK, FOCUS_LEG_REST, self->target, 0,
                               LOOK_FRAMES,     false};
}

// Mean of the samples of this step; false if there are none.
static bool step_mean(const struct focus_search *self, double *sharpness, double *light,
                      double *deviation) {
    double sum = 0, sum_light = 0, sum_variance = 0;
    const unsigned count = (unsigned)(self->curve.count - self->step_begin);
    for (unsigned i = self->step_begin; i < self->curve.count; i++) {
        const struct focus_sample *sample = &self->curve.samples[i];
        const double spread = sample->deviation[self->channel];
        sum += sample->sharpness[self->channel];
        sum_light += sample->mean;
        sum_variance += spread * spread;
    }
    if (count == 0) {
        return false;
    }
    *sharpness = sum / count;
    *light = sum_light / count;
    *deviation = sqrt(sum_variance) / count;
    return true;
}

static enum focus_verdict verdict_of(const struct focus_search *self) {
    const struct focus_search_options *options = &self->options;
    const struct focus_result *result = &self->result;
    const double way =
        math_max(result->peak.position - options->min, options->max - result->peak.position);
    if (self->guessed) {
        return FOCUS_SHARP_EVERYWHERE;  // no peak was seen
    }
    if (result->peak.at_edge && is_at_end(self, result->peak.position)) {
        return FOCUS_PEAK_AT_END;
    }
    if (result->second.height > 0) {
        return FOCUS_TWO_PEAKS;
    }
    return options->blur_per_count_px > 0 && way * options->blur_per_count_px <= 2 * sharp_px
               ? FOCUS_SHARP_EVERYWHERE
               : FOCUS_FOCUSED;
}

// Whether the peak is so near to an end of the range that approaches cannot reach it: the run-up
// needs room on one side of it, on the other the peak may be just beyond the end.
static bool is_near_end(const struct focus_search *self, double *end_counts) {
    const struct focus_search_options *options = &self->options;
    const double reach = options->run_up + options->tolerance;
    const double low_reach = options->from_above ? options->tolerance : reach;
    const double high_reach = options->from_above ? reach : options->tolerance;
    const bool low = self->result.peak.position - options->min < low_reach;
    *end_counts = low ? options->min : options->max;
    return low || options->max - self->result.peak.position < high_reach;
}

static void set_blur(struct focus_search *self, double counts) {
    const double px = self->options.blur_per_count_px;
    self->result.blur_counts = counts;
    self->result.blur_px = px > 0 ? counts * px : -1;
}

static struct focus_step finish(struct focus_search *self, const struct focus_event *event,
                                enum focus_verdict verdict) {
    if (focus_find_lights(self)) {
        self->result.blur_px = -1;  // the blur known so far belongs to another place
        return finish_at_start(self, FOCUS_LIGHTS);
    }
    self->result.verdict = verdict;
    return end(self, event);
}

// Another approach. `same`: the picture is that of the peak.
static struct focus_step try_again(struct focus_search *self, double place, double off, bool same) {
    double end_counts = 0;
    // At the ends the play cannot be taken up, or the peak is just beyond: the end itself.
    if (!same && is_near_end(self, &end_counts) && self->target != end_counts) {
        return approach(self, end_counts);
    }
    // One rest off its target is chance; what all of them share is not.
    self->off_sum += off;
    return approach(self, place - self->off_sum / (self->result.tries + 1.0));
}

static struct focus_step judge(struct focus_search *self, const struct focus_event *event) {
    struct focus_result *result = &self->result;
    const struct focus_peak *peak = &result->peak;
    double sharpness = 0, light = 0, deviation = 0;
    if (!step_mean(self, &sharpness, &light, &deviation)) {
        return finish_at_start(self, FOCUS_SCENE_CHANGED);
    }
    double before = 0;
    const double top = focus_find_at_peak(self, self->step_begin, &before);
    const double height = math_max(top - peak->floor, 1e-12);
    const double part = (sharpness - peak->floor) / height;
    const double off = event->position - peak->position, good = good_counts(self);
    const bool changed = fabs(light - before) > 0.1 * before;
    // A short sweep shows little of a wide peak's height: then noise is a large part of it.
    const double spread = math_max(math_max(height_deviation, deviation / height),
                                   relative_spread * sharpness / height);
    const double sure = math_max(part + spread - height_deviation, 0.01);
    const bool same = sure >= same_part || peak->half_width * sqrt(1 / sure - 1) <= good;
    result->light_changed = result->light_changed || changed;
    if (self->wide) {
        set_blur(self, math_hypot(off, peak->deviation));
        return finish(self, event, verdict_of(self));
    }
    self->stop_samples[result->tries - 1] =
        (struct focus_stop_sample){event->position, event->deviation, sharpness,
                                   math_hypot(deviation, relative_spread * sharpness)};
    const struct focus_peak_estimate estimate =
        focus_stop_estimate(peak, self->stop_samples, result->tries);
    set_blur(self, estimate.distance);
    if (result->blur_counts <= accepted_part * good && same) {
        return finish(self, event, verdict_of(self));
    }
    if (result->tries < FOCUS_TRIES) {
        return try_again(self, estimate.position, event->position - self->target, same);
    }
    // A ring that stops where the peak was four times, with much of its sharpness, is in focus.
    const bool missed =
        sure < changed_part || (result->blur_counts > missed_part * good && fabs(off) > good);
    return finish(self, event, missed ? FOCUS_SCENE_CHANGED : verdict_of(self));
}

// ---- the peak, at rest at several positions

static double stop_position(const struct focus_search *self, unsigned stop) {
    const double half = (self->pass_max - self->pass_min) / 2;
    const double middle = (self->pass_max + self->pass_min) / 2;
    return middle + approach_side(self) * half * (1 - 2.0 * stop / (STOPS - 1));
}

static struct focus_step go_to_stop(struct focus_search *self) {
    self->phase = FOCUS_SEARCH_STOP;
    self->target = within_range(self, stop_position(self, self->stops));
    return (struct focus_step){FOCUS_STEP_APPROACH, FOCUS_LEG_REST, self->target, 0, 0, false};
}

static struct focus_step begin_stops(struct focus_search *self) {
    const struct focus_peak *peak = &self->result.peak;
    const double half =
        math_max(math_max(1.2 * peak->half_width, self->options.counts_per_exposure),
                 2 * self->options.tolerance);
    self->pass_min = within_range(self, peak->position - half);
    self->pass_max = within_range(self, peak->position + half);
    self->stops = 0;
    self->passes++;
    return go_to_stop(self);
}

// ---- the peak, in passing

static struct focus_step begin_pass(struct focus_search *self, double half) {
    const struct focus_peak *peak = &self->result.peak;
    self->pass_min = within_range(self, peak->position - half);
    self->pass_max = within_range(self, peak->position + half);
    self->passes++;
    self->phase = FOCUS_SEARCH_TO_PASS;
    const double start = approach_side(self) > 0 ? self->pass_max : self->pass_min;
    return move_to(self, start + approach_side(self) * self->options.run_up);
}

static struct focus_step pass(struct focus_search *self) {
    const double from = approach_side(self) > 0 ? self->pass_max : self->pass_min;
    const double to = approach_side(self) > 0 ? self->pass_min : self->pass_max;
    const double spacing =
        math_max(self->options.counts_per_frame,
                 fabs(from - to) / (self->near_only ? NEAR_PASS_SAMPLES : PASS_SAMPLES));
    self->phase = FOCUS_SEARCH_PASS;
    return sweep(self, FOCUS_LEG_PASS, to, spacing);
}

// ---- after the sweep

// Whether a peak shows that frames of the full exposure may confirm.
static bool has_hidden_peak(struct focus_search *self) {
    const struct focus_search_options *options = &self->options;
    return !self->slow && options->noise_ratio > 1 && !options->curve_only &&
           focus_find_hidden(self, &self->result.peak);
}

static struct focus_step no_peak(struct focus_search *self, const struct focus_event *event,
                                 const struct focus_peak *peak) {
    const struct focus_search_options *options = &self->options;
    const double blur_px = (options->max - options->min) / 2 * options->blur_per_count_px;
    struct focus_peak *wide_peak = &self->result.peak;
    if (self->near_only) {
        return begin_cold(self, event->position);
    }
    if (has_hidden_peak(self)) {
        self->slow = true;
        self->result.second.height = 0;
        return begin_stops(self);
    }
    self->wide = focus_find_wide_peak(self, seen_curvature, wide_peak);
    const bool textured = peak->floor > 4 * focus_find_least(self, self->finder);
    // Of a lens that is not known a guess may be far off.
    if (!self->wide && textured && options->blur_per_count_px <= 0) {
        return finish_at_start(self, FOCUS_SHARP_EVERYWHERE);
    }
    // Texture everywhere, and no lens position that blurs it much: the best guess.
    if (!self->wide && textured && blur_px < 4 * sharp_px) {
        self->wide = self->guessed = true;
        if (!focus_find_wide_peak(self, guessed_curvature, wide_peak)) {
            wide_peak->position = (options->min + options->max) / 2;
            wide_peak->deviation = (options->max - options->min) / 4;
        }
    }
    if (!self->wide) {
        return finish_at_start(self, FOCUS_NO_CONTRAST);
    }
    wide_peak->at_edge = false;
    self->result.second.height = 0;
    return options->curve_only ? finish_at_start(self, verdict_of(self))
                               : approach(self, wide_peak->position);
}

// A sweep for its curve only.
static struct focus_step end_curve(struct focus_search *self) {
    const struct focus_range range =
        focus_find_range(1u << FOCUS_LEG_SWEEP, self->finder, self->options.min, self->options.max);
    (void)focus_curve_fit(&self->curve, &range, &self->result.peak);
    return finish_at_start(self, verdict_of(self));
}

// Whether the sweep itself shows where the top is: it came from the side of approach, with many
// samples. Sets the peak.
static bool is_located(struct focus_search *self, bool same_way, double near) {
    struct focus_peak *peak = &self->result.peak;
    const double min = peak->position - near, max = peak->position + near;
    struct focus_peak top;
    if (!same_way || peak->samples < PEAK_SAMPLES ||
        !focus_find_subject(self, FOCUS_LEG_SWEEP, min, max) ||
        !focus_find_top(self, FOCUS_LEG_SWEEP, min, max, good_counts(self), &top) ||
        top.samples < PEAK_SAMPLES) {
        return false;
    }
    *peak = top;
    return true;
}

static struct focus_step after_sweep(struct focus_search *self, const struct focus_event *event) {
    const struct focus_search_options *options = &self->options;
    struct focus_peak *peak = &self->result.peak;
    focus_find_learn(self);
    const bool found = focus_find_choose(self);
    if (focus_find_peaks(self, peak) == 0) {
        return finish_at_start(self, FOCUS_NO_CONTRAST);
    }
    if (!found) {
        return no_peak(self, event, peak);
    }
    if (peak->at_edge && self->near_only && !is_at_end(self, peak->position)) {
        return begin_cold(self, event->position);
    }
    if (options->curve_only) {
        return end_curve(self);
    }
    if (options->counts_per_exposure > math_max(smeared_counts, 1.5 * peak->half_width)) {
        return begin_stops(self);
    }
    const bool same_way = (self->sweep_end < peak->position) == options->from_above;
    const double near = math_max(2 * peak->half_width, 2 * self->spacing);
    if (is_located(self, same_way, near)) {
        return approach(self, peak->position);
    }
    return begin_pass(self, near + (same_way ? options->tolerance : options->run_up));
}

// The peak of this pass, or of these stops.
static struct focus_step after_pass(struct focus_search *self, const struct focus_event *event,
                                    enum focus_leg leg) {
    const struct focus_search_options *options = &self->options;
    const double beyond = options->run_up;
    const struct focus_range range =
        focus_find_range(1u << leg, self->finder, self->pass_min - beyond, self->pass_max + beyond);
    struct focus_peak peaks[2];
    if (focus_curve_peaks(&self->curve, &range, peaks) == 0) {
        return finish_at_start(self, FOCUS_SCENE_CHANGED);
    }
    if (self->slow) {
        focus_find_learn_rest(self, range.min, range.max);
    }
    // A pass does not go far enough to see the floor.
    struct focus_peak peak = peaks[0];
    peak.floor = math_min(self->floors[self->finder], peak.floor);
    if (!focus_find_subject(self, leg, range.min, range.max)) {
        return no_peak(self, event, &peak);
    }
    self->channel = self->finder;
    const bool fits = focus_find_top(self, leg, range.min, range.max, good_counts(self), &peak);
    self->result.peak = peak;
    if (peak.at_edge && !is_at_end(self, peak.position) && self->passes < PASSES) {
        return leg == FOCUS_LEG_REST ? begin_stops(self)
                                     : begin_pass(self, (self->pass_max - self->pass_min) / 2 + 1);
    }
    if (!fits && leg == FOCUS_LEG_PASS && self->passes < PASSES) {
        return begin_stops(self);
    }
    return approach(self, peak.position);
}

static struct focus_step next_step(struct focus_search *self, const struct focus_event *event) {
    if (event->jammed) {
        self->result.verdict = FOCUS_LENS_JAMMED;
        return end(self, event);
    }
    switch (self->phase) {
        case FOCUS_SEARCH_TO_START:
            self->phase = FOCUS_SEARCH_SWEEP;
            self->spacing = sweep_spacing(self, fabs(self->sweep_end - event->position));
            return sweep(self, FOCUS_LEG_SWEEP, self->sweep_end, self->spacing);
        case FOCUS_SEARCH_SWEEP:
            return after_sweep(self, event);
        case FOCUS_SEARCH_TO_PASS:
            return pass(self);
        case FOCUS_SEARCH_PASS:
            return after_pass(self, event, FOCUS_LEG_PASS);
        case FOCUS_SEARCH_STOP:
            return look(self, FOCUS_SEARCH_STOP_LOOK);
        case FOCUS_SEARCH_STOP_LOOK:
            return ++self->stops < STOPS ? go_to_stop(self)
                                         : after_pass(self, event, FOCUS_LEG_REST);
        case FOCUS_SEARCH_APPROACH:
            self->result.tries++;
            return look(self, FOCUS_SEARCH_LOOK);
        case FOCUS_SEARCH_LOOK:
            return judge(self, event);
        case FOCUS_SEARCH_RETURN:
        case FOCUS_SEARCH_END:
            break;
    }
    return end(self, event);
}

struct focus_step focus_search_next(struct focus_search *self, const struct focus_event *event) {
    INVARIANT(self->phase != FOCUS_SEARCH_END);
    struct focus_step step = next_step(self, event);
    step.slow = self->slow;
    return step;
}
