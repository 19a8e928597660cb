// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/sparse_match.h"

#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/zoom/sparse_align.h"

enum {
    WORDS = 4,          // 64-bit words of a description: 256 comparisons
    PATCH_RADIUS = 15,  // px of the level that a description covers
    MARGIN = PATCH_RADIUS + 3,
    DISTANCE_MAX = 80,  // bits; unrelated descriptions differ by 128 +- 8 or more
};

struct sparse_corner {
    int16_t x, y;  // px of the level
    int32_t score;
    uint64_t bits[WORDS];
};

static int level_factor(int width, int height) {
    const int side = width > height ? width : height;
    int factor = 1;
    while (side / factor > 1100) {
        factor *= 2;
    }
    return factor;
}

void sparse_reduce(const struct image_u8 *image, int factor, struct image_u8 *level) {
    INVARIANT(factor >= 1 && level->width * factor <= image->width);
    for (int y = 0; y < level->height; y++) {
        uint8_t *out = image_u8_row(level, y);
        for (int x = 0; x < level->width; x++) {
            int sum = factor * factor / 2;
            for (int j = 0; j < factor; j++) {
                const uint8_t *row = image_u8_row(image, y * factor + j) + x * factor;
                for (int i = 0; i < factor; i++) {
                    sum += row[i];
                }
            }
            out[x] = (uint8_t)(sum / (factor * factor));
        }
    }
}

// Binomial weights 1 2 1 both ways, in place; `row` holds two rows.
static void smooth(struct image_u8 *level, uint8_t *rows) {
    const int width = level->width;
    uint8_t *above = rows, *present = rows + width;
    memcpy(above, level->data, (size_t)width);
    for (int y = 0; y < level->height; y++) {
        uint8_t *row = image_u8_row(level, y);
        const uint8_t *below = image_u8_row(level, y + 1 < level->height ? y + 1 : y);
        memcpy(present, row, (size_t)width);
        int before = above[0] + 2 * present[0] + below[0], middle = before;
        for (int x = 0; x < width; x++) {
            const int right = x + 1 < width ? x + 1 : x;
            const int after = above[right] + 2 * present[right] + below[right];
            row[x] = (uint8_t)((before + 2 * middle + after + 8) / 16);
            before = middle;
            middle = after;
        }
        uint8_t *kept = above;
        above = present;
        present = kept;
    }
}

// Strength of a corner: determinant over trace of the gradients' products summed over 5 x 5 px.
struct sums {
    int32_t *xx, *xy, *yy;  // sums of each column over five rows
};

static void add_row(const struct image_u8 *level, int y, int sign, struct sums *sums) {
    const uint8_t *above = image_u8_row(level, y - 1), *row = image_u8_row(level, y),
                  *below = image_u8_row(level, y + 1);
    for (int x = 1; x < level->width - 1; x++) {
        const int gx = row[x + 1] - row[x - 1], gy = below[x] - above[x];
        sums->xx[x] += sign * gx * gx;
        sums->xy[x] += sign * gx * gy;
        sums->yy[x] += sign * gy * gy;
    }
}

static void score_row(const struct sums *sums, int width, int32_t *score) {
    for (int x = MARGIN; x < width - MARGIN; x++) {
        int64_t xx = 0, xy = 0, yy = 0;
        for (int i = -2; i <= 2; i++) {
            xx += sums->xx[x + i];
            xy += sums->xy[x + i];
            yy += sums->yy[x + i];
        }
        score[x] = (int32_t)((xx * yy - xy * xy) / (xx + yy + 1));
    }
}

// One corner in each cell at most, so that they cover the picture.
struct cells {
    int size, columns, rows;
    struct sparse_corner *best;  // score 0: none
};

static void collect(const struct image_u8 *level, const struct sums *work, int32_t *score,
                    struct cells *cells) {
    enum {
        // Noise of +-1 grey level gives less.
        SCORE_MIN = 120,
    };
    struct sums sums = *work;
    const size_t bytes = (size_t)level->width * sizeof(int32_t);
    memset(sums.xx, 0, bytes);
    memset(sums.xy, 0, bytes);
    memset(sums.yy, 0, bytes);
    for (int y = MARGIN - 2; y < MARGIN + 2; y++) {
        add_row(level, y, 1, &sums);
    }
    for (int y = MARGIN; y < level->height - MARGIN; y++) {
        add_row(level, y + 2, 1, &sums);
        score_row(&sums, level->width, score);
        add_row(level, y - 2, -1, &sums);
        for (int x = MARGIN; x < level->width - MARGIN; x++) {
            struct sparse_corner *cell =
                &cells->best[(y / cells->size) * cells->columns + x / cells->size];
            if (score[x] > SCORE_MIN && score[x] > cell->score) {
                cell->x = (int16_t)x;
                cell->y = (int16_t)y;
                cell->score = score[x];
            }
        }
    }
}

