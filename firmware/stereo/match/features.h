// SPDX-License-Identifier: Apache-2.0
// Text that each set of kernels compiles. Features: what is compared between the images, and the
// steps of grey levels that averages and paths follow.
// Rows needed: two above and two below a row (MATCH_CENSUS_RADIUS), one more where the pair is
// smoothed; of both images.
#ifndef VERGENCE_STEREO_MATCH_FEATURES_H
#define VERGENCE_STEREO_MATCH_FEATURES_H

#include <string.h>

#include "core/invariant.h"
#include "stereo/match/lanes.h"
#include "stereo/match/state.h"
#include "stereo/match/tuning.h"

// Adds up pairs, in place. Piece by piece: compilers do not vectorize it where both share memory.
static void halve_sums(int half, uint16_t *box) {
    enum { PIECE = 128 };
    for (int begin = 0; begin < half; begin += PIECE) {
        uint16_t sum[PIECE];
        const uint16_t *restrict from = box + (ptrdiff_t)2 * begin;
        const int count = half - begin < PIECE ? half - begin : PIECE;
        for (int x = 0; x < count; x++) {
            sum[x] = (uint16_t)(from[2 * x] + from[2 * x + 1]);
        }
        memcpy(box + begin, sum, (size_t)count * sizeof *sum);
    }
}

/// Means of rectangles of 2^shift_x columns and 2^shift_y rows, into `width` pixels, from pixels
// that are `pitch` bytes apart. `box` has room for a full row.
MATCH_INLINE void scale_row(const struct image_u8 *image, int y, int shift_x, int shift_y,
                            int width, uint16_t *restrict box, uint8_t *restrict pixels,
                            const int pitch) {
    const int length = width << shift_x;
    // The sum of a rectangle must fit 16 bits.
    const int early = shift_x + shift_y > 8 ? shift_x + shift_y - 8 : 0;
    memset(box, 0, (size_t)length * sizeof *box);
    for (int j = 0; j < 1 << shift_y; j++) {
        const uint8_t *restrict from = image_u8_row(image, (y << shift_y) + j);
        for (int x = 0; x < length; x++) {
            box[x] = (uint16_t)(box[x] + from[pitch * x]);
        }
    }
    for (int x = 0; x < length && early > 0; x++) {
        box[x] = (uint16_t)(box[x] >> early);
    }
    for (int half = length / 2, i = 0; i < shift_x; i++, half /= 2) {
        halve_sums(half, box);
    }
    const int down = shift_x + shift_y - early;
    for (int x = 0; x < width; x++) {
        pixels[x] = (uint8_t)((box[x] + (1 << down >> 1)) >> down);
    }
}

// Repeats the ends of the valid span of a padded row outwards; a row without a span is black.
static void repeat_ends(struct rectify_span span, int width, uint8_t *padded) {
    uint8_t *pixels = padded + MATCH_SOURCE_PAD;
    if (span.begin >= span.end) {
        memset(padded, 0, (size_t)(width + 2 * MATCH_SOURCE_PAD));
        return;
    }
    memset(padded, pixels[span.begin], (size_t)(span.begin + MATCH_SOURCE_PAD));
    memset(pixels + span.end, pixels[span.end - 1], (size_t)(width + MATCH_SOURCE_PAD - span.end));
}

// One side of the input.
struct image_view {
    const struct image_u8 *grey;
    const struct image_rgb8 *colour;
    const struct rectify_span *spans;
};

// An image to be read: all of a grey one, or one channel of a coloured one.
struct image_source {
    struct image_u8 image;
    const struct rectify_span *spans;
    bool channel;  // its pixels are RGB_BYTES apart
};

enum { RGB_BYTES = 3 };

// Every third byte.
static void one_channel(const uint8_t *restrict from, int width, uint8_t *restrict pixels) {
    for (int x = 0; x < width; x++) {
        pixels[x] = from[RGB_BYTES * x];
    }
}

