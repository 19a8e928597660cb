// SPDX-License-Identifier: Apache-2.0
#include "focus/focus_curve.h"

#include <math.h>
#include <stddef.h>

#include "core/invariant.h"
#include "core/math.h"
#include "core/order.h"

// Above this part of the height a reciprocal is close to a parabola for all textures, the closer
// the higher; this many samples are enough.
static const double fit_parts[] = {0.8, 0.65, 0.45, 0.2};
enum { FIT_PARTS = 4, FIT_SAMPLES = 7, FIT_REACH = 2, WIDE_PEAK_SAMPLES = 8, WIDE_PEAK_FITS = 3 };
// A second peak has this part of the height of the first, and the valley between both this part of
// the second. Repeating patterns have side lobes of a third: where the blur inverts them.
static const double second_part = 0.5, valley_part = 0.7;
// Closer ones may be one, seen at positions that are known with errors.
static const double apart_counts = 4;
// Frames also differ by light that flickers and by the position's error.
static const double relative_deviation = 0.01;

// Sharpness and its deviation from the energy of a measure.
static void set_channel(struct focus_sample *sample, enum focus_channel channel,
                        const struct focus_sharpness *sharpness, enum focus_measure measure) {
    const double mean = sharpness->mean_q8 / 256.0;
    const double bright = mean > 0.5 ? mean : 0.5;  // a lens cap makes the mean 0
    const double unit = measure == FOCUS_NORMALIZED_VARIANCE ? 1.0 / (1 << FOCUS_NORMALIZED_SHIFT)
                                                             : 1.0 / 256.0 / (bright * bright);
    const double value = (double)sharpness->energy * unit;
    const double noise = (double)sharpness->noise_energy * unit;
    const double count = sharpness->samples > 0 ? sharpness->samples : 1;
    // Neighbouring gradients share values.
    const double shared = measure == FOCUS_TENENGRAD || measure == FOCUS_LAPLACIAN ? 6.0 : 1.0;
    sample->sharpness[channel] = (float)value;
    sample->deviation[channel] =
        (float)sqrt(shared * (2 * noise * noise + 4 * noise * value) / count);
}

struct focus_sample focus_sample_of(const struct focus_window *window, enum focus_plane plane,
                                    enum focus_measure measure, const struct focus_noise *noise) {
    const enum focus_measure measures[FOCUS_CHANNELS] = {measure, FOCUS_TENENGRAD, FOCUS_LAPLACIAN};
    struct focus_sample sample = {.leg = FOCUS_LEG_SWEEP};
    for (int channel = 0; channel < FOCUS_CHANNELS; channel++) {
        const struct focus_sharpness sharpness =
            focus_measure_window(window, plane, measures[channel], noise);
        set_channel(&sample, (enum focus_channel)channel, &sharpness, measures[channel]);
        sample.mean = (float)(sharpness.mean_q8 / 256.0);
        sample.saturated_permille = sharpness.saturated_permille;
    }
    const double bright = sample.mean > 0.5F ? sample.mean : 0.5;
    const double variance =
        noise->read_q8 / 256.0 + sample.mean * (double)noise->shot_q16 / 65536.0;
    sample.noise = (float)(variance / (bright * bright));
    return sample;
}

static bool is_in(const struct focus_sample *sample, const struct focus_range *range) {
    return (range->legs >> sample->leg & 1) != 0 && sample->position >= range->min &&
           sample->position <= range->max;
}

// A sample in one channel.
struct point {
    double position, value, deviation;
};

// The samples of a range in the order of their positions.
static unsigned sorted(const struct focus_curve *curve, const struct focus_range *range,
                       struct point order[FOCUS_SAMPLES_MAX]) {
    unsigned count = 0;
    INVARIANT(curve->count <= FOCUS_SAMPLES_MAX);
    for (unsigned i = 0; i < curve->count; i++) {
        const struct focus_sample *sample = &curve->samples[i];
        unsigned at = count;
        if (!is_in(sample, range)) {
            continue;
        }
        for (; at > 0 && order[at - 1].position > sample->position; at--) {
            order[at] = order[at - 1];
        }
        order[at] = (struct point){sample->position, sample->sharpness[range->channel],
                                   sample->deviation[range->channel]};
        count++;
    }
    return count;
}

// The median of values, over `scale`. Sorts them.
static double median_over(double *values, unsigned count, double scale) {
    order_sort(values, count);
    return count > 0 ? values[count / 2] / scale : 0;
}

