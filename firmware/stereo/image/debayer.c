// SPDX-License-Identifier: Apache-2.0
#include "stereo/image/debayer.h"

#include <stdbool.h>
#include <stddef.h>

#include "core/invariant.h"
#if defined(__bfin__)
#include "stereo/bfin/mosaic.h"
#endif

enum {
    PAD = DEBAYER_MARGIN_PX / 2,  // columns of green kept on both sides of a row
    GREEN_ROWS = 5,               // that an estimate of green depends on
};

static int32_t absolute(int32_t v) {
    return v < 0 ? -v : v;
}

// Mirrors an index about the first and last element; the colour pattern continues.
static int mirror(int i, int size) {
    const int period = 2 * (size - 1);
    INVARIANT(size >= 2);
    const int j = i % period + (i < 0 && i % period != 0 ? period : 0);
    return j < size ? j : period - j;
}

static const uint16_t *row_at(const struct image_u16 *raw, int y) {
    return image_u16_row(raw, mirror(y, raw->height));
}

// Estimates green where red or blue was measured, from two green pixels and two of the same colour
// on both sides, along the row and across it.
static int32_t estimate_green(int32_t middle, int32_t left2, int32_t left, int32_t right,
                              int32_t right2, int32_t up2, int32_t up, int32_t down,
                              int32_t down2) {
    const int32_t along_bend = 2 * middle - left2 - right2;
    const int32_t across_bend = 2 * middle - up2 - down2;
    const int32_t along_change = absolute(left - right) + absolute(along_bend);
    const int32_t across_change = absolute(up - down) + absolute(across_bend);
    const int32_t along_q2 = 2 * (left + right) + along_bend;
    const int32_t across_q2 = 2 * (up + down) + across_bend;
    const int32_t both_q3 = along_change == across_change  ? along_q2 + across_q2
                            : along_change < across_change ? 2 * along_q2
                                                           : 2 * across_q2;
    return (both_q3 + 4) >> 3;
}

#if defined(__bfin__)
// In the unused margin of a row of green: all pixels that it depends on fit mosaic_row().
enum { FITS = 0 };

// Fills green from column x on, two at a time where the pixels allow it; where the rest begins.
static int fill_green_pairs(const uint16_t *const row[GREEN_ROWS], int x, int width,
                            int32_t *green) {
    uint32_t bits = 0;
    for (int i = 0; i < GREEN_ROWS; i++) {
        bits |= (uint32_t)(uintptr_t)row[i] % sizeof(pair16);
    }
    green[FITS] = 0;
    if (bits != 0) {
        return x;
    }
    const int end = width - 4;
    bits = x % 2 != 0 ? mosaic_green(row, x, end, green + PAD, true)
                      : mosaic_green(row, x, end, green + PAD, false);
    green[FITS] = ((bits | bits << 16) >> 16 >> MOSAIC_BITS) == 0;
    return green[FITS] && end > x ? x + (end - x + 1) / 4 * 4 : x;
}
#else
static int fill_green_pairs(const uint16_t *const row[GREEN_ROWS], int x, int width,
                            const int32_t *green) {
    (void)row, (void)width, (void)green;
    return x;
}
#endif

// Green of a column near the first or the last one.
static void fill_green_edge(const uint16_t *const row[GREEN_ROWS], int x, int width,
                            int32_t *green) {
    INVARIANT(x >= 0 && x < width);
    const uint16_t *here = row[GREEN_ROWS / 2];
    const int l2 = mirror(x - 2, width), l = mirror(x - 1, width);
    const int r = mirror(x + 1, width), r2 = mirror(x + 2, width);
    green[x + PAD] = estimate_green(here[x], here[l2], here[l], here[r], here[r2], row[0][x],
                                    row[1][x], row[3][x], row[4][x]);
}

// Green of the columns -1..width of row y into green[x + PAD]: measured, or estimated.
static void fill_green(const struct image_u16 *raw, int y, int32_t *green) {
    const uint16_t *row[GREEN_ROWS];
    for (int i = 0; i < GREEN_ROWS; i++) {
        row[i] = row_at(raw, y + i - GREEN_ROWS / 2);
    }
    const uint16_t *here = row[GREEN_ROWS / 2];
    const int width = raw->width;
    const int first = 1 - (y & 1);  // first column without green; mirroring rows keeps it
    for (int x = 1 - first; x < width; x += 2) {
        green[x + PAD] = here[x];
    }
    fill_green_edge(row, first, width, green);
    int x = fill_green_pairs(row, first + 2, width, green);
    for (; x < width - 2; x += 2) {
        green[x + PAD] = estimate_green(here[x], here[x - 2], here[x - 1], here[x + 1], here[x + 2],
                                        row[0][x], row[1][x], row[3][x], row[4][x]);
    }
    for (; x < width; x += 2) {
        fill_green_edge(row, x, width, green);
    }
    green[PAD - 1] = green[PAD + 1];
    green[PAD + width] = green[PAD + width - 2];
}

static uint16_t clamp(int32_t value, int32_t largest) {
    return (uint16_t)(value < 0 ? 0 : value > largest ? largest : value);
}

// Rows above, at and below an output row; green has its padding in front.
struct context {
    const uint16_t *up, *here, *down;
    const int32_t *green_up, *green, *green_down;
};