// Pixels of row y for index -MATCH_SOURCE_PAD to width + MATCH_SOURCE_PAD - 1 of a level,
// with the ends of the valid span repeated outwards.
static void source_row(const struct match_level *level, const struct image_source *source, int y,
                       uint16_t *box, uint8_t *padded) {
    const int row = y < 0 ? 0 : (y < level->height ? y : level->height - 1);
    uint8_t *restrict pixels = padded + MATCH_SOURCE_PAD;
    const uint8_t *restrict from = image_u8_row(&source->image, row);
    // The pictures of coarser levels are scaled already.
    const bool full = !match_is_finest(level) || level->shift_y == 0;
    if (full && source->channel) {
        one_channel(from, level->width, pixels);
    } else if (full) {
        memcpy(pixels, from, (size_t)level->width);
    } else if (source->channel) {
        scale_row(&source->image, row, level->shift_x, level->shift_y, level->width, box, pixels,
                  RGB_BYTES);
    } else {
        scale_row(&source->image, row, level->shift_x, level->shift_y, level->width, box, pixels,
                  1);
    }
    repeat_ends(match_span(level, &level->state->input->left, source->spans, row), level->width,
                padded);
}

// The mean of a pixel, with its neighbours in the row and in the rows before and after it, where
// each neighbour has the weight `side` of MATCH_SMOOTHING_ONE along each direction. The rows are
// padded. `to` may be `above`. `box` has room for a row and MATCH_BOX_MORE pixels.
static void smooth_source(const uint8_t *above, const uint8_t *row, const uint8_t *below, int width,
                          int side, uint16_t *restrict box, uint8_t *to) {
#if defined(VECTOR_HAS_CELLS)
    bytes_smooth(above, row, below, width, side, box, to);
#else
    const uint16_t share = (uint16_t)side;
    const uint16_t own = (uint16_t)(MATCH_SMOOTHING_ONE - 2 * side);
    uint16_t *restrict middle = box + 1;
    for (int x = -1; x <= width; x++) {
        middle[x] = (uint16_t)(own * row[x] + share * (above[x] + below[x]));
    }
    const uint16_t half = MATCH_SMOOTHING_ONE * MATCH_SMOOTHING_ONE / 2;
    for (int x = 0; x < width; x++) {
        const uint16_t beside = (uint16_t)(middle[x - 1] + middle[x + 1]);
        const uint16_t sum = (uint16_t)(own * middle[x] + share * beside + half);
        to[x] = (uint8_t)(sum / (MATCH_SMOOTHING_ONE * MATCH_SMOOTHING_ONE));
    }
#endif
}

// Smooths `count` rows from y_begin on: the rows y_begin - 1 and so on in scratch->source. The
// result begins at its first row.
static void smooth_sources(const struct match_level *level, const struct image_source *from,
                           int y_begin, int count, struct match_scratch *scratch) {
    const int width = level->width;
    uint8_t *const *source = scratch->source;
    for (int j = 0; j < count; j++) {
        smooth_source(source[j] + MATCH_SOURCE_PAD, source[j + 1] + MATCH_SOURCE_PAD,
                      source[j + 2] + MATCH_SOURCE_PAD, width, level->state->look.smoothing,
                      scratch->box, source[j] + MATCH_SOURCE_PAD);
        const int y = y_begin + j;
        const int row = y < 0 ? 0 : (y < level->height ? y : level->height - 1);
        repeat_ends(match_span(level, &level->state->input->left, from->spans, row), width,
                    source[j]);
    }
    // Rows outside the image repeat its ends, which are among the rows here.
    for (int j = 0; j < count; j++) {
        const int y = y_begin + j;
        const int row = y < 0 ? 0 : (y < level->height ? y : level->height - 1);
        if (row != y) {
            memcpy(source[j], source[row - y_begin], (size_t)(width + 2 * MATCH_SOURCE_PAD));
        }
    }
}

// Reads `count` rows from row `first` on into scratch->source, smoothed where the level is.
static void source_rows(const struct match_level *level, const struct image_source *source,
                        int first, int count, struct match_scratch *scratch) {
    const bool smooth = match_is_smoothed(level);
    const int more = smooth ? 1 : 0;
    for (int j = 0; j < count + 2 * more; j++) {
        source_row(level, source, first - more + j, scratch->box, scratch->source[j]);
    }
    if (smooth) {
        smooth_sources(level, source, first, count, scratch);
    }
}

