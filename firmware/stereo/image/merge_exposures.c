// SPDX-License-Identifier: Apache-2.0
#include "stereo/image/merge_exposures.h"

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/image/sensor_noise.h"

enum {
    COUNT_SHIFT = 25,
    SUM_MAX = (1 << COUNT_SHIFT) - 1,
    RATIO_SHIFT = 16,
    SATURATED_SHIFT = 6,
    // A longer exposure counts where it is predicted to stay below this part of the range.
    USABLE_PARTS = 15,
    ALL_PARTS = 16,
    DESIGN_PARTS = 16,  // 1/n of the range: the signal that the weights are best for
    SQUARE = 4,
    VALUES = SQUARE * SQUARE,
    SIGMAS = 5,
    OCTAVES = MERGE_BITS + 1,
    DARK_PARTS = 50,
    SATURATED_PARTS = 333,
    USABLE_DARK_PARTS = 8,  // 1/n of the range: signal of the dark pixels in the longest exposure
    FACTOR_MIN = 2,
    FACTOR_MAX = 8,
};

// From here on a value is saturated: a full well has a little less than the greatest value, and the
// noise of reading.
static uint32_t full_of(const struct raw_image *form) {
    const uint32_t max = (1u << form->bits) - 1;
    return max - (max >> SATURATED_SHIFT);
}

static uint64_t light_of(const struct merge_exposure *exposure) {
    return (uint64_t)exposure->exposure_us * exposure->gain_q3;
}

// Exposure as a multiple of the first one, in 1/65536; 0: out of range.
static uint64_t ratio_q16(const struct merge_plan *plan, const struct merge_exposure *exposure) {
    const uint64_t first = light_of(&plan->first), own = light_of(exposure);
    const uint64_t one = UINT64_C(1) << RATIO_SHIFT;
    if (first == own) {
        return one;
    }
    if (first == 0 || plan->black == 0 || own / first >= MERGE_RATIO_MAX) {
        return 0;
    }
    return (own << RATIO_SHIFT) / first;
}

size_t merge_exposures_values(const struct raw_image *form) {
    INVARIANT(form->width_px > 0 && form->height_px > 0);
    return raw_image_row_values(form) * (size_t)form->height_px;
}

// Of least variance at the design signal, but for a common factor.
static double weight_of(const struct merge_plan *plan, double ratio, double last_ratio,
                        uint16_t known_gain_q3) {
    const uint64_t gain_q3 = sensor_noise_gain_q3(known_gain_q3);
    const double light =
        (double)(full_of(&plan->form) - plan->black) / DESIGN_PARTS * ratio / last_ratio;
    const double noise_q6 =
        light * (double)sensor_noise_of_light_q6(plan->form.bits, gain_q3, 1024) / 1024 +
        (double)sensor_noise_of_reading_q6(plan->form.bits, gain_q3, 1);
    return ratio / noise_q6;
}

static double last_ratio(const struct merge_plan *plan) {
    return (double)ratio_q16(plan, &plan->last) / (1 << RATIO_SHIFT);
}

int merge_exposures_begin(struct merge_exposures *self, const struct merge_plan *plan,
                          uint32_t *sums) {
    INVARIANT(plan->frames >= 1 && plan->frames <= MERGE_FRAMES_MAX && sums != NULL);
    INVARIANT(plan->form.bits >= 8 && plan->form.bits <= MERGE_BITS);
    INVARIANT(plan->black < full_of(&plan->form));
    if (ratio_q16(plan, &plan->last) < UINT64_C(1) << RATIO_SHIFT) {
        return ERROR_RANGE;
    }
    *self = (struct merge_exposures){.plan = *plan, .sums = sums};
    // So that all sums fit, even if every weight is the greatest: that of the first or the last.
    const double last = last_ratio(plan);
    const double of_first = weight_of(plan, 1, last, plan->first.gain_q3);
    const double of_last = weight_of(plan, last, last, plan->last.gain_q3);
    const uint32_t max = SUM_MAX / (full_of(&plan->form) * plan->frames);
    self->weight_scale = max / (of_first > of_last ? of_first : of_last);
    INVARIANT(max >= 1);
    const size_t values = merge_exposures_values(&plan->form);
    for (size_t i = 0; i < values; i++) {
        sums[i] = 0;
    }
    return ERROR_OK;
}

// ---- comparison of a frame with what is predicted

