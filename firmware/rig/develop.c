// SPDX-License-Identifier: Apache-2.0
#include "rig/develop.h"

#include "core/debayer.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/root.h"

enum { CHANNELS = 3 };

struct develop {
    const struct reconstruct_image *raw;
    struct image_u8 *grey;
    struct image_rgb8 *colour;
    uint8_t *tone;  // 8 bit value of each raw value
    uint16_t *rgb;  // a part: 3 * width
    int32_t *work;  // a part: 3 * (width + DEBAYER_MARGIN_PX)
    int parts;
};

size_t develop_need_bytes(int width_px, int bits, int threads) {
    const size_t width = (size_t)width_px;
    const size_t parts = (size_t)threads;
    return arena_need_bytes((size_t)1 << bits, 1) +
           arena_need_bytes(parts * CHANNELS * width, sizeof(uint16_t)) +
           arena_need_bytes(parts * CHANNELS * (width + DEBAYER_MARGIN_PX), sizeof(int32_t));
}

static uint32_t rounded_root(uint32_t value) {
    return ((uint32_t)root_of(4 * (int64_t)value) + 1) / 2;
}

// UINT8_MAX * sqrt(value / largest) for light, UINT8_MAX * value / largest for encoded values.
static void fill_tone(const struct reconstruct_image *raw, uint8_t *tone) {
    const uint32_t largest = (1U << raw->bits) - 1;
    for (uint32_t value = 0; value <= largest; value++) {
        const uint32_t toned =
            raw->layout == PIXEL_BAYER_GRBG
                ? rounded_root((uint32_t)((uint64_t)value * UINT8_MAX * UINT8_MAX / largest))
                : (value * UINT8_MAX + largest / 2) / largest;
        INVARIANT(toned <= UINT8_MAX);
        tone[value] = (uint8_t)toned;
    }
}

// Luma of ITU-R BT.601 in 1/256.
static uint32_t luma(const uint16_t *rgb) {
    return (77U * rgb[0] + 150U * rgb[1] + 29U * rgb[2] + 128U) >> 8;
}

static void develop_row(const struct develop *develop, int y, uint16_t *rgb, int32_t *work) {
    const struct reconstruct_image *raw = develop->raw;
    const uint16_t largest = (uint16_t)((1U << raw->bits) - 1);
    uint8_t *grey = image_u8_row(develop->grey, y);
    uint8_t *colour = image_rgb8_row(develop->colour, y);
    const uint16_t *row = raw->data + (ptrdiff_t)y * raw->stride;
    if (raw->layout == PIXEL_BAYER_GRBG) {
        const struct image_u16 mosaic = {(uint16_t *)(uintptr_t)raw->data, raw->width_px,
                                         raw->height_px, raw->stride};
        debayer_row(&mosaic, raw->bits, y, rgb, work);
        row = rgb;
    }
    for (int x = 0; x < raw->width_px; x++) {
        uint16_t pixel[CHANNELS];
        for (int c = 0; c < CHANNELS; c++) {
            const uint16_t value = raw->layout == PIXEL_GREY ? row[x] : row[CHANNELS * x + c];
            pixel[c] = value < largest ? value : largest;
            colour[CHANNELS * x + c] = develop->tone[pixel[c]];
        }
        grey[x] = develop->tone[luma(pixel)];
    }
}

static void develop_part(void *context, int index) {
    const struct develop *develop = context;
    const size_t width = (size_t)develop->raw->width_px;
    const size_t part = (size_t)index;
    const int begin = (int)((int64_t)develop->raw->height_px * index / develop->parts);
    const int end = (int)((int64_t)develop->raw->height_px * (index + 1) / develop->parts);
    for (int y = begin; y < end; y++) {
        develop_row(develop, y, develop->rgb + part * CHANNELS * width,
                    develop->work + part * CHANNELS * (width + DEBAYER_MARGIN_PX));
    }
}

int develop_image(const struct reconstruct_image *raw, const struct parallel *parallel,
                  struct arena *arena, struct image_u8 *grey, struct image_rgb8 *colour) {
    INVARIANT(grey->width == raw->width_px && grey->height == raw->height_px);
    INVARIANT(colour->width == raw->width_px && colour->height == raw->height_px);
    if (raw->bits < 8 || raw->bits > 16 ||
        (raw->layout == PIXEL_BAYER_GRBG && (raw->width_px < 2 || raw->height_px < 2))) {
        return ERROR_ARGUMENT;
    }
    const size_t mark = arena_mark(arena);
    const size_t width = (size_t)raw->width_px;
    const size_t parts = (size_t)parallel->threads;
    struct develop develop = {
        .raw = raw, .grey = grey, .colour = colour, .parts = parallel->threads};
    develop.tone = arena_take(arena, (size_t)1 << raw->bits, 1);
    develop.rgb = arena_take(arena, parts * CHANNELS * width, sizeof *develop.rgb);
    develop.work =
        arena_take(arena, parts * CHANNELS * (width + DEBAYER_MARGIN_PX), sizeof *develop.work);
    if (develop.tone == NULL || develop.rgb == NULL || develop.work == NULL) {
        arena_release(arena, mark);
        return ERROR_MEMORY;
    }
    fill_tone(raw, develop.tone);
    parallel->run(parallel->self, develop_part, &develop, develop.parts);
    arena_release(arena, mark);
    return ERROR_OK;
}
