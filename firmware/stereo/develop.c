// SPDX-License-Identifier: Apache-2.0
#include "stereo/develop.h"

#include "core/error.h"
#include "core/invariant.h"
#include "core/root.h"
#include "stereo/image/debayer.h"
#if defined(__bfin__)
#include "stereo/bfin/mosaic.h"
#endif

enum { CHANNELS = 3, BALANCE_MAX = 4 };

// Rows being developed.
struct rows {
    const struct develop_state *develop;
    int begin;
    struct image_u8 *grey;
    struct image_rgb8 *colour;
};

size_t develop_need_bytes(int width_px, int bits, int threads) {
    const size_t width = (size_t)width_px;
    const size_t parts = (size_t)threads;
    return (1 + CHANNELS) * arena_need_bytes((size_t)1 << bits, 1) +
           arena_need_bytes(parts * CHANNELS * width, sizeof(uint16_t)) +
           arena_need_bytes(parts * CHANNELS * (width + DEBAYER_MARGIN_PX), sizeof(int32_t));
}

// Mean of the fourth powers of one pixel in four, in 1/256 of the largest value. A histogram would
// also work but needs memory.
static uint64_t fourth_power(const struct raw_image *raw, int column, int row) {
    uint64_t sum = 0;
    uint64_t count = 0;
    for (int y = row; y < raw->height_px; y += 2) {
        const uint16_t *values = raw->data + (ptrdiff_t)y * raw->stride;
        for (int x = column; x < raw->width_px; x += 2) {
            const uint32_t value = (uint32_t)values[x] << 8 >> raw->bits;
            const uint64_t limited = value < UINT8_MAX ? value : UINT8_MAX;
            sum += limited * limited * limited * limited;
            count++;
        }
    }
    return count > 0 ? sum / count : 0;
}

struct develop_balance develop_balance_of(const struct raw_image *raw) {
    struct develop_balance balance = {
        {DEVELOP_BALANCE_ONE, DEVELOP_BALANCE_ONE, DEVELOP_BALANCE_ONE}};
    if (raw->layout != RAW_BAYER_GRBG) {
        return balance;
    }
    // Rows G R, B G.
    const uint64_t powers[CHANNELS] = {fourth_power(raw, 1, 0), fourth_power(raw, 0, 0),
                                       fourth_power(raw, 0, 1)};
    int64_t roots_q4[CHANNELS];
    int64_t greatest = 1;
    for (int c = 0; c < CHANNELS; c++) {
        roots_q4[c] = root_of(root_of((int64_t)powers[c]) << 8);
        greatest = roots_q4[c] > greatest ? roots_q4[c] : greatest;
    }
    for (int c = 0; c < CHANNELS; c++) {
        const bool dark = roots_q4[c] * BALANCE_MAX < greatest;
        balance.gain_q8[c] = (uint16_t)(dark ? BALANCE_MAX * DEVELOP_BALANCE_ONE
                                             : greatest * DEVELOP_BALANCE_ONE / roots_q4[c]);
        INVARIANT(balance.gain_q8[c] >= DEVELOP_BALANCE_ONE);
    }
    return balance;
}

// UINT8_MAX * sqrt(value / largest), rounded, for light, UINT8_MAX * value / largest for encoded
// values.
static void fill_tone(const struct raw_image *raw, uint32_t gain_q8, uint8_t *tone) {
    const uint32_t largest = (1U << raw->bits) - 1;
    uint32_t root = 0;
    for (uint32_t value = 0; value <= largest; value++) {
        if (raw->layout != RAW_BAYER_GRBG) {
            tone[value] = (uint8_t)((value * UINT8_MAX + largest / 2) / largest);
            continue;
        }
        const uint32_t gained = value * gain_q8 / DEVELOP_BALANCE_ONE;
        const uint32_t light = gained < largest ? gained : largest;
        // The next root is the nearest one from root^2 + root + 1 on.
        while (light * UINT8_MAX * UINT8_MAX >= (root * root + root + 1) * largest) {
            root++;
        }
        INVARIANT(root <= UINT8_MAX);
        tone[value] = (uint8_t)root;
    }
}

#if !defined(__bfin__)
static inline uint32_t product_u16(uint32_t a, uint32_t b) {
    return a * b;
}
#endif

// Luma of ITU-R BT.601 in 1/256.
static uint32_t luma(const uint16_t *rgb) {
    return (product_u16(77, rgb[0]) + product_u16(150, rgb[1]) + product_u16(29, rgb[2]) + 128U) >>
           8;
}

// Grey and colour of a row of pixels, no value of which exceeds the largest. `colour` may be NULL.
static void tone_row(const struct develop_state *develop, const uint16_t *rgb, int width,
                     uint8_t *restrict grey, uint8_t *restrict colour) {
    const uint8_t *tone = develop->tone;
    const uint8_t *red = develop->balanced[0], *green = develop->balanced[1];
    const uint8_t *blue = develop->balanced[2];
#if defined(__bfin__)
    if (colour != NULL) {
        mosaic_tones(rgb, width, tone, develop->balanced, grey, colour);
        return;
    }
#endif
    for (int x = 0; x < width; x++, rgb += CHANNELS) {
        grey[x] = tone[luma(rgb)];
        if (colour != NULL) {
            colour[CHANNELS * x] = red[rgb[0]];
            colour[CHANNELS * x + 1] = green[rgb[1]];
            colour[CHANNELS * x + 2] = blue[rgb[2]];
        }
    }
}