// A prediction: signal of a square = sum of its sums' signals * numerator / denominator.
struct prediction {
    uint64_t numerator, denominator;
    // Noise of the prediction as that of a frame with these gains, of light and of reading.
    uint64_t light_gain_q8, reading_gain_q8;
};

static bool differs(const struct merge_plan *plan, const struct prediction *prediction,
                    uint64_t gain_q3, int64_t sum, int64_t signal) {
    const int bits = plan->form.bits;
    const int64_t numerator = (int64_t)prediction->numerator;
    const int64_t denominator = (int64_t)prediction->denominator;
    const int64_t predicted = sum * numerator / denominator;
    const int64_t apart_q3 = (signal * denominator - sum * numerator) / (denominator / 8);
    const uint64_t light = predicted > 0 ? (uint64_t)predicted : 0;
    const uint64_t noise_q6 =
        sensor_noise_of_light_q6(bits, gain_q3, light) +
        sensor_noise_of_reading_q6(bits, gain_q3, VALUES) +
        (sensor_noise_of_light_q6(bits, 1, light) * prediction->light_gain_q8 >> 8) +
        (sensor_noise_of_reading_q6(bits, 1, VALUES) * prediction->reading_gain_q8 >> 8);
    return (uint64_t)(apart_q3 * apart_q3) > SIGMAS * SIGMAS * noise_q6;
}

static struct prediction predict(const struct merge_exposures *self, uint64_t ratio) {
    const struct merge_prefix *prefix = &self->prefix[self->frames];
    INVARIANT(prefix->exposure_q16 > 0);
    const double weighted = (double)prefix->exposure_q16 / (1 << RATIO_SHIFT);
    const double part = (double)ratio / (double)prefix->exposure_q16;
    return (struct prediction){
        .numerator = ratio,
        .denominator = prefix->exposure_q16,
        .light_gain_q8 = (uint64_t)(256 * part * self->light / weighted) + 1,
        .reading_gain_q8 = (uint64_t)(256 * part * part * self->reading) + 1,
    };
}

struct squares {
    uint64_t compared, changed;
};

static uint32_t permille_of(const struct squares *squares) {
    INVARIANT(squares->changed <= squares->compared);
    return squares->compared == 0 ? 0 : (uint32_t)(squares->changed * 1000 / squares->compared);
}

// Whether no value is saturated, here or in an earlier frame; if so, sets the sums of a square.
static bool add_square(const struct merge_exposures *self, const struct raw_image *frame, int row,
                       size_t column, int64_t *sum, int64_t *signal) {
    const size_t width = raw_image_row_values(frame);
    const uint32_t full = full_of(frame);
    const int64_t black = self->plan.black;
    const int64_t weights = self->prefix[self->frames].weights;
    *sum = -VALUES * black * weights;
    *signal = -VALUES * black;
    for (int y = row; y < row + SQUARE; y++) {
        const uint16_t *values = raw_image_row(frame, y) + column;
        const uint32_t *sums = self->sums + (size_t)y * width + column;
        for (unsigned i = 0; i < SQUARE; i++) {
            if (values[i] >= full || sums[i] >> COUNT_SHIFT != self->frames) {
                return false;
            }
            *sum += sums[i] & SUM_MAX;
            *signal += values[i];
        }
    }
    return true;
}

static uint32_t compare(const struct merge_exposures *self, const struct raw_image *frame,
                        uint64_t ratio, uint16_t gain_q3) {
    const struct prediction prediction = predict(self, ratio);
    const uint64_t gain = sensor_noise_gain_q3(gain_q3);
    const size_t width = raw_image_row_values(frame);
    struct squares squares = {0, 0};
    for (int row = 0; row + SQUARE <= frame->height_px; row += SQUARE) {
        for (size_t column = 0; column + SQUARE <= width; column += SQUARE) {
            int64_t sum = 0, signal = 0;
            if (add_square(self, frame, row, column, &sum, &signal)) {
                squares.compared++;
                squares.changed += differs(&self->plan, &prediction, gain, sum, signal);
            }
        }
    }
    return permille_of(&squares);
}

// ---- the sums

// The greatest sum that predicts a usable signal in this frame.
static uint32_t max_sum(const struct merge_exposures *self, uint64_t ratio) {
    const struct merge_prefix *prefix = &self->prefix[self->frames];
    const uint32_t range = full_of(&self->plan.form) - self->plan.black;
    if (self->frames == 0 || ratio == self->last_ratio_q16) {
        return SUM_MAX;  // a value that was not saturated before is not predicted to be
    }
    const uint64_t usable = (uint64_t)range * USABLE_PARTS / ALL_PARTS;
    const uint64_t sum =
        (uint64_t)self->plan.black * prefix->weights + usable * prefix->exposure_q16 / ratio;
    return sum < SUM_MAX ? (uint32_t)sum : SUM_MAX;
}

