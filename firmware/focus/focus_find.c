// SPDX-License-Identifier: Apache-2.0
#include "focus/focus_find.h"

#include <math.h>

#include "core/invariant.h"
#include "core/math.h"

// A fine texture's sharpness falls to half at this diameter of the blur, in each direction.
static const double narrow_blur_px = 2;
// Contrast of a subject, as rms: a part of the noise of one value, and of the brightness. A quarter
// of its square is enough where the peak is seen in passing.
static const double noise_part = 0.9, relative_contrast = 0.01;
// Peaks stand out by this many deviations of the curve. Flickering light and bright objects beside
// the region mislead the variance more than gradients.
static const double significant[FOCUS_CHANNELS] = {
    [FOCUS_CHANNEL_CHOSEN] = 15, [FOCUS_CHANNEL_TENENGRAD] = 8, [FOCUS_CHANNEL_LAPLACIAN] = 15};
// Of a peak that may be one: by chance one search in a thousand shows such a peak.
static const double hidden = 5;
// What is not focus, as a camera's own processing and light that drifts, changes the sharpness by
// up to this part of it, as smoothly as a peak.
static const double drift_part = 0.1;
// Of that width, as the positions are known with errors.
static const double narrowest_part = 0.4;
// A peak that is wider, in sizes of the region, comes from bright objects beside it.
static const double widest_regions = 2;
// A measure that locates the top within this part of what is good enough needs no help.
static const double located_part = 0.25;
// Light is compared within so many half widths of a peak, in so many steps. It may differ by this
// part (that of light which flickers, and that of light which is steady: which differs by less than
// `steady` from frame to frame), and by this value, as that of black does.
enum { LIGHTS_WIDTHS = 3, LIGHTS_BINS = 4 };
static const double flickering_part = 0.11, steady_part = 0.04, steady = 0.004, lights_values = 0.5;

// White noise of variance 1 in a channel's unit.
static double unit_of(const struct focus_search *self, enum focus_channel channel) {
    static const double units[FOCUS_MEASURES] = {[FOCUS_VARIANCE] = 1,
                                                 [FOCUS_NORMALIZED_VARIANCE] = 1,
                                                 [FOCUS_TENENGRAD] = 24,
                                                 [FOCUS_LAPLACIAN] = 20};
    if (channel == FOCUS_CHANNEL_TENENGRAD) {
        return units[FOCUS_TENENGRAD];
    }
    return units[channel == FOCUS_CHANNEL_LAPLACIAN ? FOCUS_LAPLACIAN : self->options.measure];
}

// The least relative variance of a subject.
static double contrast_min(const struct focus_search *self) {
    double noise = 0;
    for (unsigned i = 0; i < self->curve.count; i++) {
        noise = math_max(noise, self->curve.samples[i].noise);
    }
    return math_max(noise_part * noise_part * noise / self->options.noise_ratio,
                    relative_contrast * relative_contrast);
}

// Whether a peak stands out from its floor by more than a drift.
static bool stands_out(const struct focus_peak *peak) {
    return peak->height - peak->floor >= drift_part * peak->height;
}

static bool has_contrast(const struct focus_search *self, enum focus_channel channel,
                         const struct focus_peak *peak, double part) {
    const double least = part * contrast_min(self) * unit_of(self, channel);
    // A short sweep hardly shows the floor.
    const double noise = (self->near_only ? 0.5 : 1) * self->noises[channel];
    return (self->near_only || stands_out(peak)) &&
           peak->height - peak->floor >= math_max(least, significant[channel] * noise);
}

// Bright objects beside the region blur into it, and show a wide peak where nothing is sharp.
static bool is_too_wide(const struct focus_search *self, const struct focus_peak *peak) {
    const double blur_px = 2 * peak->half_width * self->options.blur_per_count_px;
    return self->options.region_px > 0 && blur_px > widest_regions * self->options.region_px;
}

// No subject's peak is narrower; flickering light makes such ones.
static bool is_too_narrow(const struct focus_search *self, const struct focus_peak *peak) {
    const double px = self->options.blur_per_count_px;
    return px > 0 && peak->half_width * px < narrowest_part * narrow_blur_px;
}

struct focus_range focus_find_range(unsigned legs, enum focus_channel channel, double min,
                                    double max) {
    return (struct focus_range){legs, channel, (float)min, (float)max};
}

void focus_find_learn(struct focus_search *self) {
    for (int channel = 0; channel < FOCUS_CHANNELS; channel++) {
        const struct focus_range range =
            focus_find_range(1u << FOCUS_LEG_SWEEP, (enum focus_channel)channel, self->options.min,
                             self->options.max);
        struct focus_peak peaks[2] = {{.floor = 0}};
        (void)focus_curve_peaks(&self->curve, &range, peaks);
        self->floors[channel] = peaks[0].floor;
        self->noises[channel] = focus_curve_noise(&self->curve, &range);
    }
}

