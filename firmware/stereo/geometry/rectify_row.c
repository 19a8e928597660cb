// SPDX-License-Identifier: Apache-2.0
// One rectified row at a time, integers only.
#include <string.h>

#include "core/invariant.h"
#include "stereo/geometry/rectify.h"
#if defined(__bfin__)
#include "stereo/bfin/warp.h"
#endif

enum {
    STEP_LOG2_MIN = 2,
    STEP_LOG2_MAX = 4,
    STEP_PX = 1 << STEP_LOG2_MAX,  // common value in most tables, and unit of the fractions
    NODES_MAX = ((IMAGE_MAX_SIDE_PX - 1) >> STEP_LOG2_MIN) + 4,
};

// Between the nodes n1 and n2 of n0 n1 n2 n3 the cubic through all four is, at t = m/16 (Everett's
// form of Lagrange's interpolation; e1, e2: second differences at n1, n2),
//     n1 + t (n2 - n1) - t (1-t) (2-t) / 6 e1 - t (1-t) (1+t) / 6 e2.
// The last two factors, in 1/16384:
#define FACTOR(m) (-((2 * (m) * (16 - (m)) * (32 - (m)) + 1) / 3))
static const int32_t factor_near_q14[STEP_PX] = {
    FACTOR(0), FACTOR(1), FACTOR(2),  FACTOR(3),  FACTOR(4),  FACTOR(5),  FACTOR(6),  FACTOR(7),
    FACTOR(8), FACTOR(9), FACTOR(10), FACTOR(11), FACTOR(12), FACTOR(13), FACTOR(14), FACTOR(15),
};
static const int32_t factor_far_q14[STEP_PX] = {
    FACTOR(16), FACTOR(15), FACTOR(14), FACTOR(13), FACTOR(12), FACTOR(11), FACTOR(10), FACTOR(9),
    FACTOR(8),  FACTOR(7),  FACTOR(6),  FACTOR(5),  FACTOR(4),  FACTOR(3),  FACTOR(2),  FACTOR(1),
};

#if defined(__bfin__)
// The two factors of a step, and one that is loaded and not used.
#define FACTORS(m) ((uint32_t)FACTOR(16 - (m)) << 16 | (FACTOR(m) & 0xffff))
static const uint32_t factors_q14[STEP_PX + 1] = {
    FACTORS(0),  FACTORS(1),  FACTORS(2),  FACTORS(3),  FACTORS(4),  FACTORS(5),
    FACTORS(6),  FACTORS(7),  FACTORS(8),  FACTORS(9),  FACTORS(10), FACTORS(11),
    FACTORS(12), FACTORS(13), FACTORS(14), FACTORS(15), 0,
};
#endif

// Any nodes, at m/16 of the way.
static int32_t interpolate(int64_t n0, int64_t n1, int64_t n2, int64_t n3, int m) {
    const int64_t e1 = n0 - 2 * n1 + n2, e2 = n1 - 2 * n2 + n3;
    const int64_t bend = (factor_near_q14[m] * e1 + factor_far_q14[m] * e2) >> 10;
    return (int32_t)(n1 + ((m * (n2 - n1) + bend + STEP_PX / 2) >> STEP_LOG2_MAX));
}

// Bits of a value from -2^bits to 2^bits - 1 that are too many: 0.
static inline uint32_t beyond(int32_t value, int bits) {
    return ((uint32_t)value + (1U << bits)) >> (bits + 1);
}

// What interpolate_32 takes.
struct cell {
    int32_t first, rise, e1, e2;
};

// False if 32 bits do not suffice for the nodes: the factors are below 2^11, and 16 |rise| is below
// 2^31.
static inline bool fits_32(int32_t n0, int32_t n1, int32_t n2, int32_t n3, struct cell *cell) {
    if ((beyond(n0, 28) | beyond(n1, 28) | beyond(n2, 28) | beyond(n3, 28)) != 0) {
        return false;
    }
    *cell = (struct cell){n1, n2 - n1, n0 - 2 * n1 + n2, n1 - 2 * n2 + n3};
    return (beyond(cell->rise, 26) | beyond(cell->e1, 19) | beyond(cell->e2, 19)) == 0;
}

// The same in 32 bits.
static inline int32_t interpolate_32(struct cell c, int32_t m) {
    const int32_t bend = (factor_near_q14[m] * c.e1 + factor_far_q14[m] * c.e2) >> 10;
    return c.first + ((m * c.rise + bend + STEP_PX / 2) >> STEP_LOG2_MAX);
}