// Deviation of white noise from differences of neighbouring samples, which a curve hardly has. The
// medians of |difference| are 0.6745 times the roots of 6 and 70. Fourth differences also vanish on
// a peak of few samples.
static double roughness(const struct point *order, unsigned count) {
    double second[FOCUS_SAMPLES_MAX], fourth[FOCUS_SAMPLES_MAX];
    INVARIANT(count >= 3);
    for (unsigned i = 1; i + 1 < count; i++) {
        second[i - 1] = fabs(order[i - 1].value - 2 * order[i].value + order[i + 1].value);
    }
    for (unsigned i = 2; i + 2 < count; i++) {
        fourth[i - 2] = fabs(order[i - 2].value - 4 * order[i - 1].value + 6 * order[i].value -
                             4 * order[i + 1].value + order[i + 2].value);
    }
    const double by_second = median_over(second, count - 2, 1.652);
    const double by_fourth = count < 7 ? by_second : median_over(fourth, count - 4, 5.643);
    return by_second < by_fourth ? by_second : by_fourth;
}

double focus_curve_noise(const struct focus_curve *curve, const struct focus_range *range) {
    struct point order[FOCUS_SAMPLES_MAX];
    double predicted[FOCUS_SAMPLES_MAX];
    const unsigned count = sorted(curve, range, order);
    if (count < 3) {
        return 0;
    }
    for (unsigned i = 0; i < count; i++) {
        predicted[i] = order[i].deviation;
    }
    const double rough = roughness(order, count);
    const double expected = median_over(predicted, count, 1);
    return rough > expected ? rough : expected;
}

static unsigned count_lowest(unsigned count) {
    if (count < 3) {
        return count;
    }
    return count / 10 > 3 ? count / 10 : 3;
}

// Far from all peaks: the mean of the lowest tenth, at least of 3 samples.
static double floor_of(const struct point *order, unsigned count) {
    double values[FOCUS_SAMPLES_MAX], sum = 0;
    const unsigned lowest = count_lowest(count);
    for (unsigned i = 0; i < count; i++) {
        values[i] = order[i].value;
    }
    order_sort(values, count);
    for (unsigned i = 0; i < lowest; i++) {
        sum += values[i];
    }
    return lowest > 0 ? sum / lowest : 0;
}

// From a peak to where the curve crosses a level, on one side; the distance to the last sample if
// it does not.
static double reach(const struct point *order, unsigned count, unsigned peak, int step,
                    double level, unsigned *inside) {
    unsigned i = peak;
    while ((step < 0 ? i > 0 : i + 1 < count)) {
        const unsigned next = (unsigned)((int)i + step);
        if (order[next].value < level) {
            const double drop = order[i].value - order[next].value;
            const double part = drop > 0 ? (order[i].value - level) / drop : 0;
            const double edge =
                order[i].position + part * (double)(order[next].position - order[i].position);
            return fabs(edge - order[peak].position);
        }
        i = next;
        (*inside)++;
    }
    return fabs((double)order[i].position - order[peak].position);
}

// That of the side that is not cut; the greater one if both are, and the mean if none is.
static double choose_half_width(double down, double up, bool cut_below, bool cut_above) {
    if (cut_below != cut_above) {
        return cut_below ? up : down;
    }
    if (cut_below) {
        return down > up ? down : up;
    }
    return (down + up) / 2;
}

static struct focus_peak peak_of(const struct point *order, unsigned count, unsigned peak,
                                 double floor) {
    const double height = order[peak].value, level = floor + (height - floor) / 2;
    unsigned below = 0, above = 0;
    const double down = reach(order, count, peak, -1, level, &below);
    const double up = reach(order, count, peak, 1, level, &above);
    const bool cut_below = below == peak, cut_above = above == count - 1 - peak;
    return (struct focus_peak){
        .position = order[peak].position,
        .half_width = choose_half_width(down, up, cut_below, cut_above),
        .height = height,
        .floor = floor,
        .samples = 1 + below + above,
        .at_edge = peak == 0 || peak == count - 1,
    };
}

// The lowest value between two samples.
static double valley_between(const struct point *order, unsigned a, unsigned b) {
    double lowest = order[a].value;
    for (unsigned i = a < b ? a : b; i <= (a < b ? b : a); i++) {
        lowest = order[i].value < lowest ? order[i].value : lowest;
    }
    return lowest;
}