// Reads what the features of the rows [y_begin, y_begin + rows) need of a channel.
static void channel_rows(const struct match_level *level, const struct image_view *view,
                         int channel, int y_begin, int rows, struct match_scratch *scratch) {
    struct image_source source = {*view->grey, view->spans, false};
    if (channel != MATCH_GREY) {
        const struct image_rgb8 *colour = view->colour;
        source.image = (struct image_u8){colour->data + channel, colour->width, colour->height,
                                         colour->stride, colour->ring_rows};
        source.channel = true;
    }
    source_rows(level, &source, y_begin - MATCH_CENSUS_RADIUS, rows + 2 * MATCH_CENSUS_RADIUS,
                scratch);
}

// Eight comparisons, one bit each, into the bits of `mask`. `pitch`: between the bytes of one
// column of the window and those of the next.
static void census_plane(uint8_t *const window[], int pitch,
                         const struct match_comparison comparison[8], uint8_t mask, int width,
                         uint8_t *restrict plane) {
    const uint8_t *pixel[8], *other[8];
    for (int i = 0; i < 8; i++) {
        pixel[i] = window[comparison[i].row] + pitch * comparison[i].column;
        other[i] = window[comparison[i].other_row] + pitch * comparison[i].other_column;
    }
    const uint8_t kept = (uint8_t)(UINT8_MAX - mask);
#if defined(VECTOR_HAS_CELLS)
    enum { PIECE = 128 };
    _Alignas(4) uint8_t bits[PIECE + CENSUS_MORE];
    for (int begin = 0; begin < width; begin += PIECE) {
        const int count = width - begin < PIECE ? width - begin : PIECE;
        memset(bits, 0, PIECE);
        for (int i = 0; i < 8; i++) {
            census_compare(pixel[i] + begin, other[i] + begin, bits, count);
        }
        for (int x = 0; x < count; x++) {
            plane[begin + x] = (uint8_t)((plane[begin + x] & kept) | (bits[x] & mask));
        }
    }
#else
    for (int x = 0; x < width; x++) {
        uint8_t bits = 0;
        for (int i = 0; i < 8; i++) {
            bits = (uint8_t)(bits | (pixel[i][x] > other[i][x] ? 1 << i : 0));
        }
        plane[x] = (uint8_t)((plane[x] & kept) | (bits & mask));
    }
#endif
}

static void gradient_row(uint8_t *const window[], int pitch, int width,
                         uint8_t *restrict gradient) {
#if defined(VECTOR_HAS_CELLS)
    if (pitch == 1) {
        bytes_gradient(window[1] + MATCH_CENSUS_RADIUS, window[2] + MATCH_CENSUS_RADIUS,
                       window[3] + MATCH_CENSUS_RADIUS, width, gradient);
        return;
    }
#endif
    const uint8_t *before[3], *after[3];
    for (int j = 0; j < 3; j++) {
        before[j] = window[j + 1] + pitch;
        after[j] = window[j + 1] + 3 * pitch;
    }
    for (int x = 0; x < width; x++) {
        const int16_t slope =
            (int16_t)(after[0][x] - before[0][x] + 2 * (after[1][x] - before[1][x]) + after[2][x] -
                      before[2][x]);
        const int16_t shifted = (int16_t)(128 + slope / 2);
        gradient[x] = (uint8_t)(shifted < 0 ? 0 : (shifted > 255 ? 255 : shifted));
    }
}

static const struct match_comparison *census_of(const struct match_level *level) {
    if (!match_is_finest(level)) {
        return match_coarser_census;
    }
    return level->state->look.smoothing > TUNE_SMOOTHING_WEAK ? match_smoothed_census
                                                              : match_finest_census;
}

// What the features of a level take from a channel.
struct channel_use {
    int channel;
    uint8_t bits[MATCH_CENSUS_PLANES];  // of each plane of the census
    uint32_t positions;  // of the window, by MATCH_CENSUS_SIDE * row + column; 0: none
};