// The table's nodes at the height of row y.
static void cut_nodes(const struct rectify_table *table, const int32_t *nodes_q16, int y,
                      int32_t *cut_q16) {
    const int step_log2 = table->step_log2;
    const int cell = y >> step_log2;
    const int m = (y & ((1 << step_log2) - 1)) << (STEP_LOG2_MAX - step_log2);
    INVARIANT(cell + 3 < table->rows);
    const int32_t *n0 = nodes_q16 + (ptrdiff_t)cell * table->columns;
    const int32_t *n1 = n0 + table->columns;
    const int32_t *n2 = n1 + table->columns;
    const int32_t *n3 = n2 + table->columns;
    for (int i = 0; i < table->columns; i++) {
        struct cell here;
        cut_q16[i] = fits_32(n0[i], n1[i], n2[i], n3[i], &here)
                         ? interpolate_32(here, m)
                         : interpolate(n0[i], n1[i], n2[i], n3[i], m);
    }
}

// One cell of a row: `count` pixels from n[1] towards n[2].
static void fill_cell(const int32_t n[4], int step_log2, int count, int32_t *q16) {
    struct cell here;
    if (!fits_32(n[0], n[1], n[2], n[3], &here)) {
        for (int x = 0; x < count; x++) {
            q16[x] = interpolate(n[0], n[1], n[2], n[3], x << (STEP_LOG2_MAX - step_log2));
        }
        return;
    }
    if (count == STEP_PX) {
        for (int32_t m = 0; m < STEP_PX; m++) {
            q16[m] = interpolate_32(here, m);
        }
        return;
    }
    for (int32_t x = 0; x < count; x++) {
        q16[x] = interpolate_32(here, x << (STEP_LOG2_MAX - step_log2));
    }
}

#if defined(__bfin__)
// As cut_nodes; false if 32 bits do not suffice for a node, or for the differences of those that
// were cut.
static bool cut_nodes_32(const int32_t *nodes_q16, int columns, int m, int32_t *cut_q16) {
    const uint32_t range = 1U << 27;
    const uint32_t near = (uint32_t)factor_near_q14[m], far = (uint32_t)factor_far_q14[m];
    uint32_t places = 0, bends = 0, rises = 0;
    for (int i = 0; i < columns; i++, nodes_q16++) {
        const uint32_t n0 = (uint32_t)nodes_q16[0], n1 = (uint32_t)nodes_q16[columns];
        const uint32_t n2 = (uint32_t)nodes_q16[2 * columns];
        const uint32_t n3 = (uint32_t)nodes_q16[3 * columns];
        const uint32_t rise = n2 - n1, e1 = n0 - n1 + rise, e2 = n3 - n2 - rise;
        places |= (n0 + range) | (n1 + range) | (n2 + range) | (n3 + range);
        bends |= (e1 + (1U << 19)) | (e2 + (1U << 19));
        rises |= rise + (1U << 26);
        const int32_t bend = (int32_t)(near * e1 + far * e2) >> 10;
        const uint32_t moved = (uint32_t)m * rise + (uint32_t)bend + STEP_PX / 2;
        cut_q16[i] = (int32_t)(n1 + (uint32_t)((int32_t)moved >> STEP_LOG2_MAX));
    }
    return (places >> 28 | bends >> 20 | rises >> 27) == 0;
}

// All cells of a row from such nodes; most bends fit 16 bits, which is what warp_line takes.
static void fill_cells(const int32_t *cut_q16, int width, int32_t *q16) {
    int32_t before = cut_q16[1] - cut_q16[0], rise = cut_q16[2] - cut_q16[1];
    for (; width > 0; width -= STEP_PX, cut_q16++, q16 += STEP_PX) {
        const int count = width < STEP_PX ? width : STEP_PX;
        const int32_t after = cut_q16[3] - cut_q16[2];
        const int32_t e1 = rise - before, e2 = after - rise;
        if ((beyond(rise, 26) | beyond(e1, 15) | beyond(e2, 15)) == 0) {
            warp_line(cut_q16[1], rise, (uint32_t)e2 << 16 | (e1 & 0xffff), factors_q14, q16,
                      count);
        } else {
            fill_cell(cut_q16, STEP_LOG2_MAX, count, q16);
        }
        before = rise;
        rise = after;
    }
}
#endif

