// SPDX-License-Identifier: Apache-2.0
// Rows needed: of a row of the picture those of its extent in the raw image; of these, those that
// the debayer looks at (debayer.h).
#include "stereo/pictures.h"

#include <string.h>

#include "core/error.h"
#include "core/invariant.h"

enum {
    CHUNK_ROWS = 8,  // made together: shared by the threads
    MORE_ROWS = 16,  // raw rows developed ahead, so that they are seldom moved
};

static int smaller(int a, int b) {
    return a < b ? a : b;
}

// The raw rows of rows [begin, end), first to last; 0 -1: none.
static struct rectify_extent extent_of(const struct picture_side *side, int begin, int end) {
    struct rectify_extent all = {.first = 0, .last = -1};
    for (int y = begin; y < end; y++) {
        const struct rectify_extent one = side->extent[y];
        if (one.last < one.first) {
            continue;
        }
        all.first = all.last < all.first || one.first < all.first ? one.first : all.first;
        all.last = one.last > all.last ? one.last : all.last;
    }
    return all;
}

static int strip_rows_of(const struct rectify_plan *plan, const struct calibration *calibration,
                         enum rectify_side side, int raw_height) {
    return smaller(rectify_rows_needed(plan, calibration, side, CHUNK_ROWS) + MORE_ROWS,
                   raw_height);
}

size_t pictures_need_bytes(const struct rectify_plan *plan, const struct calibration *calibration,
                           int bits, int threads, int ring_rows, size_t *ahead_bytes) {
    const size_t width = (size_t)plan->width_px;
    size_t bytes = arena_need_bytes((size_t)threads * 2 * width, sizeof(int32_t));
    *ahead_bytes = 2 * arena_need_bytes(width * (size_t)ring_rows, 1);
    for (int i = 0; i < 2; i++) {
        const enum rectify_side side = i == 0 ? RECTIFY_LEFT : RECTIFY_RIGHT;
        const struct lens *lens = i == 0 ? &calibration->left : &calibration->right;
        const int rows = strip_rows_of(plan, calibration, side, lens->height_px);
        const size_t pixels = (size_t)lens->width_px * (size_t)rows;
        bytes += rectify_table_need_bytes(plan) +
                 arena_need_bytes((size_t)plan->height_px, sizeof(struct rectify_extent)) +
                 develop_need_bytes(lens->width_px, bits, threads) + arena_need_bytes(pixels, 1) +
                 arena_need_bytes(pixels, 3);
        *ahead_bytes += arena_need_bytes(pixels, 1);
    }
    return bytes;
}

struct extents {
    struct picture_side *side;
    int32_t *coordinates_q16;
    int parts;
};

static void part_rows(int index, int parts, int begin, int end, int *first, int *last) {
    *first = begin + (int)((int64_t)(end - begin) * index / parts);
    *last = begin + (int)((int64_t)(end - begin) * (index + 1) / parts);
}

static void find_extents(void *context, int index) {
    const struct extents *extents = context;
    struct picture_side *side = extents->side;
    int32_t *work_q16 = extents->coordinates_q16 + (size_t)index * 2 * (size_t)side->table.width_px;
    int first, last;
    part_rows(index, extents->parts, 0, side->table.height_px, &first, &last);
    for (int y = first; y < last; y++) {
        side->extent[y] = rectify_row_extent(&side->table, y, work_q16);
        side->span[y] = side->extent[y].span;
    }
}

static int begin_side(struct pictures *pictures, struct picture_side *side,
                      const struct develop_balance *balance, struct arena *arena) {
    const int threads = pictures->parallel->threads;
    const struct raw_image *raw = &side->raw;
    side->extent = arena_take(arena, (size_t)side->table.height_px, sizeof *side->extent);
    const int error = develop_begin(&side->develop, raw, balance, threads, arena);
    if (error != ERROR_OK || side->extent == NULL) {
        return error != ERROR_OK ? error : ERROR_MEMORY;
    }
    struct extents extents = {side, pictures->coordinates_q16, threads};
    pictures->parallel->run(pictures->parallel->self, find_extents, &extents, threads);
    const size_t pixels = (size_t)raw->width_px * (size_t)side->strip_rows;
    side->strip = (struct rectify_strip){
        .grey = {arena_take(arena, pixels, 1), raw->width_px, 0, raw->width_px},
        .colour = {NULL, raw->width_px, 0, (ptrdiff_t)3 * raw->width_px}};
    side->strip.colour.data = arena_take(arena, pixels, 3);
    return side->strip.grey.data != NULL && side->strip.colour.data != NULL ? ERROR_OK
                                                                            : ERROR_MEMORY;
}