static void develop_row(const struct rows *rows, int y, bool first, uint16_t *rgb, int32_t *work) {
    const struct develop_state *develop = rows->develop;
    const struct raw_image *raw = develop->raw;
    const uint16_t largest = (uint16_t)((1U << raw->bits) - 1);
    const uint16_t *row = raw->data + (ptrdiff_t)y * raw->stride;
    if (raw->layout == RAW_BAYER_GRBG) {
        const struct image_u16 mosaic = {(uint16_t *)(uintptr_t)raw->data, raw->width_px,
                                         raw->height_px, raw->stride};
        (first ? debayer_row : debayer_next_row)(&mosaic, raw->bits, y, rgb, work);
    } else {
        for (int i = 0; i < CHANNELS * raw->width_px; i++) {
            const uint16_t value = row[raw->layout == RAW_GREY ? i / CHANNELS : i];
            rgb[i] = value < largest ? value : largest;
        }
    }
    tone_row(develop, rgb, raw->width_px, image_u8_row(rows->grey, y - rows->begin),
             rows->colour->data != NULL ? image_rgb8_row(rows->colour, y - rows->begin) : NULL);
}

static void develop_part(void *context, int index) {
    const struct rows *rows = context;
    const struct develop_state *develop = rows->develop;
    const size_t width = (size_t)develop->raw->width_px;
    const size_t part = (size_t)index;
    const int64_t height = rows->grey->height;
    const int begin = rows->begin + (int)(height * index / develop->parts);
    const int end = rows->begin + (int)(height * (index + 1) / develop->parts);
    INVARIANT(begin <= end && end <= develop->raw->height_px);
    for (int y = begin; y < end; y++) {
        develop_row(rows, y, y == begin, develop->rgb + part * CHANNELS * width,
                    develop->work + part * CHANNELS * (width + DEBAYER_MARGIN_PX));
    }
}

// Takes the memory that develop_need_bytes counts; false: it does not fit.
static bool take_buffers(struct develop_state *develop, struct arena *arena) {
    const struct raw_image *raw = develop->raw;
    const size_t width = (size_t)raw->width_px;
    const size_t parts = (size_t)develop->parts;
    develop->tone = arena_take_fast(arena, (size_t)1 << raw->bits, 1);
    bool whole = develop->tone != NULL;
    for (int c = 0; c < CHANNELS; c++) {
        develop->balanced[c] = arena_take_fast(arena, (size_t)1 << raw->bits, 1);
        whole = whole && develop->balanced[c] != NULL;
    }
    develop->rgb = arena_take_fast(arena, parts * CHANNELS * width, sizeof *develop->rgb);
    develop->work = arena_take_fast(arena, parts * CHANNELS * (width + DEBAYER_MARGIN_PX),
                                    sizeof *develop->work);
    return whole && develop->rgb != NULL && develop->work != NULL;
}

int develop_begin(struct develop_state *develop, const struct raw_image *raw,
                  const struct develop_balance *balance, int threads, struct arena *arena) {
    if (raw->bits < 8 || raw->bits > 16 ||
        (raw->layout == RAW_BAYER_GRBG && (raw->width_px < 2 || raw->height_px < 2))) {
        return ERROR_ARGUMENT;
    }
    INVARIANT(threads >= 1);
    const size_t mark = arena_mark(arena);
    *develop = (struct develop_state){.raw = raw, .parts = threads};
    if (!take_buffers(develop, arena)) {
        arena_release(arena, mark);
        return ERROR_MEMORY;
    }
    fill_tone(raw, DEVELOP_BALANCE_ONE, develop->tone);
    for (int c = 0; c < CHANNELS; c++) {
        fill_tone(raw, balance->gain_q8[c], develop->balanced[c]);
    }
    return ERROR_OK;
}

void develop_rows(const struct develop_state *develop, const struct parallel *parallel, int begin,
                  struct image_u8 *grey, struct image_rgb8 *colour) {
    INVARIANT(grey->width == develop->raw->width_px && colour->width == develop->raw->width_px);
    INVARIANT(begin >= 0 && grey->height <= develop->raw->height_px - begin);
    INVARIANT(colour->height == grey->height);
    struct rows rows = {develop, begin, grey, colour};
    parallel->run(parallel->self, develop_part, &rows, develop->parts);
}

int develop_image(const struct raw_image *raw, const struct develop_balance *balance,
                  const struct parallel *parallel, struct arena *arena, struct image_u8 *grey,
                  struct image_rgb8 *colour) {
    INVARIANT(grey->height == raw->height_px);
    const size_t mark = arena_mark(arena);
    struct develop_state develop;
    const int error = develop_begin(&develop, raw, balance, parallel->threads, arena);
    if (error == ERROR_OK) {
        develop_rows(&develop, parallel, 0, grey, colour);
    }
    arena_release(arena, mark);
    return error;
}
