// SPDX-License-Identifier: Apache-2.0
// The checksums of core_digest.c over focus, exposure and decisions: their measures, their searches
// and the plan of a measurement, each in a world of a few numbers.
#ifndef VERGENCE_TESTS_PORTABLE_DIGEST_SEARCH_H
#define VERGENCE_TESTS_PORTABLE_DIGEST_SEARCH_H

#include <stdint.h>

#include "core/math.h"
#include "digest_numbers.h"
#include "focus/exposure_measure.h"
#include "focus/exposure_search.h"
#include "focus/focus_curve.h"
#include "focus/focus_search.h"
#include "measure/measure.h"

// Each measure of each plane of windows of noise on a slope, some of them saturated.
static uint32_t digest_focus(void) {
    enum { STRIDE = 70, ROWS = 50, BITS = 10 };
    uint32_t crc = 0;
    static uint16_t values[STRIDE * ROWS];
    for (unsigned i = 0; i < (is_short ? 4 : 40); i++) {
        for (unsigned k = 0; k < STRIDE * ROWS; k++) {
            values[k] = (uint16_t)((next_random() >> 56) + k / STRIDE * i);
        }
        const struct focus_window window = {.values = values,
                                            .stride = STRIDE,
                                            .width_px = (uint16_t)(8 + i / 2 * 2),
                                            .height_px = (uint16_t)(8 + 2 * (i % 20)),
                                            .saturated = (1 << BITS) - 1};
        const struct focus_noise unity = {42, 240, 7563};
        const struct focus_noise noise = focus_noise_at(&unity, (uint16_t)(8 + i));
        for (unsigned k = 0; k < FOCUS_PLANES * FOCUS_MEASURES; k++) {
            const enum focus_plane plane = (enum focus_plane)(k % FOCUS_PLANES);
            const enum focus_measure measure = (enum focus_measure)(k / FOCUS_PLANES);
            struct focus_window narrow = window;
            narrow.width_px = plane == FOCUS_RGB_GREEN ? 8 : window.width_px;
            const struct focus_sharpness found =
                focus_measure_window(&narrow, plane, measure, &noise);
            crc = add_bits(crc, found.energy, 8);
            crc = add_bits(crc, found.noise_energy, 8);
            crc = add_bits(crc, found.samples, 4);
            crc = add_bits(crc, found.mean_q8, 4);
            crc = add_bits(crc, found.saturated_permille, 2);
            const struct focus_sample sample = focus_sample_of(&narrow, plane, measure, &noise);
            for (unsigned channel = 0; channel < FOCUS_CHANNELS; channel++) {
                crc = add_double(crc, (double)sample.sharpness[channel]);
                crc = add_double(crc, (double)sample.deviation[channel]);
            }
        }
    }
    return crc;
}

static uint32_t digest_exposure(void) {
    enum { WIDTH = 90, HEIGHT = 12 };
    uint32_t crc = 0;
    static uint16_t row[WIDTH];
    for (int i = 0; i < draws(60, 10); i++) {
        struct exposure_histogram histogram;
        const int bits = 8 + i % 9;
        exposure_histogram_begin(&histogram, (enum raw_layout)(i % 3), bits, (uint16_t)i);
        for (int y = 0; y < HEIGHT; y++) {
            for (int x = 0; x < WIDTH; x++) {
                row[x] = (uint16_t)(next_random() >> (64 - bits));
            }
            exposure_histogram_row(&histogram, row, WIDTH / 3, y);
        }
        const struct exposure_measure found = exposure_histogram_end(&histogram);
        const double numbers[] = {found.mean, found.saturated, found.high, found.white,
                                  found.excess};
        crc = add_doubles(crc, numbers, 5);
    }
    return crc;
}

static struct focus_sample sample_at(double position, double peak, enum focus_leg leg) {
    struct focus_sample sample = {.position = (float)position, .mean = 100, .leg = (uint8_t)leg};
    const double off = (position - peak) / 20;
    for (int channel = 0; channel < FOCUS_CHANNELS; channel++) {
        sample.sharpness[channel] = (float)(0.2 / (1 + off * off) + uniform(0, 0.001));
        sample.deviation[channel] = 0.001f;
    }
    sample.noise = 0.001f;
    return sample;
}