static void add_values(struct merge_exposures *self, const struct raw_image *frame, uint32_t weight,
                       uint32_t max) {
    const size_t width = raw_image_row_values(frame);
    const uint32_t full = full_of(frame), frames = self->frames;
    for (int y = 0; y < frame->height_px; y++) {
        const uint16_t *values = raw_image_row(frame, y);
        uint32_t *sums = self->sums + (size_t)y * width;
        for (size_t x = 0; x < width; x++) {
            const uint32_t sum = sums[x] & SUM_MAX;
            const bool counts = sums[x] >> COUNT_SHIFT == frames && sum <= max && values[x] < full;
            sums[x] = counts ? (frames + 1) << COUNT_SHIFT | (sum + weight * values[x]) : sums[x];
        }
    }
}

int merge_exposures_add(struct merge_exposures *self, const struct raw_image *frame,
                        const struct merge_exposure *exposure, uint32_t *changed_permille) {
    const struct merge_plan *plan = &self->plan;
    const struct merge_prefix *before = &self->prefix[self->frames];
    INVARIANT(self->frames < plan->frames && frame->bits == plan->form.bits);
    INVARIANT(merge_exposures_values(frame) == merge_exposures_values(&plan->form));
    const uint64_t ratio = ratio_q16(plan, exposure);
    if (ratio < UINT64_C(1) << RATIO_SHIFT || ratio < self->last_ratio_q16) {
        return ERROR_RANGE;
    }
    *changed_permille = self->frames == 0 ? 0 : compare(self, frame, ratio, exposure->gain_q3);
    const double part = (double)ratio / (1 << RATIO_SHIFT);
    const double scaled =
        weight_of(plan, part, last_ratio(plan), exposure->gain_q3) * self->weight_scale + 0.5;
    const uint32_t greatest = SUM_MAX / (full_of(frame) * plan->frames);
    const uint32_t weight = (uint32_t)math_clamp(scaled, 1, greatest);
    add_values(self, frame, weight, max_sum(self, ratio));
    const double gain = (double)sensor_noise_gain_q3(exposure->gain_q3);
    self->light += (double)weight * weight * gain * part;
    self->reading += (double)weight * weight * gain * gain;
    self->prefix[self->frames + 1] =
        (struct merge_prefix){before->exposure_q16 + weight * ratio, before->weights + weight};
    self->last_ratio_q16 = ratio;
    self->frames++;
    return ERROR_OK;
}

// ---- the merged image

static uint32_t black_of(const struct merge_plan *plan) {
    return plan->black != 0 ? MERGE_BLACK : 0;
}

void merge_exposures_end(const struct merge_exposures *self, uint16_t *merged) {
    enum { SHIFT = 32, MAX = UINT16_MAX };
    const struct merge_plan *plan = &self->plan;
    const uint32_t black = black_of(plan);
    const uint64_t range = full_of(&plan->form) - plan->black;
    const size_t values = merge_exposures_values(&plan->form);
    // Of each number of frames: merged = (sum * factor + offset) / 2^32.
    int64_t factor[MERGE_FRAMES_MAX + 1], offset[MERGE_FRAMES_MAX + 1];
    INVARIANT(self->frames >= 1 && self->frames <= MERGE_FRAMES_MAX);
    factor[0] = 0;  // saturated
    offset[0] = (int64_t)MAX << SHIFT;
    for (unsigned i = 1; i <= self->frames; i++) {
        const struct merge_prefix *prefix = &self->prefix[i];
        factor[i] = (int64_t)(((uint64_t)(MAX - black) << (SHIFT + RATIO_SHIFT - 1)) /
                              (range * prefix->exposure_q16 >> 1));
        offset[i] = ((int64_t)black << SHIFT) + (INT64_C(1) << (SHIFT - 1)) -
                    (int64_t)plan->black * prefix->weights * factor[i];
    }
    for (size_t i = 0; i < values; i++) {
        const uint32_t frames = self->sums[i] >> COUNT_SHIFT;
        const int64_t scaled = (int64_t)(self->sums[i] & SUM_MAX) * factor[frames] + offset[frames];
        const int64_t value = scaled < 0 ? 0 : scaled >> SHIFT;
        merged[i] = (uint16_t)(value < MAX ? value : MAX);
    }
}