// Not the slope of a stronger corner in a neighbouring cell.
static bool is_peak(const struct cells *cells, int column, int row) {
    enum { NEAR = 4 };
    const struct sparse_corner *own = &cells->best[row * cells->columns + column];
    for (int j = row > 0 ? row - 1 : 0; j <= row + 1 && j < cells->rows; j++) {
        for (int i = column > 0 ? column - 1 : 0; i <= column + 1 && i < cells->columns; i++) {
            const struct sparse_corner *other = &cells->best[j * cells->columns + i];
            const int dx = other->x - own->x, dy = other->y - own->y;
            if (other->score > own->score && dx * dx + dy * dy < NEAR * NEAR) {
                return false;
            }
        }
    }
    return own->score > 0;
}

// Offsets of the compared pairs: fixed, denser towards the middle.
static void make_pattern(int8_t pattern[64 * WORDS][4]) {
    uint32_t state = 12345;
    for (int i = 0; i < 64 * WORDS; i++) {
        for (int k = 0; k < 4; k++) {
            int sum = 0;
            for (int term = 0; term < 2; term++) {
                state = state * 1664525u + 1013904223u;
                sum += (int)(state >> 16) % (PATCH_RADIUS + 1);
            }
            pattern[i][k] = (int8_t)(sum - PATCH_RADIUS);
        }
    }
}

static void describe(const struct image_u8 *level, int8_t (*pattern)[4],
                     struct sparse_corner *corner) {
    INVARIANT(corner->x >= PATCH_RADIUS && corner->x < level->width - PATCH_RADIUS);
    INVARIANT(corner->y >= PATCH_RADIUS && corner->y < level->height - PATCH_RADIUS);
    const uint8_t *middle = image_u8_row(level, corner->y) + corner->x;
    for (int word = 0; word < WORDS; word++) {
        uint64_t bits = 0;
        for (int i = 0; i < 64; i++) {
            const int8_t *pair = pattern[64 * word + i];
            const int a = middle[pair[1] * level->stride + pair[0]];
            const int b = middle[pair[3] * level->stride + pair[2]];
            bits = bits << 1 | (uint64_t)(a > b);
        }
        corner->bits[word] = bits;
    }
}

static struct cells cells_of(int width, int height, int max) {
    struct cells cells = {.size = 4};
    do {
        cells.size += 2;
        cells.columns = width / cells.size + 1;
        cells.rows = height / cells.size + 1;
    } while (cells.columns * cells.rows > max);
    return cells;
}

int sparse_picture_make(const struct image_u8 *image, int max, struct arena *arena,
                        struct sparse_picture *picture) {
    const int factor = level_factor(image->width, image->height);
    const int width = image->width / factor, height = image->height / factor;
    *picture = (struct sparse_picture){.image = *image, .factor = factor};
    if (width <= 2 * MARGIN || height <= 2 * MARGIN) {
        return ERROR_TOO_SMALL;
    }
    struct cells cells = cells_of(width, height, max);
    INVARIANT(cells.columns * cells.rows <= max && max <= SPARSE_RIGHT_MAX);
    const size_t cell_count = (size_t)cells.columns * (size_t)cells.rows;
    picture->level = (struct image_u8){arena_take(arena, (size_t)width * (size_t)height, 1), width,
                                       height, width};
    picture->corner = cells.best = arena_take(arena, cell_count, sizeof *cells.best);
    const size_t mark = arena_mark(arena);
    int32_t *work = arena_take(arena, 4 * (size_t)width, sizeof *work);
    if (picture->level.data == NULL || cells.best == NULL || work == NULL) {
        return ERROR_MEMORY;
    }
    sparse_reduce(image, factor, &picture->level);
    smooth(&picture->level, (uint8_t *)work);
    memset(cells.best, 0, cell_count * sizeof *cells.best);
    const struct sums sums = {work, work + width, work + 2 * width};
    collect(&picture->level, &sums, work + 3 * width, &cells);
    int8_t pattern[64 * WORDS][4];
    make_pattern(pattern);
    // The peaks move to the front only after all cells are judged.
    for (int row = 0; row < cells.rows; row++) {
        for (int column = 0; column < cells.columns; column++) {
            struct sparse_corner *corner = &cells.best[row * cells.columns + column];
            corner->bits[0] = is_peak(&cells, column, row);
        }
    }
    for (size_t i = 0; i < cell_count; i++) {
        if (cells.best[i].bits[0] != 0) {
            picture->corner[picture->count] = cells.best[i];
            describe(&picture->level, pattern, &picture->corner[picture->count++]);
        }
    }
    INVARIANT(picture->count <= max);
    arena_release(arena, mark);
    return ERROR_OK;
}