unsigned focus_curve_peaks(const struct focus_curve *curve, const struct focus_range *range,
                           struct focus_peak peaks[2]) {
    struct point order[FOCUS_SAMPLES_MAX];
    const unsigned count = sorted(curve, range, order);
    unsigned first = 0, second = count;
    if (count == 0) {
        return 0;
    }
    const double floor = floor_of(order, count);
    for (unsigned i = 1; i < count; i++) {
        first = order[i].value > order[first].value ? i : first;
    }
    const double height = order[first].value - floor;
    peaks[0] = peak_of(order, count, first, floor);
    const double apart = 2 * peaks[0].half_width + apart_counts;
    for (unsigned i = 0; i < count; i++) {
        const double other = order[i].value - floor;
        if (fabs((double)order[i].position - order[first].position) > apart &&
            other >= second_part * height &&
            valley_between(order, i, first) - floor < valley_part * other &&
            (second == count || order[i].value > order[second].value)) {
            second = i;
        }
    }
    if (second == count) {
        return 1;
    }
    peaks[1] = peak_of(order, count, second, floor);
    return 2;
}

// ---- the vertex of the parabola

// Weighted sums of powers of u and of y, for y = a + b u + c u^2, and of y^2.
struct sums {
    double u0, u1, u2, u3, u4, y0, y1, y2, yy;
};

static double determinant(const struct sums *s) {
    return s->u0 * (s->u2 * s->u4 - s->u3 * s->u3) - s->u1 * (s->u1 * s->u4 - s->u2 * s->u3) +
           s->u2 * (s->u1 * s->u3 - s->u2 * s->u2);
}

// Solves the normal equations; the vertex, its variance, and 1 / y there.
static bool solve(const struct sums *s, double *vertex, double *variance, double *lowest,
                  double *curvature) {
    const double det = determinant(s);
    if (!(det > 1e-12 * s->u0 * s->u2 * s->u4)) {
        return false;
    }
    const double m01 = s->u2 * s->u3 - s->u1 * s->u4, m02 = s->u1 * s->u3 - s->u2 * s->u2;
    const double m00 = s->u2 * s->u4 - s->u3 * s->u3, m11 = s->u0 * s->u4 - s->u2 * s->u2;
    const double m12 = s->u1 * s->u2 - s->u0 * s->u3, m22 = s->u0 * s->u2 - s->u1 * s->u1;
    const double a = (m00 * s->y0 + m01 * s->y1 + m02 * s->y2) / det;
    const double b = (m01 * s->y0 + m11 * s->y1 + m12 * s->y2) / det;
    const double c = (m02 * s->y0 + m12 * s->y1 + m22 * s->y2) / det;
    if (!(c > 0)) {
        return false;
    }
    *vertex = -b / (2 * c);
    *curvature = c;
    *lowest = a - b * b / (4 * c);
    const double db = -1 / (2 * c), dc = b / (2 * c * c);
    *variance = (db * db * m11 + 2 * db * dc * m12 + dc * dc * m22) / det;
    return *variance >= 0;
}

static void add_value(struct sums *s, double u, double y, double weight) {
    s->u0 += weight;
    s->u1 += weight * u;
    s->u2 += weight * u * u;
    s->u3 += weight * u * u * u;
    s->u4 += weight * u * u * u * u;
    s->y0 += weight * y;
    s->y1 += weight * y * u;
    s->y2 += weight * y * u * u;
    s->yy += weight * y * y;
}

// Adds a sample's reciprocal. Its variance is that of the sample over the fourth power.
static void add(struct sums *s, double u, double height, double deviation, double top) {
    const double scaled = height / top;
    const double spread = deviation / top, relative = relative_deviation * scaled;
    const double weight =
        scaled * scaled * scaled * scaled / (spread * spread + relative * relative);
    add_value(s, u, 1 / scaled, weight);
}

// What the samples scatter about the parabola with these coefficients more than their deviations
// say: chi squared over the degrees of freedom, at least 1.
static double misfit(const struct sums *s, unsigned count, double vertex, double lowest,
                     double curvature) {
    const double a = lowest + curvature * vertex * vertex, b = -2 * curvature * vertex;
    const double chi2 = s->yy - a * s->y0 - b * s->y1 - curvature * s->y2;
    return count > 3 && chi2 > count - 3 ? chi2 / (count - 3) : 1;
}

// Samples above a part of the height.
struct selection {
    struct sums sums;
    unsigned count;
    double min, max;
};

static struct selection select_above(const struct focus_curve *curve,
                                     const struct focus_range *range, const struct focus_peak *peak,
                                     double part, double scale) {
    const double top = peak->height - peak->floor;
    struct selection selection = {.count = 0};
    for (unsigned i = 0; i < curve->count; i++) {
        const struct focus_sample *sample = &curve->samples[i];
        const double u = (sample->position - peak->position) / scale;
        const double height = sample->sharpness[range->channel] - peak->floor;
        if (!is_in(sample, range) || height < part * top || fabs(u) > FIT_REACH) {
            continue;
        }
        add(&selection.sums, u, height, sample->deviation[range->channel], top);
        selection.min = u < selection.min ? u : selection.min;
        selection.max = u > selection.max ? u : selection.max;
        selection.count++;
    }
    return selection;
}

