// SPDX-License-Identifier: Apache-2.0
#include "daemon/images/picture_marks.h"

#include <string.h>

#include "core/invariant.h"

enum {
    BLOCK_PX = 2,
    SIGMAS = 5,  // threshold of a difference: noise alone makes one mark in 2 million blocks
    DARK_SIGMAS = 2,
    STEEPNESS = 4,  // the step of an edge in focus is at least this part of the range
    // And this part of the value, as the sensitivities of the two greens differ.
    UNLIKE_GREENS = 64,
    AROUND_PX = 8,  // the range is that of about this distance on all sides
    STRIPE_PX = 4,
    CROSS_PARTS = 16,  // half the cross's length is this part of the picture's shorter side
};

/// A frame to be marked, by blocks.
struct marking {
    const struct raw_image *raw;
    const struct focus_noise *noise;
    size_t channels, green;  // values a pixel, and which of them is measured
    int columns, rows;       // blocks
    int around;              // blocks
    int32_t full;
};

static int32_t value_at(const struct marking *self, int x, int y) {
    return raw_image_row(self->raw, y)[(size_t)x * self->channels + self->green];
}

/// Of a mosaic the two are its green pixels.
static int32_t first_of(const struct marking *self, int column, int row) {
    return value_at(self, BLOCK_PX * column, BLOCK_PX * row);
}

static int32_t second_of(const struct marking *self, int column, int row) {
    return value_at(self, BLOCK_PX * column + 1, BLOCK_PX * row + 1);
}

/// Difference of the largest and smallest value around a block. At the frame's rim, where less is
/// around it, INT32_MAX.
static int32_t range_around(const struct marking *self, int column, int row) {
    const int left = column - self->around, right = column + self->around;
    const int top = row - self->around, bottom = row + self->around;
    int32_t min = INT32_MAX, max = 0;
    if (left < 0 || top < 0 || right >= self->columns || bottom >= self->rows) {
        return INT32_MAX;
    }
    for (int y = top; y <= bottom; y++) {
        for (int x = left; x <= right; x++) {
            const int32_t a = first_of(self, x, y), b = second_of(self, x, y);
            const int32_t high = a > b ? a : b, low = a < b ? a : b;
            max = high > max ? high : max;
            min = low < min ? low : min;
        }
    }
    return max - min;
}

/// Noise variance of a pixel, * 256.
static int64_t variance_q8(const struct focus_noise *noise, int32_t above_black) {
    const int64_t above = above_black > 0 ? above_black : 0;
    return noise->read_q8 + (above * noise->shot_q16 >> 8);
}

static bool is_saturated(const struct marking *self, int column, int row) {
    const uint16_t *rows[BLOCK_PX] = {raw_image_row(self->raw, BLOCK_PX * row),
                                      raw_image_row(self->raw, BLOCK_PX * row + 1)};
    const size_t values = BLOCK_PX * self->channels;
    const int32_t limit = self->full - self->full / 64;
    for (int y = 0; y < BLOCK_PX; y++) {
        for (size_t i = 0; i < values; i++) {
            if (rows[y][(size_t)column * values + i] >= limit) {
                return true;
            }
        }
    }
    return false;
}

/// The mark of a block; 0: none. Of an edge in focus `share_q8` is the square of its step's share
/// of the range: the steps of an edge add up to the range, so that their squares add up to less the
/// more blocks it is smeared over.
static uint8_t mark_of(const struct marking *self, int column, int row, uint32_t *share_q8) {
    if (is_saturated(self, column, row)) {
        return PICTURE_MARK_SATURATED;
    }
    const int32_t first = first_of(self, column, row), second = second_of(self, column, row);
    const int32_t mean = (first + second) / 2 - self->noise->black;
    const int64_t step = first > second ? first - second : second - first;
    if (mean <= 0 ||
        (int64_t)mean * mean * 256 <= (int64_t)DARK_SIGMAS * DARK_SIGMAS * self->noise->read_q8) {
        return PICTURE_MARK_DARK;
    }
    const int64_t noise_q8 = 2 * variance_q8(self->noise, mean);
    const bool visible =
        step * step * 256 > SIGMAS * SIGMAS * noise_q8 && step * UNLIKE_GREENS > mean;
    if (!visible) {
        return 0;
    }
    const int64_t range = range_around(self, column, row);
    if (step * STEEPNESS < range) {
        return 0;
    }
    INVARIANT(step > 0 && step <= range);
    *share_q8 = (uint32_t)(step * step * 256 / (range * range));
    return PICTURE_MARK_SHARP;
}