size_t sparse_picture_need_bytes(int width, int height, int max) {
    const int factor = level_factor(width, height);
    const size_t level_width = (size_t)(width / factor), level_height = (size_t)(height / factor);
    return arena_need_bytes(level_width * level_height, 1) +
           arena_need_bytes((size_t)max, sizeof(struct sparse_corner)) +
           arena_need_bytes(4 * level_width, sizeof(int32_t));
}

static int bit_count(uint64_t value) {
    value -= value >> 1 & 0x5555555555555555u;
    value = (value & 0x3333333333333333u) + (value >> 2 & 0x3333333333333333u);
    value = (value + (value >> 4)) & 0x0f0f0f0f0f0f0f0fu;
    return (int)(value * 0x0101010101010101u >> 56);
}

static int distance_of(const struct sparse_corner *a, const struct sparse_corner *b) {
    int sum = 0;
    for (int i = 0; i < WORDS; i++) {
        sum += bit_count(a->bits[i] ^ b->bits[i]);
    }
    return sum;
}

// A region in the level's pixels, and the rows that it covers.
struct search {
    double from[2], along[2], length, across, beyond;
    double first, last;
};

static struct search search_of(const struct sparse_region *region, int factor) {
    INVARIANT(region->across >= 0 && region->beyond >= 0);
    struct search s = {.across = region->across / factor, .beyond = region->beyond / factor};
    double to[2];
    for (int i = 0; i < 2; i++) {
        s.from[i] = (region->from[i] + 0.5) / factor - 0.5;
        to[i] = (region->to[i] + 0.5) / factor - 0.5;
        s.along[i] = to[i] - s.from[i];
    }
    s.length = sqrt(s.along[0] * s.along[0] + s.along[1] * s.along[1]);
    s.along[0] = s.length > 0 ? s.along[0] / s.length : 1;
    s.along[1] = s.length > 0 ? s.along[1] / s.length : 0;
    const double steep = s.along[1] < 0 ? -s.along[1] : s.along[1];
    const double flat = s.along[0] < 0 ? -s.along[0] : s.along[0];
    const double reach = s.across * flat + s.beyond * steep + 1;
    s.first = (s.from[1] < to[1] ? s.from[1] : to[1]) - reach;
    s.last = (s.from[1] < to[1] ? to[1] : s.from[1]) + reach;
    return s;
}

static bool contains(const struct search *s, const struct sparse_corner *corner) {
    const double dx = corner->x - s->from[0], dy = corner->y - s->from[1];
    const double across = dy * s->along[0] - dx * s->along[1];
    const double along = dx * s->along[0] + dy * s->along[1];
    return across <= s->across + 1 && across >= -s->across - 1 && along >= -s->beyond - 1 &&
           along <= s->length + s->beyond + 1;
}

// The first corner, by rows, whose row is not above y.
static int first_at(const struct sparse_picture *picture, const int *row_start, double y) {
    return row_start[(int)math_clamp(y, 0, picture->level.height)];
}

// Sorts by rows: counting sort into `sorted`; row_start[y] is the first corner at y or below.
static void sort_rows(const struct sparse_picture *picture, int *row_start, uint16_t *sorted) {
    INVARIANT(picture->count <= SPARSE_RIGHT_MAX);
    const int height = picture->level.height;
    memset(row_start, 0, ((size_t)height + 2) * sizeof *row_start);
    for (int i = 0; i < picture->count; i++) {
        row_start[picture->corner[i].y + 1]++;
    }
    for (int y = 0; y <= height; y++) {
        row_start[y + 1] += row_start[y];
    }
    for (int i = 0; i < picture->count; i++) {
        sorted[row_start[picture->corner[i].y]++] = (uint16_t)i;
    }
    for (int y = height; y > 0; y--) {
        row_start[y] = row_start[y - 1];
    }
    row_start[0] = 0;
}