static uint32_t position_bit(int row, int column) {
    return 1u << (MATCH_CENSUS_SIDE * row + column);
}

static struct channel_use use_of(const struct match_level *level, int channel) {
    struct channel_use use = {.channel = channel};
    for (int i = 0; i < 8 * MATCH_CENSUS_PLANES; i++) {
        const struct match_comparison *one = &census_of(level)[i];
        if ((match_compares_colour(level->state) ? one->channel : MATCH_GREY) == channel) {
            use.bits[i / 8] = (uint8_t)(use.bits[i / 8] | 1 << i % 8);
            use.positions |= position_bit(one->row, one->column) |
                             position_bit(one->other_row, one->other_column);
        }
    }
    for (int row = 1; row <= 3 && channel == MATCH_GREY; row++) {
        use.positions |= position_bit(row, 1) | position_bit(row, 3);  // of the gradient
    }
    return use;
}

// The features of `width` pixels from x_begin on that a window of a channel gives: its part of the
// census (R. Zabih and J. Woodfill, ECCV 1994), and Sobel's gradient along the row of grey.
static void compare_window(const struct match_level *level, uint8_t *const window[], int pitch,
                           const struct channel_use *use, int width,
                           const struct match_features *features) {
    for (int plane = 0; plane < MATCH_CENSUS_PLANES; plane++) {
        if (use->bits[plane] != 0) {
            census_plane(window, pitch, census_of(level) + 8 * plane, use->bits[plane], width,
                         features->census[plane]);
        }
    }
    if (use->channel == MATCH_GREY) {
        gradient_row(window, pitch, width, features->gradient);
    }
}

// Where the left image shows what the right one shows `i` columns and `j` rows from a pixel on the
// tile's surface: in 1/256 columns from the left pixel, at most 12 columns away.
static int support_q8(const struct match_tile *tile, int i, int j) {
    enum { POSITIVE = 16 * DISPARITY_ONE };  // rounds down, as shifts do
    // Where the surface turns away from the right camera fewer columns of it show more of the left.
    const int narrowed = MATCH_SLOPE_ONE - tile->slope_along;
    const int scale = narrowed > TUNE_SUPPORT_NARROWED ? narrowed : TUNE_SUPPORT_NARROWED;
    const int right = i * MATCH_SLOPE_ONE + j * tile->slope_down;
    return (right * DISPARITY_ONE + scale / 2 + POSITIVE * scale) / scale - POSITIVE;
}

enum { SUPPORT_PIXELS = MATCH_ROWS_ABREAST * MATCH_TILE_COLUMNS };

// Pixels of a channel around those of a tile in some rows, by row and column of the window.
typedef uint8_t tile_support[MATCH_CENSUS_SIDE * MATCH_CENSUS_SIDE][SUPPORT_PIXELS];

// The support of a tile's pixels from x_begin on, in the middle rows of rows + 4 padded ones,
// sheared like the tile's surface: the left pixels that show what the right image shows in a square
// around the matching pixel.
static void shear_support(uint8_t *const source[], const struct match_tile *tile, int x_begin,
                          int columns, int rows, uint32_t positions, tile_support support) {
    for (int i = 0; i < MATCH_CENSUS_SIDE * MATCH_CENSUS_SIDE; i++) {
        if ((positions >> i & 1) == 0) {
            continue;
        }
        const int j = i / MATCH_CENSUS_SIDE;
        const int at_q8 =
            support_q8(tile, i % MATCH_CENSUS_SIDE - MATCH_CENSUS_RADIUS, j - MATCH_CENSUS_RADIUS);
        INVARIANT(at_q8 >= -MATCH_SHEAR_MAX * DISPARITY_ONE &&
                  at_q8 < MATCH_SHEAR_MAX * DISPARITY_ONE);
        const uint16_t share = (uint16_t)(at_q8 & 0xff);
        const uint16_t rest = (uint16_t)(256 - share);
        for (int r = 0; r < rows; r++) {
            const uint8_t *restrict from =
                source[r + j] + MATCH_SOURCE_PAD + x_begin + (at_q8 >> 8);
            uint8_t *restrict to = support[i] + r * MATCH_TILE_COLUMNS;
            for (int c = 0; c < columns; c++) {
                const uint16_t sum = (uint16_t)(from[c] * rest + from[c + 1] * share + 128);
                to[c] = (uint8_t)(sum >> 8);
            }
        }
    }
}