// Estimates the colour of the neighbouring rows where this row has its own colour: along the
// diagonal that changes less.
static int32_t estimate_other(const struct context *c, int x, int left, int right) {
    const int32_t *up = c->green_up + PAD + x, *down = c->green_down + PAD + x;
    const int32_t here2 = 2 * c->green[PAD + x];
    const int32_t falling_bend = here2 - up[-1] - down[1];
    const int32_t rising_bend = here2 - up[1] - down[-1];
    const int32_t falling_change = absolute(c->up[left] - c->down[right]) + absolute(falling_bend);
    const int32_t rising_change = absolute(c->up[right] - c->down[left]) + absolute(rising_bend);
    const int32_t falling_q1 = c->up[left] + c->down[right] + falling_bend;
    const int32_t rising_q1 = c->up[right] + c->down[left] + rising_bend;
    const int32_t both_q2 = falling_change == rising_change  ? falling_q1 + rising_q1
                            : falling_change < rising_change ? 2 * falling_q1
                                                             : 2 * rising_q1;
    return (both_q2 + 2) >> 2;
}

// A pixel whose own colour (red in even rows, blue in odd ones) was measured.
static void fill_site(const struct context *c, int x, int left, int right, int own, int32_t largest,
                      uint16_t *rgb) {
    rgb[own] = clamp(c->here[x], largest);
    rgb[1] = clamp(c->green[PAD + x], largest);
    rgb[2 - own] = clamp(estimate_other(c, x, left, right), largest);
}

// A pixel whose green was measured: the row's colour from left and right, the other one from above
// and below, both as differences to green.
static void fill_green_site(const struct context *c, int x, int left, int right, int own,
                            int32_t largest, uint16_t *rgb) {
    const int32_t *green = c->green + PAD + x;
    const int32_t beside_q1 = c->here[left] - green[-1] + c->here[right] - green[1];
    const int32_t above_q1 = c->up[x] - c->green_up[PAD + x] + c->down[x] - c->green_down[PAD + x];
    rgb[own] = clamp(green[0] + ((beside_q1 + 1) >> 1), largest);
    rgb[1] = clamp(green[0], largest);
    rgb[2 - own] = clamp(green[0] + ((above_q1 + 1) >> 1), largest);
}

static void fill_pixel(const struct context *c, int x, int width, int first, int own,
                       int32_t largest, uint16_t *rgb) {
    const int left = x > 0 ? x - 1 : 1, right = x < width - 1 ? x + 1 : width - 2;
    if ((x & 1) == first) {
        fill_site(c, x, left, right, own, largest, rgb + 3 * x);
    } else {
        fill_green_site(c, x, left, right, own, largest, rgb + 3 * x);
    }
}

#if defined(__bfin__)
// Fills pixels from column x on, which is one whose colour was measured, two of them and two of
// green at a time; where the rest begins.
static int fill_pairs(const struct context *c, int x, int width, int own, int32_t largest,
                      uint16_t *rgb) {
    if (!c->green_up[FITS] || !c->green[FITS] || !c->green_down[FITS] || largest > INT16_MAX) {
        return x;
    }
    const struct mosaic_rows rows = {
        c->up, c->here, c->down, c->green_up + PAD, c->green + PAD, c->green_down + PAD};
    return x % 2 != 0 ? mosaic_row(&rows, x, width - 4, true, own, largest, rgb)
                      : mosaic_row(&rows, x, width - 4, false, own, largest, rgb);
}
#else
static int fill_pairs(const struct context *c, int x, int width, int own, int32_t largest,
                      const uint16_t *rgb) {
    (void)c, (void)width, (void)own, (void)largest, (void)rgb;
    return x;
}
#endif

// Green of row y, which may be beyond the image, has the memory of every third row.
static int32_t *green_at(int32_t *work, int y, int width) {
    return work + (ptrdiff_t)((y + 3) % 3) * (width + 2 * PAD);
}

// All pixels of a row but the first and the last one.
static void fill_inside(const struct context *c, int first, int width, int own, int32_t largest,
                        uint16_t *rgb) {
    if (first == 0 && width > 2) {
        fill_green_site(c, 1, 0, 2, own, largest, rgb + 3);
    }
    const int begin = fill_pairs(c, 2 - first, width, own, largest, rgb);
    INVARIANT(begin % 2 == first && begin <= width + first);
    for (int x = begin; x < width - 1; x += 2) {
        fill_site(c, x, x - 1, x + 1, own, largest, rgb + 3 * x);
    }
    for (int x = begin + 1; x < width - 1; x += 2) {
        fill_green_site(c, x, x - 1, x + 1, own, largest, rgb + 3 * x);
    }
}

static void make_row(const struct image_u16 *raw, int bits, int y, bool next, uint16_t *rgb,
                     int32_t *work) {
    INVARIANT(raw->width >= 2 && raw->height >= 2);
    INVARIANT(bits >= 8 && bits <= 16 && y >= 0 && y < raw->height);
    INVARIANT(rgb != NULL && work != NULL);
    const int width = raw->width;
    for (int row = next ? y + 1 : y - 1; row <= y + 1; row++) {
        fill_green(raw, mirror(row, raw->height), green_at(work, row, width));
    }
    const struct context context = {row_at(raw, y - 1),       row_at(raw, y),
                                    row_at(raw, y + 1),       green_at(work, y - 1, width),
                                    green_at(work, y, width), green_at(work, y + 1, width)};
    const int32_t largest = (1 << bits) - 1;
    const int own = 2 * (y & 1);  // red or blue
    const int first = 1 - (y & 1);
    fill_pixel(&context, 0, width, first, own, largest, rgb);
    fill_inside(&context, first, width, own, largest, rgb);
    fill_pixel(&context, width - 1, width, first, own, largest, rgb);
}

void debayer_row(const struct image_u16 *raw, int bits, int y, uint16_t *rgb, int32_t *work) {
    make_row(raw, bits, y, false, rgb, work);
}

void debayer_next_row(const struct image_u16 *raw, int bits, int y, uint16_t *rgb, int32_t *work) {
    INVARIANT(y > 0);
    make_row(raw, bits, y, true, rgb, work);
}