static void forget_rows(struct pictures *pictures) {
    pictures->begin = pictures->end = 0;
    for (int i = 0; i < 2; i++) {
        pictures->side[i].strip.begin = pictures->side[i].strip.end = 0;
    }
}

struct beginning {
    struct pictures *pictures;
    const struct rectify_plan *plan;
    const struct calibration *calibration;
    struct arena *arena;
    struct develop_balance balance;
    int error;
};

static void make_table(void *context, int index) {
    struct beginning *beginning = context;
    struct picture_side *side = beginning->pictures->side;
    // One balance for both, as both see the same scene in the same light.
    if (index == 0) {
        beginning->balance = develop_balance_of(&side->raw);
    }
    beginning->error = rectify_table_make(beginning->plan, beginning->calibration,
                                          index == 0 ? RECTIFY_LEFT : RECTIFY_RIGHT,
                                          beginning->arena, &side[index].table);
}

int pictures_begin(struct pictures *pictures, const struct rectify_plan *plan,
                   const struct calibration *calibration, struct arena *arena) {
    pictures->sides = 2;
    pictures->in_colour = true;
    forget_rows(pictures);
    pictures->coordinates_q16 =
        arena_take_fast(arena, (size_t)pictures->parallel->threads * 2 * (size_t)plan->width_px,
                        sizeof *pictures->coordinates_q16);
    if (pictures->coordinates_q16 == NULL) {
        return ERROR_MEMORY;
    }
    struct beginning beginning = {pictures, plan, calibration, arena, {{0}}, ERROR_OK};
    for (int i = 0; i < 2 && beginning.error == ERROR_OK; i++) {
        struct picture_side *side = &pictures->side[i];
        parallel_call(make_table, &beginning, i);
        if (beginning.error == ERROR_OK) {
            side->strip_rows = strip_rows_of(
                plan, calibration, i == 0 ? RECTIFY_LEFT : RECTIFY_RIGHT, side->raw.height_px);
            beginning.error = begin_side(pictures, side, &beginning.balance, arena);
        }
    }
    return beginning.error;
}

int pictures_begin_ahead(const struct pictures *pictures, int ring_rows, struct arena *arena,
                         struct pictures *ahead) {
    *ahead = *pictures;
    ahead->develop_us = ahead->rectify_us = 0;
    bool taken = true;
    for (int i = 0; i < 2; i++) {
        struct picture_side *side = &ahead->side[i];
        const size_t width = (size_t)side->grey.width;
        side->grey.data = arena_take(arena, width * (size_t)ring_rows, 1);
        side->grey.ring_rows = ring_rows;
        side->strip.grey.data =
            arena_take(arena, (size_t)side->raw.width_px * (size_t)side->strip_rows, 1);
        taken = taken && side->grey.data != NULL && side->strip.grey.data != NULL;
    }
    ahead->sides = 2;
    ahead->in_colour = false;
    forget_rows(ahead);
    return taken ? ERROR_OK : ERROR_MEMORY;
}