// First on the levels, whose corners are whole pixels, then on the pictures.
static bool align_pair(const struct sparse_picture *left, const struct sparse_picture *right,
                       const struct sparse_corner *a, const struct sparse_corner *b,
                       struct sparse_pair *pair) {
    double px[2] = {b->x, b->y};
    if (!sparse_align(&left->level, a->x, a->y, &right->level, px)) {
        return false;
    }
    // A whole pixel, whose value needs no interpolation, and the same place on the right.
    const int middle = (left->factor - 1) / 2;
    pair->left_px[0] = a->x * left->factor + middle;
    pair->left_px[1] = a->y * left->factor + middle;
    const double rest = middle - 0.5 * (left->factor - 1);
    for (int i = 0; i < 2; i++) {
        pair->right_px[i] = (px[i] + 0.5) * right->factor - 0.5 + rest;
    }
    if (left->factor == 1 && right->factor == 1) {
        return true;
    }
    return sparse_align(&left->image, pair->left_px[0], pair->left_px[1], &right->image,
                        pair->right_px);
}

// The best partner, and the distance of the second best that is another thing.
struct best {
    int16_t partner, distance, second;
};

size_t sparse_match_need_bytes(int left_max, int right_max) {
    return arena_need_bytes((size_t)left_max, sizeof(struct best)) +
           arena_need_bytes((size_t)right_max, sizeof(struct best)) +
           arena_need_bytes((size_t)IMAGE_MAX_SIDE_PX + 2, sizeof(int)) +
           arena_need_bytes((size_t)right_max, sizeof(uint16_t));
}

static bool is_near(const struct sparse_corner *a, const struct sparse_corner *b) {
    enum { NEAR = 8 };
    const int dx = a->x - b->x, dy = a->y - b->y;
    return dx * dx + dy * dy < NEAR * NEAR;
}

static void note(const struct sparse_picture *picture, struct best *best, int partner,
                 int distance) {
    const bool same =
        best->partner >= 0 && is_near(&picture->corner[best->partner], &picture->corner[partner]);
    if (distance < best->distance) {
        best->second = same ? best->second : best->distance;
        best->distance = (int16_t)distance;
        best->partner = (int16_t)partner;
    } else if (distance < best->second && !same) {
        best->second = (int16_t)distance;
    }
}

static void clear(struct best *best, int count) {
    for (int i = 0; i < count; i++) {
        best[i] = (struct best){-1, 257, 257};
    }
}

// Alike, and the second best clearly less so.
static bool is_distinct(const struct best *best) {
    return best->distance <= DISTANCE_MAX && 10 * best->distance < 9 * best->second;
}

// Both pictures, and the right corners by rows.
struct index {
    const struct sparse_picture *left, *right;
    int *row_start;
    uint16_t *sorted;
};

// Compares left corner i with the right ones in its region.
static void compare(const struct index *index, const struct search *search, int i,
                    struct best *forth, struct best *back) {
    const struct sparse_picture *right = index->right;
    const int end = first_at(right, index->row_start, search->last + 1);
    for (int k = first_at(right, index->row_start, search->first); k < end; k++) {
        const int j = index->sorted[k];
        if (contains(search, &right->corner[j])) {
            const int distance = distance_of(&index->left->corner[i], &right->corner[j]);
            note(right, &forth[i], j, distance);
            note(index->left, &back[j], i, distance);
        }
    }
}

int sparse_match(const struct sparse_picture *left, const struct sparse_picture *right,
                 sparse_expect *expect, void (*serve)(void *self), void *self, struct arena *arena,
                 struct sparse_pair *pairs) {
    const size_t mark = arena_mark(arena);
    struct best *forth = arena_take(arena, (size_t)left->count, sizeof *forth);
    struct best *back = arena_take(arena, (size_t)right->count, sizeof *back);
    struct index index = {left, right, NULL, NULL};
    index.row_start = arena_take(arena, (size_t)right->level.height + 2, sizeof *index.row_start);
    index.sorted = arena_take(arena, (size_t)right->count, sizeof *index.sorted);
    if (forth == NULL || back == NULL || index.row_start == NULL || index.sorted == NULL) {
        arena_release(arena, mark);
        return ERROR_MEMORY;
    }
    clear(forth, left->count);
    clear(back, right->count);
    sort_rows(right, index.row_start, index.sorted);
    for (int i = 0; i < left->count; i++) {
        const struct sparse_corner *a = &left->corner[i];
        const double middle = 0.5 * (left->factor - 1);
        const double px[2] = {a->x * left->factor + middle, a->y * left->factor + middle};
        struct sparse_region region;
        serve(self);
        if (expect(self, px, &region)) {
            const struct search search = search_of(&region, right->factor);
            compare(&index, &search, i, forth, back);
        }
    }
    int count = 0;
    for (int i = 0; i < left->count; i++) {
        const int partner = forth[i].partner;
        serve(self);
        if (partner >= 0 && back[partner].partner == i && is_distinct(&forth[i]) &&
            align_pair(left, right, &left->corner[i], &right->corner[partner], &pairs[count])) {
            count++;
        }
    }
    arena_release(arena, mark);
    return count;
}