bool focus_curve_fit(const struct focus_curve *curve, const struct focus_range *range,
                     struct focus_peak *peak) {
    INVARIANT(peak->half_width >= 0 && (unsigned)range->channel < FOCUS_CHANNELS);
    const double top = peak->height - peak->floor;
    const double scale = peak->half_width > 1 ? peak->half_width : 1;
    struct selection selection = {.count = 0};
    if (!(top > 0)) {
        return false;
    }
    for (int i = 0; i < FIT_PARTS && selection.count < FIT_SAMPLES; i++) {
        selection = select_above(curve, range, peak, fit_parts[i], scale);
    }
    double vertex = 0, variance = 0, lowest = 0, curvature = 0;
    if (selection.count < 3 || !solve(&selection.sums, &vertex, &variance, &lowest, &curvature) ||
        lowest <= 0) {
        return false;
    }
    variance *= misfit(&selection.sums, selection.count, vertex, lowest, curvature);
    // Beyond the samples it is not a peak that they show.
    peak->at_edge = vertex < selection.min || vertex > selection.max;
    vertex = math_clamp(vertex, selection.min, selection.max);
    peak->position += vertex * scale;
    peak->deviation = sqrt(variance) * scale;
    peak->samples = selection.count;
    if (!peak->at_edge) {
        peak->height = peak->floor + top / lowest;
        peak->half_width = sqrt(lowest / curvature) * scale;
    }
    return true;
}

// A parabola through the samples from `min` to `max`, upside down; u is in `half` around `middle`.
struct wide_peak {
    double position, deviation, curvature, height, significance;
};

static bool fit_wide_peak(const struct point *order, unsigned count, double middle, double half,
                          struct wide_peak *wide_peak) {
    struct sums sums = {.u0 = 0};
    double vertex = 0, variance = 0, lowest = 0, curvature = 0, squares = 0;
    for (unsigned i = 0; i < count; i++) {
        const double u = (order[i].position - middle) / half;
        if (fabs(u) <= 1) {
            add_value(&sums, u, -order[i].value, 1);
        }
    }
    if (sums.u0 < WIDE_PEAK_SAMPLES || !solve(&sums, &vertex, &variance, &lowest, &curvature)) {
        return false;
    }
    for (unsigned i = 0; i < count; i++) {
        const double u = (order[i].position - middle) / half;
        const double off = order[i].value + lowest + curvature * (u - vertex) * (u - vertex);
        squares += fabs(u) <= 1 ? off * off : 0;
    }
    const double scatter = sqrt(squares / (sums.u0 - 3));
    // Of evenly spaced samples the mean fourth power less the squared mean square is 4/45.
    const double curvature_deviation = scatter / sqrt(sums.u0 * 4 / 45) + 1e-12;
    *wide_peak = (struct wide_peak){.position = middle + vertex * half,
                                    .deviation = sqrt(variance) * scatter * half,
                                    .curvature = curvature / (half * half),
                                    .height = -lowest,
                                    .significance = curvature / curvature_deviation};
    return true;
}

bool focus_curve_wide_peak(const struct focus_curve *curve, const struct focus_range *range,
                           double significant, struct focus_peak *peak) {
    struct point order[FOCUS_SAMPLES_MAX];
    const unsigned count = sorted(curve, range, order);
    struct wide_peak wide_peak, best = {.significance = 0};
    if (count < WIDE_PEAK_SAMPLES) {
        return false;
    }
    const double min = order[0].position, max = order[count - 1].position;
    double middle = (min + max) / 2, half = (max - min) / 2;
    // Narrower and narrower around it, as long as it is seen.
    for (int i = 0; i < WIDE_PEAK_FITS && half > 0; i++) {
        if (!fit_wide_peak(order, count, middle, half, &wide_peak) ||
            wide_peak.significance < significant) {
            break;
        }
        best = wide_peak;
        best.position = math_clamp(wide_peak.position, min, max);
        middle = best.position;
        half = (max - min) / 2 / (2 << i);
    }
    if (best.significance <= 0) {
        return false;
    }
    *peak = (struct focus_peak){.position = best.position,
                                .deviation = best.deviation,
                                .height = best.height,
                                .half_width = (max - min) / 2,
                                .floor = floor_of(order, count),
                                .samples = count};
    return true;
}

double focus_peak_at(const struct focus_peak *peak, double position) {
    const double half = peak->half_width > 0 ? peak->half_width : 1;
    const double u = (position - peak->position) / half;
    return peak->floor + (peak->height - peak->floor) / (1 + u * u);
}