// Develops rows [first, last] of the raw image where they are not there, as many as there is memory
// for, and more if there is. Rows that are still needed move to the front.
static void develop(struct pictures *pictures, struct picture_side *side, int first, int last) {
    struct rectify_strip *strip = &side->strip;
    if (first >= strip->begin && last < strip->end) {
        return;
    }
    int kept = 0;
    if (first >= strip->begin && first < strip->end) {
        kept = strip->end - first;
        const int moved = first - strip->begin;
        memmove(strip->grey.data, strip->grey.data + moved * strip->grey.stride,
                (size_t)(kept * strip->grey.stride));
        if (pictures->in_colour) {
            memmove(strip->colour.data, strip->colour.data + moved * strip->colour.stride,
                    (size_t)(kept * strip->colour.stride));
        }
    }
    strip->begin = first;
    strip->end = smaller(first + side->strip_rows, side->raw.height_px);
    struct image_u8 grey = strip->grey;
    struct image_rgb8 colour = strip->colour;
    grey.data += kept * grey.stride;
    colour.data = pictures->in_colour ? colour.data + kept * colour.stride : NULL;
    grey.height = colour.height = strip->end - first - kept;
    develop_rows(&side->develop, pictures->parallel, first + kept, &grey, &colour);
}

struct chunk {
    const struct pictures *pictures;
    struct picture_side *side;
    int begin, end;
    bool is_first;  // strip of these rows
};

static void rectify_part(void *context, int index) {
    const struct chunk *chunk = context;
    struct picture_side *side = chunk->side;
    const size_t width = (size_t)side->table.width_px;
    int32_t *work_q16 = chunk->pictures->coordinates_q16 + (size_t)index * 2 * width;
    int first, last;
    part_rows(index, chunk->pictures->parallel->threads, chunk->begin, chunk->end, &first, &last);
    for (int y = first; y < last; y++) {
        uint8_t *grey = image_u8_row(&side->grey, y);
        uint8_t *colour = chunk->pictures->in_colour && side->colour.data != NULL
                              ? image_rgb8_row(&side->colour, y)
                              : NULL;
        if (chunk->is_first) {
            memset(grey, 0, width);
        }
        if (chunk->is_first && colour != NULL) {
            memset(colour, 0, 3 * width);
        }
        rectify_row_strip(&side->table, &side->strip, &side->extent[y], y, grey, colour, work_q16);
    }
}

static uint64_t time_us(const struct pictures *pictures) {
    return pictures->now_us == NULL ? 0 : pictures->now_us(pictures->clock);
}

// Makes rows [begin, end) of a side. Raw rows that do not fit into the strip at once, as those of a
// picture turned by 90 degrees, pass in several, each of which begins with the last row of the one
// before.
static void make_chunk(struct pictures *pictures, struct picture_side *side, int begin, int end) {
    const struct rectify_extent extent = extent_of(side, begin, end);
    struct chunk chunk = {pictures, side, begin, end, true};
    int first = extent.first;
    do {
        const uint64_t begin_us = time_us(pictures);
        if (first <= extent.last) {
            develop(pictures, side, first, extent.last);
        }
        const uint64_t developed_us = time_us(pictures);
        pictures->parallel->run(pictures->parallel->self, rectify_part, &chunk,
                                pictures->parallel->threads);
        pictures->develop_us += developed_us - begin_us;
        pictures->rectify_us += time_us(pictures) - developed_us;
        chunk.is_first = false;
        first = side->strip.end - 1;
    } while (side->strip.end <= extent.last);
}

void pictures_want(struct pictures *pictures, int sides, bool in_colour) {
    if (pictures->sides == sides && pictures->in_colour == in_colour) {
        return;
    }
    pictures->sides = sides;
    pictures->in_colour = in_colour;
    forget_rows(pictures);
}

void pictures_rows(struct pictures *pictures, int begin, int end) {
    const int ring_rows =
        pictures->in_colour ? pictures->side[0].colour.ring_rows : pictures->side[0].grey.ring_rows;
    INVARIANT(begin >= 0 && begin <= end && end <= pictures->side[0].table.height_px);
    INVARIANT(ring_rows == 0 || end - begin <= ring_rows);
    if (begin < pictures->begin || begin > pictures->end) {
        pictures->begin = pictures->end = begin;
    }
    while (pictures->end < end) {
        const int next = smaller(pictures->end + CHUNK_ROWS, end);
        for (int i = 0; i < pictures->sides; i++) {
            make_chunk(pictures, &pictures->side[i], pictures->end, next);
        }
        pictures->end = next;
        if (ring_rows != 0 && pictures->begin < next - ring_rows) {
            pictures->begin = next - ring_rows;
        }
    }
}
