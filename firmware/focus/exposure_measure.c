// SPDX-License-Identifier: Apache-2.0
#include "focus/exposure_measure.h"

#include "core/invariant.h"
#include "core/math.h"

enum {
    BIN_BITS = 10,
    END_SHIFT = 6,  // same as in picture_stats: some cameras clip slightly below full scale
};

static const double white_part = 0.01;
// The fall-off is that between the saturated part and the values below up to so many times it.
static const double tail = 4;
// The least excess: boldly more than what is likely. A picture that is too dark then is measured
// as well as a right one, a saturated one is not.
static const double excess_min = 1.02, excess_slope = 16, nearly_all = 0.95, excess_of_all = 64;

int exposure_first_green(enum raw_layout layout, int row) {
    if (layout == RAW_RGB) {
        return 1;
    }
    return layout == RAW_BAYER_GRBG ? row & 1 : 0;
}

int exposure_green_step(enum raw_layout layout) {
    if (layout == RAW_RGB) {
        return 3;
    }
    return layout == RAW_BAYER_GRBG ? 2 : 1;
}

void exposure_histogram_begin(struct exposure_histogram *self, enum raw_layout layout, int bits,
                              uint16_t black) {
    INVARIANT(bits >= 8 && bits <= 16 && black < (1 << bits) / 2);
    *self = (struct exposure_histogram){.layout = layout, .bits = bits, .black = black};
}

void exposure_histogram_row(struct exposure_histogram *self, const uint16_t *row, int width_px,
                            int y) {
    INVARIANT(width_px > 0 && y >= 0);
    const int count = self->layout == RAW_RGB ? 3 * width_px : width_px;
    const int shift = self->bits > BIN_BITS ? self->bits - BIN_BITS : 0;
    for (int i = 0; i < count; i++) {
        // A camera may set bits outside its range.
        const int bin = row[i] >> shift;
        self->bins[bin < EXPOSURE_BINS ? bin : EXPOSURE_BINS - 1]++;
    }
    const int step = exposure_green_step(self->layout);
    uint64_t sum = 0;
    int greens = 0;
    for (int i = exposure_first_green(self->layout, y); i < count; i += step, greens++) {
        sum += row[i];
    }
    self->values += (uint64_t)count;
    self->greens += (uint64_t)greens;
    self->green_sum += sum;
}

// The lowest bin above which at most this part of all values is.
static int bin_of(const struct exposure_histogram *self, double part) {
    const double allowed = part * (double)self->values;
    uint64_t above = 0;
    int bin = EXPOSURE_BINS - 1;
    while (bin > 0 && (double)(above + self->bins[bin]) <= allowed) {
        above += self->bins[bin];
        bin--;
    }
    return bin;
}

// How far a bin lies from black to full scale.
static double part_of(const struct exposure_histogram *self, int bin) {
    const int shift = self->bits > BIN_BITS ? self->bits - BIN_BITS : 0;
    const double full = (double)((1 << self->bits) - 1);
    const double value = (double)bin * (double)(1 << shift);
    const double part = (value - self->black) / (full - self->black);
    return part < 0 ? 0 : part;
}

static double odds(double part) {
    return (1 - part) / part;
}

// Brightness falls off like a log-logistic distribution: its logarithm is linear in that of the
// odds. Heavier than the normal one, so the guess is rather too large.
static double excess_of(const struct exposure_histogram *self, double saturated, double full) {
    const double wider =
        saturated * tail < (1 + saturated) / 2 ? saturated * tail : (1 + saturated) / 2;
    const double lower = saturated < 1 ? part_of(self, bin_of(self, wider)) : full;
    if (lower >= full) {
        return EXPOSURE_EXCESS_MAX;
    }
    const double floor = full / EXPOSURE_EXCESS_MAX;
    const double slope =
        math_log(full / (lower > floor ? lower : floor)) / math_log(odds(saturated) / odds(wider));
    const double power = slope * math_log(odds(EXPOSURE_SATURATED_MAX) / odds(saturated));
    INVARIANT(power >= 0);
    const double excess =
        power < math_log(EXPOSURE_EXCESS_MAX) ? math_exp(power) : EXPOSURE_EXCESS_MAX;
    const double min =
        saturated < nearly_all ? excess_min + excess_slope * saturated : excess_of_all;
    return excess > min ? excess : min;
}

struct exposure_measure exposure_histogram_end(const struct exposure_histogram *self) {
    INVARIANT(self->values > 0 && self->greens > 0);
    const int top = self->bits < BIN_BITS ? (1 << self->bits) - 1 : EXPOSURE_BINS - 1;
    const int saturated_bin = top - (top >> END_SHIFT);
    uint64_t saturated = 0;
    for (int bin = saturated_bin; bin < EXPOSURE_BINS; bin++) {
        saturated += self->bins[bin];
    }
    const double full = (double)((1 << self->bits) - 1);
    const double mean = (double)self->green_sum / (double)self->greens;
    struct exposure_measure measure = {
        .mean = mean > self->black ? (mean - self->black) / (full - self->black) : 0,
        .saturated = (double)saturated / (double)self->values,
        .high = part_of(self, bin_of(self, EXPOSURE_SATURATED_MAX)),
        .white = part_of(self, bin_of(self, white_part)),
        .excess = 1,
    };
    if (measure.saturated > EXPOSURE_SATURATED_MAX) {
        measure.excess = excess_of(self, measure.saturated, part_of(self, saturated_bin));
    }
    return measure;
}