// The finest measures first.
static const enum focus_channel finest[FOCUS_CHANNELS] = {
    FOCUS_CHANNEL_LAPLACIAN, FOCUS_CHANNEL_TENENGRAD, FOCUS_CHANNEL_CHOSEN};

// The highest peak in a channel, above the floor of the sweep.
static bool peak_in(const struct focus_search *self, const struct focus_range *range,
                    struct focus_peak *peak) {
    struct focus_peak found[2];
    if (focus_curve_peaks(&self->curve, range, found) == 0) {
        return false;
    }
    *peak = found[0];
    peak->floor = math_min(peak->floor, self->floors[range->channel]);
    return true;
}

bool focus_find_top(struct focus_search *self, unsigned leg, double min, double max, double good,
                    struct focus_peak *peak) {
    double best = INFINITY;
    for (int i = 0; i < FOCUS_CHANNELS && best > located_part * good; i++) {
        const struct focus_range range = focus_find_range(1u << leg, finest[i], min, max);
        struct focus_peak found;
        if (!peak_in(self, &range, &found) || !has_contrast(self, finest[i], &found, 0) ||
            !focus_curve_fit(&self->curve, &range, &found) || is_too_narrow(self, &found)) {
            continue;
        }
        if (found.deviation < best) {
            best = found.deviation;
            self->channel = finest[i];
            *peak = found;
        }
    }
    return best < INFINITY;
}

bool focus_find_subject(const struct focus_search *self, unsigned leg, double min, double max) {
    for (int i = 0; i < FOCUS_CHANNELS; i++) {
        const struct focus_range range = focus_find_range(1u << leg, finest[i], min, max);
        struct focus_peak peak;
        if (peak_in(self, &range, &peak) && has_contrast(self, finest[i], &peak, 1) &&
            !is_too_narrow(self, &peak)) {
            return true;
        }
    }
    return false;
}

bool focus_find_wide_peak(struct focus_search *self, double least, struct focus_peak *peak) {
    bool found = false;
    for (int i = 0; i < FOCUS_CHANNELS; i++) {
        const struct focus_range range = focus_find_range(1u << FOCUS_LEG_SWEEP, finest[i],
                                                          self->options.min, self->options.max);
        struct focus_peak wide_peak;
        if (focus_curve_wide_peak(&self->curve, &range, least, &wide_peak) &&
            wide_peak.height >= contrast_min(self) * unit_of(self, finest[i]) &&
            stands_out(&wide_peak) && !is_too_wide(self, &wide_peak) &&
            (!found || wide_peak.deviation < peak->deviation)) {
            found = true;
            self->channel = finest[i];
            *peak = wide_peak;
        }
    }
    return found;
}

// The peak that is wanted first.
static unsigned choose(struct focus_search *self, struct focus_peak peaks[2]) {
    const bool nearer = peaks[1].position > peaks[0].position;
    const bool second = (self->options.choice == FOCUS_NEARER && nearer) ||
                        (self->options.choice == FOCUS_FARTHER && !nearer);
    self->result.second = second ? peaks[0] : peaks[1];
    return second ? 1 : 0;
}

bool focus_find_choose(struct focus_search *self) {
    for (int i = 0; i < FOCUS_CHANNELS; i++) {
        const struct focus_range range = focus_find_range(1u << FOCUS_LEG_SWEEP, finest[i],
                                                          self->options.min, self->options.max);
        struct focus_peak peak;
        if (peak_in(self, &range, &peak) && has_contrast(self, finest[i], &peak, 0.25) &&
            !is_too_wide(self, &peak)) {
            self->finder = finest[i];
            return true;
        }
    }
    self->finder = FOCUS_CHANNEL_CHOSEN;
    return false;
}

bool focus_find_hidden(struct focus_search *self, struct focus_peak *peak) {
    double best = hidden;
    for (int i = 0; i < FOCUS_CHANNELS; i++) {
        const struct focus_range range = focus_find_range(1u << FOCUS_LEG_SWEEP, finest[i],
                                                          self->options.min, self->options.max);
        struct focus_peak found;
        const double noise = self->noises[finest[i]];
        if (peak_in(self, &range, &found) && !is_too_wide(self, &found) &&
            found.height - found.floor > best * noise && noise > 0) {
            best = (found.height - found.floor) / noise;
            self->finder = finest[i];
            *peak = found;
        }
    }
    return best > hidden;
}