// Copies the features of a tile's pixels in some rows from or to the `lines`.
static void copy_features(const struct match_line *lines, int x_begin, int rows, bool back,
                          const struct match_features *tile) {
    for (int i = 0; i <= MATCH_CENSUS_PLANES; i++) {
        uint8_t *here = i < MATCH_CENSUS_PLANES ? tile->census[i] : tile->gradient;
        for (int r = 0; r < rows; r++, here += MATCH_TILE_COLUMNS) {
            const struct match_features *left = &lines[r].cost.left;
            uint8_t *line = (i < MATCH_CENSUS_PLANES ? left->census[i] : left->gradient) + x_begin;
            memcpy(back ? line : here, back ? here : line, MATCH_TILE_COLUMNS);
        }
    }
}

// The features of some rows that a channel gives, from padded rows. In tiles that follow a slope
// the support is sheared; `tiles` is NULL in the right image.
static void compare_channel(const struct match_level *level, const struct match_tile *tiles,
                            uint8_t *const source[], const struct channel_use *use, int rows,
                            const struct match_line *lines) {
    uint8_t *window[MATCH_CENSUS_SIDE];
    for (int r = 0; r < rows; r++) {
        for (int j = 0; j < MATCH_CENSUS_SIDE; j++) {
            window[j] = source[r + j] + MATCH_SOURCE_PAD - MATCH_CENSUS_RADIUS;
        }
        compare_window(level, window, 1, use, level->width, &lines[r].cost.left);
    }
    for (int t = 0; tiles != NULL && t < level->tiles; t++) {
        if (tiles[t].slope_down == 0 && tiles[t].slope_along == 0) {
            continue;
        }
        const int x = t * MATCH_TILE_COLUMNS;
        tile_support support;
        shear_support(source, &tiles[t], x, match_tile_columns(level, t), rows, use->positions,
                      support);
        for (int j = 0; j < MATCH_CENSUS_SIDE; j++) {
            window[j] = support[MATCH_CENSUS_SIDE * j];
        }
        uint8_t pixels[MATCH_CENSUS_PLANES + 1][SUPPORT_PIXELS];
        const struct match_features features = {{pixels[0], pixels[1], pixels[2]}, pixels[3]};
        copy_features(lines, x, rows, false, &features);
        compare_window(level, window, SUPPORT_PIXELS, use, rows * MATCH_TILE_COLUMNS, &features);
        copy_features(lines, x, rows, true, &features);
    }
}

// Index i of the result is right pixel (width - 1 + pad) - i; the ends are repeated.
static void reverse_feature(const struct match_level *level, const uint8_t *restrict from,
                            uint8_t *restrict to) {
    const int width = level->width;
    uint8_t *restrict reversed = to + level->right_pad;
    for (int i = 0; i < width; i++) {
        reversed[i] = from[width - 1 - i];
    }
    memset(to, reversed[0], (size_t)level->right_pad);
    const int end = level->right_pad + width;
    memset(to + end, to[end - 1], (size_t)(level->right_length - end));
}

// The largest step of three channels is about 8/5 of that of grey.
static void as_grey_steps(uint8_t *restrict step, int width) {
    for (int x = 0; x < width; x++) {
        step[x] = (uint8_t)((TUNE_COLOUR_STEP * step[x] + 4) / 8);
    }
}

// Raises the steps of a row to those of one channel, if these are larger.
static void raise_steps(const uint8_t *restrict above, const uint8_t *restrict row, int width,
                        uint8_t *restrict along, uint8_t *restrict down) {
#if defined(VECTOR_HAS_CELLS)
    bytes_raise(above, row, width, along, down);
#else
    for (int x = 0; x < width; x++) {
        // The pixel before the first one repeats it.
        const uint8_t from_before = match_step(row[x], row[x - 1]);
        const uint8_t from_above = match_step(row[x], above[x]);
        along[x] = from_before > along[x] ? from_before : along[x];
        down[x] = from_above > down[x] ? from_above : down[x];
    }
#endif
}

