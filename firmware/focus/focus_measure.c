// SPDX-License-Identifier: Apache-2.0
#include "focus/focus_measure.h"

#include "core/invariant.h"

enum {
    VALUE_MAX = (1 << FOCUS_VALUE_BITS) - 1,
    UNIT_Q3 = 8,
    // Energy that white noise of variance 1 contributes: the sum of the squared weights. Sobel:
    // 1 + 4 + 1 + 1 + 4 + 1 in each direction; Laplacian: 16 + 4.
    SOBEL_NOISE = 24,
    LAPLACIAN_NOISE = 20,
    PERMILLE = 1000,
    RGB_VALUES = 3,
};

/// The pixels of a colour: from `first`, every `step`-th in both directions.
struct plane {
    const uint16_t *first;
    size_t step, row;  ///< values to the next pixel, and to the next row
    uint32_t width, height;
};

struct sums {
    uint64_t count, sum, saturated;  ///< number and sum of the values; number of saturated ones
    uint64_t energy, filtered;       ///< energy of the filtered values, and their number
};

static int32_t value_at(const struct plane *plane, uint32_t x, uint32_t y) {
    const uint16_t value = plane->first[y * plane->row + x * plane->step];
    return value < VALUE_MAX ? value : VALUE_MAX;
}

static void add_values(const struct plane *plane, uint16_t saturated, struct sums *sums) {
    for (uint32_t y = 0; y < plane->height; y++) {
        for (uint32_t x = 0; x < plane->width; x++) {
            const uint32_t value = (uint32_t)value_at(plane, x, y);
            sums->sum += value;
            sums->saturated += value >= saturated;
        }
    }
    sums->count += (uint64_t)plane->width * plane->height;
}

/// Variance * 256, rounded down. Deviations from the rounded mean keep every sum below 2^55.
static uint64_t variance_q8(const struct plane *plane, const struct sums *sums) {
    const int32_t pivot = (int32_t)((sums->sum + sums->count / 2) / sums->count);
    int64_t sum = 0, squares = 0;
    for (uint32_t y = 0; y < plane->height; y++) {
        for (uint32_t x = 0; x < plane->width; x++) {
            const int32_t off = value_at(plane, x, y) - pivot;
            sum += off;
            squares += off * off;
        }
    }
    const int64_t count = (int64_t)sums->count;
    INVARIANT(sum <= count && sum >= -count);
    return (uint64_t)((squares * 256 - sum * sum * 256 / count) / count);
}

static void add_sobel(const struct plane *plane, struct sums *sums) {
    for (uint32_t y = 1; y + 1 < plane->height; y++) {
        for (uint32_t x = 1; x + 1 < plane->width; x++) {
            const int32_t a = value_at(plane, x - 1, y - 1), b = value_at(plane, x, y - 1);
            const int32_t c = value_at(plane, x + 1, y - 1), d = value_at(plane, x - 1, y);
            const int32_t e = value_at(plane, x + 1, y), f = value_at(plane, x - 1, y + 1);
            const int32_t g = value_at(plane, x, y + 1), h = value_at(plane, x + 1, y + 1);
            const int32_t across = c + 2 * e + h - a - 2 * d - f;
            const int32_t down = f + 2 * g + h - a - 2 * b - c;
            sums->energy += (uint64_t)(across * across) + (uint64_t)(down * down);
        }
    }
    sums->filtered += (uint64_t)(plane->width - 2) * (plane->height - 2);
}

static void add_laplacian(const struct plane *plane, struct sums *sums) {
    for (uint32_t y = 1; y + 1 < plane->height; y++) {
        for (uint32_t x = 1; x + 1 < plane->width; x++) {
            const int32_t curve = 4 * value_at(plane, x, y) - value_at(plane, x - 1, y) -
                                  value_at(plane, x + 1, y) - value_at(plane, x, y - 1) -
                                  value_at(plane, x, y + 1);
            sums->energy += (uint64_t)(curve * curve);
        }
    }
    sums->filtered += (uint64_t)(plane->width - 2) * (plane->height - 2);
}

static uint64_t noise_variance_q8(const struct focus_noise *noise, uint64_t above_q8) {
    return noise->read_q8 + (above_q8 * noise->shot_q16 >> 16);
}

struct focus_noise focus_noise_at(const struct focus_noise *unity, uint16_t gain_q3) {
    INVARIANT(gain_q3 >= 1);
    const uint64_t square = (uint64_t)gain_q3 * gain_q3;
    return (struct focus_noise){
        .black = unity->black,
        .read_q8 = (uint32_t)(unity->read_q8 * square / (UNIT_Q3 * UNIT_Q3)),
        .shot_q16 = (uint32_t)((uint64_t)unity->shot_q16 * gain_q3 / UNIT_Q3)};
}