static void fill_row(const struct rectify_table *table, const int32_t *nodes_q16, int y,
                     int32_t *q16) {
    int32_t cut_q16[NODES_MAX];
    INVARIANT(table->columns <= NODES_MAX);
    INVARIANT(table->step_log2 >= STEP_LOG2_MIN && table->step_log2 <= STEP_LOG2_MAX);
#if defined(__bfin__)
    const int32_t *nodes = nodes_q16 + (ptrdiff_t)(y >> STEP_LOG2_MAX) * table->columns;
    if (table->step_log2 == STEP_LOG2_MAX &&
        cut_nodes_32(nodes, table->columns, y % STEP_PX, cut_q16)) {
        fill_cells(cut_q16, table->width_px, q16);
        return;
    }
#endif
    cut_nodes(table, nodes_q16, y, cut_q16);
    const int step_px = 1 << table->step_log2;
    for (int x = 0; x < table->width_px; x += step_px) {
        const int left = table->width_px - x;
        fill_cell(cut_q16 + (x >> table->step_log2), table->step_log2,
                  left < step_px ? left : step_px, q16 + x);
    }
}

void rectify_row_coordinates(const struct rectify_table *table, int y, int32_t *x_q16,
                             int32_t *y_q16) {
    INVARIANT(y >= 0 && y < table->height_px);
    if (table->identity) {
        for (int x = 0; x < table->width_px; x++) {
            x_q16[x] = (x + table->offset_x_px) * 65536;
            y_q16[x] = (y + table->offset_y_px) * 65536;
        }
        return;
    }
    fill_row(table, table->x_q16, y, x_q16);
    fill_row(table, table->y_q16, y, y_q16);
}

// The coordinates whose four pixels are inside: 0 <= x < limit.
struct inside {
    uint32_t x_limit_q16, y_limit_q16;
};

static bool is_inside(const struct inside *inside, int32_t x_q16, int32_t y_q16) {
    return (uint32_t)x_q16 < inside->x_limit_q16 && (uint32_t)y_q16 < inside->y_limit_q16;
}

// A row that crosses a curved border twice has several runs: the longest one is used.
static struct rectify_span longest_run(const struct inside *inside, const int32_t *x_q16,
                                       const int32_t *y_q16, struct rectify_span view) {
    struct rectify_span best = {0, 0};
    int begin = view.begin;
    for (int x = view.begin; x <= view.end; x++) {
        if (x < view.end && is_inside(inside, x_q16[x], y_q16[x])) {
            continue;
        }
        if (x - begin > best.end - best.begin) {
            best = (struct rectify_span){(int16_t)begin, (int16_t)x};
        }
        begin = x + 1;
    }
    return best;
}

static struct rectify_span find_span(const struct rectify_table *table, int y, const int32_t *x_q16,
                                     const int32_t *y_q16) {
    const struct inside inside = {(uint32_t)(table->raw_width_px - 1) << 16,
                                  (uint32_t)(table->raw_height_px - 1) << 16};
    const struct rectify_span view =
        table->view == NULL ? (struct rectify_span){0, (int16_t)table->width_px} : table->view[y];
    INVARIANT(view.begin >= 0 && view.begin <= view.end && view.end <= table->width_px);
    int begin = view.begin, end = view.end;
    while (begin < end && !is_inside(&inside, x_q16[begin], y_q16[begin])) {
        begin++;
    }
    if (begin == end) {
        return (struct rectify_span){0, 0};
    }
    while (end > begin && !is_inside(&inside, x_q16[end - 1], y_q16[end - 1])) {
        end--;
    }
    int outside = 0;
    for (int x = begin; x < end; x++) {
        outside +=
            ((uint32_t)x_q16[x] >= inside.x_limit_q16) | ((uint32_t)y_q16[x] >= inside.y_limit_q16);
    }
    if (outside != 0) {
        return longest_run(&inside, x_q16, y_q16, view);
    }
    INVARIANT(begin <= end && end <= INT16_MAX);
    return (struct rectify_span){(int16_t)begin, (int16_t)end};
}

// Rounds a Q16 fraction to 1/2048; 2048 itself is valid and selects the next pixel.
static int32_t fraction_q11(int32_t q16) {
    return ((q16 & 0xffff) + 16) >> 5;
}

static uint8_t blend_u8(const uint8_t *above, const uint8_t *below, int step, int32_t fx_q11,
                        int32_t fy_q11) {
    const int32_t upper = above[0] * 2048 + (above[step] - above[0]) * fx_q11;
    const int32_t lower = below[0] * 2048 + (below[step] - below[0]) * fx_q11;
    return (uint8_t)((upper * 2048 + (lower - upper) * fy_q11 + (1 << 21)) >> 22);
}