/// Colours the pixels of the picture that show a block.
static void colour_block(struct picture *picture, int shrink, int column, int row, uint8_t mark) {
    const int left = BLOCK_PX * column / shrink, top = BLOCK_PX * row / shrink;
    const int right = (BLOCK_PX * column + BLOCK_PX - 1) / shrink;
    const int bottom = (BLOCK_PX * row + BLOCK_PX - 1) / shrink;
    for (int y = top; y <= bottom && y < picture->height_px; y++) {
        for (int x = left; x <= right && x < picture->width_px; x++) {
            uint8_t *pixel = picture->pixels + (size_t)y * picture->row_bytes + x;
            const bool gap = mark == PICTURE_MARK_SATURATED && (x + y) / STRIPE_PX % 2 != 0;
            if (!gap && *pixel < mark) {
                *pixel = mark;
            }
        }
    }
}

static void draw_cross(struct picture *picture) {
    const int width = picture->width_px, height = picture->height_px;
    const int shorter = width < height ? width : height;
    uint8_t *middle = picture->pixels + (size_t)(height / 2) * picture->row_bytes + width / 2;
    const int arm = shorter / CROSS_PARTS;
    for (int i = arm / 3; i < arm; i++) {
        const ptrdiff_t down = i * (ptrdiff_t)picture->row_bytes;
        middle[i] = middle[-i] = PICTURE_MARK_CROSS;
        middle[down] = middle[-down] = PICTURE_MARK_CROSS;
    }
}

static void to_palette(struct picture *picture) {
    for (int y = 0; y < picture->height_px; y++) {
        uint8_t *row = picture->pixels + (size_t)y * picture->row_bytes;
        for (int x = 0; x < picture->width_px; x++) {
            row[x] = (uint8_t)((row[x] * (PICTURE_MARK_GREYS - 1) + UINT8_MAX / 2) / UINT8_MAX);
        }
    }
}

void picture_marks_palette(uint8_t palette[PICTURE_COLOURS][3]) {
    static const uint8_t marks[][3] = {{40, 70, 255}, {0, 255, 0}, {255, 0, 0}, {255, 255, 0}};
    for (int i = 0; i < PICTURE_MARK_GREYS; i++) {
        const uint8_t grey = (uint8_t)(i * UINT8_MAX / (PICTURE_MARK_GREYS - 1));
        memset(palette[i], grey, sizeof palette[i]);
    }
    memcpy(palette[PICTURE_MARK_GREYS], marks, sizeof marks);
}

void picture_mark(const struct raw_image *raw, const struct focus_noise *noise, int skip,
                  int shrink, struct picture *picture, struct picture_marks *marks) {
    INVARIANT(skip >= 1 && shrink >= 1 && picture->channels == 1);
    INVARIANT(picture->width_px == raw->width_px / shrink);
    INVARIANT(picture->height_px == raw->height_px / shrink);
    const bool rgb = raw->layout == RAW_RGB;
    const int around = AROUND_PX / (BLOCK_PX * skip);
    const struct marking self = {.raw = raw,
                                 .noise = noise,
                                 .channels = rgb ? 3 : 1,
                                 .green = rgb ? 1 : 0,
                                 .columns = raw->width_px / BLOCK_PX,
                                 .rows = raw->height_px / BLOCK_PX,
                                 .around = around > 0 ? around : 1,
                                 .full = (1 << raw->bits) - 1};
    uint32_t counts[PICTURE_COLOURS] = {0};
    uint64_t sharp_q8 = 0;
    to_palette(picture);
    for (int row = 0; row < self.rows; row++) {
        for (int column = 0; column < self.columns; column++) {
            uint32_t share_q8 = 0;
            const uint8_t mark = mark_of(&self, column, row, &share_q8);
            counts[mark]++;
            sharp_q8 += share_q8;
            if (mark != 0) {
                colour_block(picture, shrink, column, row, mark);
            }
        }
    }
    draw_cross(picture);
    *marks = (struct picture_marks){.sharp = (uint32_t)((sharp_q8 + 128) / 256),
                                    .saturated = counts[PICTURE_MARK_SATURATED],
                                    .dark = counts[PICTURE_MARK_DARK],
                                    .blocks = (uint32_t)self.columns * (uint32_t)self.rows};
}