/// The planes of a colour. Returns their number.
static unsigned planes_of(const struct focus_window *window, enum focus_plane plane,
                          struct plane planes[2]) {
    static const struct {
        uint8_t x, y;
    } at[FOCUS_PLANES][2] = {[FOCUS_GREEN] = {{0, 0}, {1, 1}},
                             [FOCUS_RED] = {{1, 0}},
                             [FOCUS_BLUE] = {{0, 1}},
                             [FOCUS_GREY] = {{0, 0}},
                             [FOCUS_RGB_GREEN] = {{1, 0}}};
    const unsigned count = plane == FOCUS_GREEN ? 2 : 1;
    const uint32_t step = focus_plane_is_mosaic(plane) ? 2 : 1;
    for (unsigned i = 0; i < count; i++) {
        planes[i] = (struct plane){
            .first = window->values + at[plane][i].y * window->stride + at[plane][i].x,
            .step = plane == FOCUS_RGB_GREEN ? RGB_VALUES : step,
            .row = step * window->stride,
            .width = window->width_px / step,
            .height = window->height_px / step};
    }
    return count;
}

/// The energy of one plane, * 256, with its noise.
static uint64_t plane_energy_q8(const struct plane *plane, enum focus_measure measure,
                                struct sums *sums) {
    if (measure == FOCUS_TENENGRAD) {
        add_sobel(plane, sums);
    } else if (measure == FOCUS_LAPLACIAN) {
        add_laplacian(plane, sums);
    } else {
        return variance_q8(plane, sums);
    }
    return sums->energy * 256 / sums->filtered;
}

struct focus_sharpness focus_measure_window(const struct focus_window *window,
                                            enum focus_plane plane, enum focus_measure measure,
                                            const struct focus_noise *noise) {
    static const uint8_t weights[FOCUS_MEASURES] = {[FOCUS_VARIANCE] = 1,
                                                    [FOCUS_NORMALIZED_VARIANCE] = 1,
                                                    [FOCUS_TENENGRAD] = SOBEL_NOISE,
                                                    [FOCUS_LAPLACIAN] = LAPLACIAN_NOISE};
    INVARIANT((unsigned)plane < FOCUS_PLANES && (unsigned)measure < FOCUS_MEASURES);
    INVARIANT(window->width_px >= FOCUS_WINDOW_MIN_PX && window->width_px <= FOCUS_WINDOW_MAX_PX);
    INVARIANT(window->height_px >= FOCUS_WINDOW_MIN_PX && window->height_px <= FOCUS_WINDOW_MAX_PX);
    INVARIANT(window->stride >= window->width_px);
    INVARIANT(!focus_plane_is_mosaic(plane) ||
              (window->width_px % 2 == 0 && window->height_px % 2 == 0));
    struct plane planes[2];
    const unsigned count = planes_of(window, plane, planes);
    struct focus_sharpness result = {0};
    uint64_t sum = 0, saturated = 0, total_q8 = 0;
    for (unsigned i = 0; i < count; i++) {
        struct sums sums = {0};
        add_values(&planes[i], window->saturated, &sums);
        total_q8 += plane_energy_q8(&planes[i], measure, &sums);
        sum += sums.sum;
        saturated += sums.saturated;
        result.samples += (uint32_t)sums.count;
    }
    const uint64_t mean_q8 = sum * 256 / result.samples, black_q8 = (uint64_t)noise->black * 256;
    result.mean_q8 = (uint32_t)(mean_q8 > black_q8 ? mean_q8 - black_q8 : 0);
    result.saturated_permille = (uint16_t)(saturated * PERMILLE / result.samples);
    uint64_t energy = total_q8 / count;
    uint64_t from_noise = weights[measure] * noise_variance_q8(noise, result.mean_q8);
    energy = energy > from_noise ? energy - from_noise : 0;
    if (measure == FOCUS_NORMALIZED_VARIANCE) {
        // A quarter of a value at least: darker windows have no measurable contrast.
        const uint64_t mean = result.mean_q8 > 64 ? result.mean_q8 : 64;
        energy = (energy << 20) / mean * (1 << 12) / mean;
        from_noise = (from_noise << 20) / mean * (1 << 12) / mean;
    }
    result.energy = energy;
    result.noise_energy = from_noise;
    return result;
}