struct rectify_extent rectify_row_extent(const struct rectify_table *table, int y,
                                         int32_t *work_q16) {
    if (table->identity) {
        const int16_t row = (int16_t)(y + table->offset_y_px);
        return (struct rectify_extent){{0, (int16_t)table->width_px}, row, row};
    }
    struct rectify_extent extent = {.first = 0, .last = -1};
    int32_t *y_q16 = work_q16 + table->width_px;
    rectify_row_coordinates(table, y, work_q16, y_q16);
    extent.span = find_span(table, y, work_q16, y_q16);
    if (extent.span.begin == extent.span.end) {
        return extent;
    }
    int32_t first_q16 = y_q16[extent.span.begin], last_q16 = first_q16;
    for (int x = extent.span.begin; x < extent.span.end; x++) {
        first_q16 = y_q16[x] < first_q16 ? y_q16[x] : first_q16;
        last_q16 = y_q16[x] > last_q16 ? y_q16[x] : last_q16;
    }
    extent.first = (int16_t)(first_q16 >> 16);
    extent.last = (int16_t)((last_q16 >> 16) + 1);
    return extent;
}

static void copy_from_strip(const struct rectify_table *table, const struct rectify_strip *strip,
                            int y, uint8_t *grey, uint8_t *colour) {
    const int row = y + table->offset_y_px - strip->begin;
    const size_t width = (size_t)table->width_px;
    memcpy(grey, image_u8_row(&strip->grey, row) + table->offset_x_px, width);
    if (colour != NULL) {
        memcpy(colour, image_rgb8_row(&strip->colour, row) + 3 * table->offset_x_px, 3 * width);
    }
}

#if defined(__bfin__)
// In both images; false: the strip has a part of the row only, or rows of other lengths.
static bool blend_whole_row(const struct rectify_strip *strip, const struct rectify_extent *extent,
                            const int32_t *x_q16, const int32_t *y_q16, uint8_t *grey,
                            uint8_t *colour) {
    const ptrdiff_t stride = strip->grey.stride;
    if (colour == NULL || strip->colour.stride != 3 * stride || extent->first < strip->begin ||
        extent->last >= strip->end) {
        return false;
    }
    const int begin = extent->span.begin, count = extent->span.end - begin;
    const struct warp_images images = {strip->grey.data - strip->begin * stride,
                                       strip->colour.data - strip->begin * 3 * stride,
                                       strip->grey.stride};
    warp_row(&images, x_q16 + begin, y_q16 + begin, grey + begin, colour + 3 * begin, count);
    return true;
}
#endif

void rectify_row_strip(const struct rectify_table *table, const struct rectify_strip *strip,
                       const struct rectify_extent *extent, int y, uint8_t *grey, uint8_t *colour,
                       int32_t *work_q16) {
    INVARIANT(strip->begin >= 0 && strip->end <= table->raw_height_px);
    if (extent->last < strip->begin || extent->first >= strip->end) {
        return;
    }
    if (table->identity) {
        copy_from_strip(table, strip, y, grey, colour);
        return;
    }
    INVARIANT(extent->span.begin >= 0 && extent->span.end <= table->width_px);
    rectify_row_coordinates(table, y, work_q16, work_q16 + table->width_px);
    const int32_t *x_q16 = work_q16, *y_q16 = work_q16 + table->width_px;
    const ptrdiff_t grey_stride = strip->grey.stride, colour_stride = strip->colour.stride;
    const uint32_t upper_rows = (uint32_t)(strip->end - strip->begin - 1);
#if defined(__bfin__)
    if (blend_whole_row(strip, extent, x_q16, y_q16, grey, colour)) {
        return;
    }
#endif
    for (int x = extent->span.begin; x < extent->span.end; x++) {
        const int32_t row = (y_q16[x] >> 16) - strip->begin, column = x_q16[x] >> 16;
        if ((uint32_t)row >= upper_rows) {
            continue;
        }
        const int32_t fx_q11 = fraction_q11(x_q16[x]), fy_q11 = fraction_q11(y_q16[x]);
        const uint8_t *p = strip->grey.data + row * grey_stride + column;
        grey[x] = blend_u8(p, p + grey_stride, 1, fx_q11, fy_q11);
        if (colour == NULL) {
            continue;
        }
        p = strip->colour.data + row * colour_stride + 3 * column;
        for (int channel = 0; channel < 3; channel++, p++) {
            colour[3 * x + channel] = blend_u8(p, p + colour_stride, 3, fx_q11, fy_q11);
        }
    }
}