static uint32_t digest_focus_search(void) {
    uint32_t crc = 0;
    for (int i = 0; i < draws(20, 1); i++) {
        static struct focus_search search;
        const struct focus_search_options options = {
            .min = 300,
            .max = is_short ? 560 : 850,
            .from_above = i % 2 == 0,
            .run_up = 10,
            .tolerance = 2,
            .blur_per_count_px = 0.2,
            .counts_per_frame = uniform(is_short ? 10 : 2, 12),
            .noise_ratio = 1,
            .region_px = 100};
        const double peak = uniform(330, options.max - 30);
        struct focus_step step = focus_search_begin(&search, &options, uniform(300, options.max));
        double at = search.begin;
        while (step.kind != FOCUS_STEP_END) {
            const double from = at;
            at = step.kind == FOCUS_STEP_LOOK ? at : step.position;
            const int frames = step.kind == FOCUS_STEP_SWEEP
                                   ? (int)(math_hypot(at - from, 0) / step.spacing) + 1
                                   : (int)step.frames;
            for (int frame = 0; frame < frames; frame++) {
                const double where = from + (at - from) * frame / frames;
                const struct focus_sample sample = sample_at(where, peak, step.leg);
                focus_search_add(&search, &sample);
            }
            const struct focus_event event = {at, 0.5, false};
            step = focus_search_next(&search, &event);
            crc = add_bits(crc, (uint64_t)step.kind, 1);
            crc = add_double(crc, step.position);
        }
        crc = add_bits(crc, (uint64_t)search.result.verdict, 1);
        crc = add_double(crc, search.result.position);
        crc = add_double(crc, search.result.blur_px);
    }
    return crc;
}

static uint32_t digest_exposure_search(void) {
    uint32_t crc = 0;
    for (int i = 0; i < draws(200, 10); i++) {
        const struct exposure_limits limits = {.row_ns = 30000,
                                               .min_us = 30,
                                               .max_us = 1000000,
                                               .mains_half_us = i % 2 == 0 ? 10000 : 0,
                                               .gain_min_q3 = 8,
                                               .gain_max_q3 = 64,
                                               .linear = true};
        const struct exposure_target target = {.mean = 0.5};
        const struct exposure_setting start = {.exposure_us = 10000, .gain_q3 = 8};
        const double light_per_us = math_exp(uniform(-16, -6));
        struct exposure_search search;
        struct exposure_setting setting;
        enum exposure_verdict verdict;
        exposure_search_begin(&search, &limits, &target, &start, &setting);
        do {
            const double level = light_per_us * setting.exposure_us * setting.gain_q3 / 8;
            const struct exposure_measure measure = {.mean = level < 1 ? level : 1,
                                                     .saturated = level < 0.7 ? 0 : 0.2,
                                                     .high = level < 0.7 ? level * 1.4 : 1,
                                                     .white = level < 0.7 ? level * 1.3 : 1,
                                                     .excess = level < 0.7 ? 1 : level * 1.4};
            verdict = exposure_search_next(&search, &measure, setting.exposure_us, &setting);
            crc = add_bits(crc, setting.exposure_us, 4);
            crc = add_bits(crc, setting.gain_q3, 2);
        } while (verdict == EXPOSURE_GOING);
        crc = add_bits(crc, (uint64_t)verdict, 1);
    }
    return crc;
}

static uint32_t digest_measure(void) {
    uint32_t crc = 0;
    for (int i = 0; i < draws(64, 8); i++) {
        const struct measure_instrument instrument = {.ready = i % 2 != 0,
                                                      .servos = i % 3 != 0,
                                                      .zoom = i % 5 != 0,
                                                      .focus = i % 7 != 0,
                                                      .iris = i % 11 != 0,
                                                      .exposure = true,
                                                      .brackets = i % 4 != 0,
                                                      .f_number_open = 1.6,
                                                      .f_number_closed = 16,
                                                      .exposure_max_us = 1e6,
                                                      .gain_max = 2};
        const struct measure_request request = {.quick = i % 6 == 0,
                                                .near_mm = i % 8 == 0 ? uniform(300, 900) : 0,
                                                .far_mm = i % 8 == 0 ? uniform(1000, 3000) : 0};
        static struct measure measure;
        struct measure_step step = measure_begin(&measure, &request, &instrument);
        while (step.kind != MEASURE_STEP_END) {
            crc = add_bits(crc, (uint64_t)step.kind, 1);
            crc = add_bits(crc, (uint64_t)step.phase, 1);
            crc = add_double(crc, step.seconds);
            const struct measure_event event = measure_expect(&measure, &step, uniform(800, 2500));
            step = measure_next(&measure, &event);
        }
        crc = add_bits(crc, measure.result.losses, 4);
    }
    return crc;
}

#endif