void focus_find_learn_rest(struct focus_search *self, double min, double max) {
    for (int channel = 0; channel < FOCUS_CHANNELS; channel++) {
        const struct focus_range range =
            focus_find_range(1u << FOCUS_LEG_REST, (enum focus_channel)channel, min, max);
        self->noises[channel] = focus_curve_noise(&self->curve, &range);
    }
}

unsigned focus_find_peaks(struct focus_search *self, struct focus_peak *peak) {
    const struct focus_range range =
        focus_find_range(1u << FOCUS_LEG_SWEEP, self->finder, self->options.min, self->options.max);
    struct focus_peak peaks[2];
    const unsigned count = focus_curve_peaks(&self->curve, &range, peaks);
    if (count > 0) {
        *peak = peaks[count == 2 ? choose(self, peaks) : 0];
    }
    return count;
}

double focus_find_least(const struct focus_search *self, enum focus_channel channel) {
    return contrast_min(self) * unit_of(self, channel);
}

// Mean light of the samples at these distances from a position; false: there are none.
static bool light_at(const struct focus_search *self, double position, double from, double to,
                     double *light) {
    double sum = 0;
    unsigned count = 0;
    for (unsigned i = 0; i < self->curve.count; i++) {
        const double off = self->curve.samples[i].position - position;
        if (off >= math_min(from, to) && off <= math_max(from, to)) {
            sum += self->curve.samples[i].mean;
            count++;
        }
    }
    *light = count > 0 ? sum / count : 0;
    return count > 0;
}

// By how much light may differ. That which lights bring into the region grows or falls steadily
// while the ring moves, and not at all while it stops.
static double light_part(const struct focus_search *self) {
    const struct focus_sample *samples = self->curve.samples;
    double moving = 0, resting = 0, light = 0;
    unsigned moves = 0, stops = 0;
    for (unsigned i = 1; i + 1 < self->curve.count; i++) {
        const double middle = samples[i].mean, next = samples[i + 1].mean;
        if (samples[i].leg == FOCUS_LEG_REST && samples[i].position == samples[i + 1].position) {
            resting += fabs(next - middle);
            stops++;
        } else if (samples[i].leg != FOCUS_LEG_REST) {
            moving += fabs(middle - (samples[i - 1].mean + next) / 2);
            moves++;
        }
        light += middle;
    }
    const double least = steady * light / math_max(moves + stops, 1);
    return moving <= least * moves && resting <= least * stops ? steady_part : flickering_part;
}

// Whether two amounts of light differ by more than this part and what black does.
static bool is_other_light(double a, double b, double part) {
    return fabs(a - b) > part * math_min(a, b) + lights_values;
}

bool focus_find_lights(const struct focus_search *self) {
    const struct focus_peak *peak = &self->result.peak;
    const double width = math_max(peak->half_width, self->options.tolerance),
                 part = light_part(self);
    double above = 0, below = 0, up = 0, down = 0, middle = 0;
    for (unsigned i = 0; i < self->curve.count; i++) {
        const double off = self->curve.samples[i].position - peak->position;
        up = math_max(up, off);
        down = math_max(down, -off);
    }
    const double reach = math_min(math_min(up, down), LIGHTS_WIDTHS * width);
    for (int i = 0; i < LIGHTS_BINS && reach > 0; i++) {
        const double from = reach * i / LIGHTS_BINS, to = reach * (i + 1) / LIGHTS_BINS;
        if (light_at(self, peak->position, from, to, &above) &&
            light_at(self, peak->position, -from, -to, &below) &&
            is_other_light(above, below, part)) {
            return true;
        }
    }
    const double side = up > down ? 1 : -1;
    return reach < width && light_at(self, peak->position, -width / 2, width / 2, &middle) &&
           light_at(self, peak->position, side * width, side * LIGHTS_WIDTHS * width, &above) &&
           is_other_light(above, middle, part);
}

double focus_find_at_peak(const struct focus_search *self, unsigned count, double *light) {
    static const double wide_counts = 4;  // narrower ones have their top between samples
    const struct focus_peak *peak = &self->result.peak;
    double highest = 0, sum = 0;
    unsigned seen = 0;
    INVARIANT(count <= self->curve.count);
    for (unsigned i = 0; i < count; i++) {
        const struct focus_sample *sample = &self->curve.samples[i];
        if (fabs(sample->position - peak->position) <= peak->half_width) {
            const double value = sample->sharpness[self->channel];
            highest = value > highest ? value : highest;
            sum += sample->mean;
            seen++;
        }
    }
    *light = seen > 0 ? sum / seen : 0;
    const bool capped = peak->half_width >= wide_counts && highest > peak->floor;
    return capped && highest < peak->height ? highest : peak->height;
}
