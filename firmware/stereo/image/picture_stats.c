// SPDX-License-Identifier: Apache-2.0
#include "stereo/image/picture_stats.h"

#include "core/invariant.h"

enum {
    RGB = 3,
    GREEN = 1,
    SAMPLES = 16,  // pairs of pixels for finding a step and a contrast
    END_SHIFT = 6,
};

void picture_stats_begin(struct picture_stats_sums *sums, const struct picture_form *form) {
    INVARIANT(form->width_px > 0 && form->bits >= 8 && form->bits <= 16);
    INVARIANT(form->channels == 1 || (form->channels == RGB && !form->mosaic));
    *sums = (struct picture_stats_sums){.form = *form};
}

static void add_light(struct picture_stats_sums *sums, const uint16_t *values) {
    const int count = sums->form.width_px * sums->form.channels;
    const uint32_t full = (1u << sums->form.bits) - 1;
    const uint32_t black = full >> END_SHIFT, saturated = full - black;
    uint64_t sum = 0;
    uint32_t blacks = 0, ends = 0;
    for (int i = 0; i < count; i++) {
        sum += values[i];
        blacks += values[i] <= black;
        ends += values[i] >= saturated;
    }
    sums->values += (uint64_t)count;
    sums->sum += sum;
    sums->black += blacks;
    sums->saturated += ends;
}

/// Of two pixels that begin at `values`, times two.
static int sample_of(const struct picture_form *form, bool odd_row, const uint16_t *values) {
    if (form->mosaic) {
        return 2 * values[odd_row ? 1 : 0];
    }
    return form->channels == RGB ? values[GREEN] + values[RGB + GREEN] : values[0] + values[1];
}

static void add_edges(struct picture_stats_sums *sums, const uint16_t *values) {
    const struct picture_form *form = &sums->form;
    const bool odd_row = sums->rows % 2 != 0;
    const int groups = form->width_px / (2 * SAMPLES);
    for (int group = 0; group < groups; group++) {
        int before = sample_of(form, odd_row, values);
        int min = before, max = before, step = 0;
        for (int i = 0; i < SAMPLES; i++, values += 2 * form->channels) {
            const int sample = sample_of(form, odd_row, values);
            const int apart = sample < before ? before - sample : sample - before;
            step = apart > step ? apart : step;
            min = sample < min ? sample : min;
            max = sample > max ? sample : max;
            before = sample;
        }
        const uint64_t contrast = (uint64_t)(max - min);
        sums->steps += (uint64_t)step * contrast;
        sums->contrasts += contrast * contrast;
    }
}

void picture_stats_row(struct picture_stats_sums *sums, const uint16_t *values) {
    add_light(sums, values);
    add_edges(sums, values);
    sums->rows++;
}

/// Saturates: a camera may set bits outside its range.
static uint16_t share(uint64_t part, uint64_t whole) {
    if (part >= whole) {
        return whole == 0 ? 0 : PICTURE_STATS_MAX_PERMILLE;
    }
    return (uint16_t)((part * PICTURE_STATS_MAX_PERMILLE + whole / 2) / whole);
}

struct picture_stats picture_stats_end(const struct picture_stats_sums *sums) {
    const uint64_t full = (UINT64_C(1) << sums->form.bits) - 1;
    return (struct picture_stats){
        .brightness_permille = share(sums->sum, sums->values * full),
        .saturated_permille = share(sums->saturated, sums->values),
        .black_permille = share(sums->black, sums->values),
        .sharpness_permille = share(sums->steps, sums->contrasts),
    };
}

struct picture_form picture_form_of(const struct raw_image *image) {
    return (struct picture_form){.width_px = image->width_px,
                                 .bits = image->bits,
                                 .channels = image->layout == RAW_RGB ? 3 : 1,
                                 .mosaic = image->layout == RAW_BAYER_GRBG};
}

struct picture_stats picture_stats_of(const struct raw_image *image) {
    const struct picture_form form = picture_form_of(image);
    struct picture_stats_sums sums;
    picture_stats_begin(&sums, &form);
    for (int y = 0; y < image->height_px; y++) {
        picture_stats_row(&sums, raw_image_row(image, y));
    }
    return picture_stats_end(&sums);
}