// Raises the steps of the rows from y_begin on to those of the channel in scratch->source.
static void raise_step_rows(const struct match_level *level, const struct match_scratch *scratch,
                            int y_begin, int rows) {
    uint8_t *const *source = scratch->source + MATCH_CENSUS_RADIUS;
    for (int r = 0; r < rows; r++) {
        const int slot = (y_begin + r) % level->ring_rows;
        raise_steps(source[r - 1] + MATCH_SOURCE_PAD, source[r] + MATCH_SOURCE_PAD, level->width,
                    level->step_along[slot], level->step_down[slot]);
    }
}

// Whether the steps of a level are those of colour.
static bool has_coloured_steps(const struct match_level *level) {
    return match_is_coloured(level->state) && match_is_finest(level);
}

// Features of rows, in the memory of the left ones, whose `tiles` are not NULL: their steps too.
// Each channel is read once, grey last: its rows stay in scratch->source.
static void view_features(const struct match_level *level, const struct image_view *view,
                          const struct match_tile *tiles, struct match_scratch *scratch,
                          int y_begin, int rows) {
    for (int channel = 0; channel < MATCH_CHANNELS; channel++) {
        const bool steps = tiles != NULL && has_coloured_steps(level) == (channel != MATCH_GREY);
        const struct channel_use use = use_of(level, channel);
        if (!steps && use.positions == 0) {
            continue;
        }
        channel_rows(level, view, channel, y_begin, rows, scratch);
        if (use.positions != 0) {
            compare_channel(level, tiles, scratch->source, &use, rows, scratch->line);
        }
        if (steps) {
            raise_step_rows(level, scratch, y_begin, rows);
        }
    }
}

static void left_features(struct match_level *level, struct match_scratch *scratch,
                          const struct match_tile *tiles, int y_begin, int rows) {
    const struct match_input *input = level->state->input;
    const struct image_view view = {match_is_finest(level) ? &input->left : &level->picture[0],
                                    &input->left_colour, input->left_span};
    const size_t columns = (size_t)level->tiles * MATCH_TILE_COLUMNS;
    for (int r = 0; r < rows; r++) {
        memset(level->step_along[(y_begin + r) % level->ring_rows], 0, columns);
        memset(level->step_down[(y_begin + r) % level->ring_rows], 0, columns);
    }
    view_features(level, &view, tiles, scratch, y_begin, rows);
    for (int r = 0; r < rows; r++) {
        const int slot = (y_begin + r) % level->ring_rows;
        if (has_coloured_steps(level)) {
            as_grey_steps(level->step_along[slot], level->width);
            as_grey_steps(level->step_down[slot], level->width);
        }
        if (level->guide[slot] != NULL) {
            memcpy(level->guide[slot], scratch->source[r + MATCH_CENSUS_RADIUS] + MATCH_SOURCE_PAD,
                   (size_t)level->width);
        }
    }
}

static void right_features(const struct match_level *level, struct match_scratch *scratch,
                           int y_begin, int rows) {
    const struct match_input *input = level->state->input;
    const struct image_view view = {match_is_finest(level) ? &input->right : &level->picture[1],
                                    &input->right_colour, input->right_span};
    // The left features do not exist yet, so their memory holds these before they are reversed.
    view_features(level, &view, NULL, scratch, y_begin, rows);
    for (int r = 0; r < rows; r++) {
        const struct match_line *line = &scratch->line[r];
#if defined(VECTOR_HAS_CELLS)
        bytes_reverse_census(line->cost.left.census, level->width, level->right_pad,
                             level->right_length, line->cost.right_census);
#else
        for (int plane = 0; plane < MATCH_CENSUS_PLANES; plane++) {
            reverse_feature(level, line->cost.left.census[plane], line->cost.right.census[plane]);
        }
#endif
        reverse_feature(level, line->cost.left.gradient, line->cost.right.gradient);
    }
}

#endif