uint32_t merge_exposures_changed(const struct merge_plan *plan, const struct raw_image *merged,
                                 const struct raw_image *frame,
                                 const struct merge_exposure *exposure) {
    const size_t width = raw_image_row_values(frame);
    const uint64_t range = full_of(frame) - plan->black, ratio = ratio_q16(plan, exposure);
    const uint64_t gain_q3 = sensor_noise_gain_q3(exposure->gain_q3);
    const int64_t black = black_of(plan);
    const uint32_t full = full_of(frame);
    INVARIANT(ratio > 0 && merged->bits == MERGE_BITS && raw_image_row_values(merged) == width);
    // The merged image has no more noise than a frame.
    const struct prediction prediction = {
        .numerator = range * ratio,
        .denominator = (uint64_t)(UINT16_MAX - black) << RATIO_SHIFT,
        .light_gain_q8 = gain_q3 << 8,
        .reading_gain_q8 = gain_q3 * gain_q3 << 8,
    };
    struct squares squares = {0, 0};
    for (int row = 0; row + SQUARE <= frame->height_px; row += SQUARE) {
        for (size_t column = 0; column + SQUARE <= width; column += SQUARE) {
            int64_t sum = -VALUES * black, signal = -VALUES * (int64_t)plan->black;
            bool whole = true;
            for (int y = row; y < row + SQUARE; y++) {
                const uint16_t *values = raw_image_row(frame, y) + column;
                const uint16_t *means = raw_image_row(merged, y) + column;
                for (unsigned i = 0; i < SQUARE; i++) {
                    whole = whole && values[i] < full && means[i] < UINT16_MAX;
                    sum += means[i];
                    signal += values[i];
                }
            }
            squares.compared += whole;
            squares.changed += whole && differs(plan, &prediction, gain_q3, sum, signal);
        }
    }
    return permille_of(&squares);
}

// ---- which exposures

// Light of a value in octaves: 0 for none, n for less than 2^n.
static unsigned octave_of(uint32_t light) {
    unsigned octave = 0;
    while (light >> octave != 0) {
        octave++;
    }
    return octave;
}

// At most FACTOR_MAX ^ 6 is of interest.
static uint64_t power_of(uint64_t factor, unsigned steps) {
    uint64_t power = 1;
    for (unsigned i = 0; i < steps && power <= MERGE_RATIO_MAX; i++) {
        power *= factor;
    }
    return power;
}

// Counts the values by octaves above black; returns the number of saturated ones.
static uint64_t count_octaves(const struct raw_image *frame, uint16_t black,
                              uint64_t counts[OCTAVES]) {
    const uint32_t full = full_of(frame);
    uint64_t saturated = 0;
    for (int y = 0; y < frame->height_px; y++) {
        const uint16_t *row = raw_image_row(frame, y);
        for (size_t x = 0; x < raw_image_row_values(frame); x++) {
            counts[octave_of(row[x] > black ? row[x] - (uint32_t)black : 0)]++;
            saturated += row[x] >= full;
        }
    }
    return saturated;
}

struct merge_bracket merge_bracket_for(const struct raw_image *frame, uint16_t black,
                                       unsigned exposures) {
    const uint32_t full = full_of(frame);
    const uint64_t values = merge_exposures_values(frame);
    uint64_t counts[OCTAVES] = {0};
    INVARIANT(exposures >= 2 && exposures <= MERGE_FRAMES_MAX && black < full);
    const uint64_t saturated = count_octaves(frame, black, counts);
    unsigned octave = 0;
    for (uint64_t below = counts[0]; below * DARK_PARTS < values; below += counts[octave]) {
        octave++;
    }
    INVARIANT(octave < OCTAVES);
    // The middle of the octave, times two.
    const uint64_t dark_q1 = octave == 0 ? 1 : (UINT64_C(3) << octave) / 2;
    const uint64_t wanted = (uint64_t)(full - black) * 2 / USABLE_DARK_PARTS / dark_q1;
    const bool shorter = saturated * SATURATED_PARTS > values;
    const unsigned steps = exposures - 1 - (shorter ? 1 : 0);
    uint8_t factor = FACTOR_MIN;
    while (steps > 0 && factor < FACTOR_MAX && power_of(factor, steps) < wanted) {
        factor++;
    }
    // Two exposures, of which the longer one is the frame's, have no such wish.
    return (struct merge_bracket){steps > 0 ? factor : FACTOR_MAX / 2, shorter};
}
