// SPDX-License-Identifier: Apache-2.0
#include "core/match_window.h"

#include "core/invariant.h"

enum {
    // How far around a tile the coarser surface counts, in its pixels.
    AROUND_COLUMNS = 4,
    AROUND_ROWS = 2,
    MARGIN = 3,  // disparities below and above what was found there
};

// Lowest and highest index that the coarser level found near a tile; low > high: none.
struct reach {
    int low, high;
};

extern int exp_margin,exp_ac,exp_ar;
#define H (level->coarser->shift-level->shift)
int match_window_rows(const struct match_level *level, int band_begin) {
    const int rows = ((band_begin + MATCH_BAND_ROWS) >> H) + exp_ar;
    return rows < level->coarser->height ? rows : level->coarser->height;
}

// Lowest and highest index of each column of the coarser level. -1 (none) is the highest as an
// unsigned number, so that it never lowers anything.
static void reach_of_columns(const struct match_level *level, int band_begin, uint16_t *lowest,
                             int16_t *highest) {
    const struct match_level *coarser = level->coarser;
    const int width = coarser->width;
    for (int x = 0; x < width; x++) {
        lowest[x] = UINT16_MAX;
        highest[x] = -1;
    }
    int begin = (band_begin >>H) - exp_ar;
    begin = begin > 0 ? begin : 0;
    const int end = match_window_rows(level, band_begin);
    INVARIANT(coarser->rows_done >= end && coarser->rows_done - begin <= MATCH_SURFACE_ROWS);
    for (int y = begin; y < end; y++) {
        const int16_t *restrict surface = coarser->surface[y % MATCH_SURFACE_ROWS];
        for (int x = 0; x < width; x++) {
            const uint16_t index = (uint16_t)surface[x];
            lowest[x] = index < lowest[x] ? index : lowest[x];
            highest[x] = surface[x] > highest[x] ? surface[x] : highest[x];
        }
    }
}

static struct reach reach_of_tile(const struct match_level *level, int t, const uint16_t *lowest,
                                  const int16_t *highest) {
    const int width = level->coarser->width;
    int begin = (t * MATCH_TILE_COLUMNS >> H) - exp_ac;
    int end = ((t + 1) * MATCH_TILE_COLUMNS >>H) + exp_ac;
    begin = begin > 0 ? begin : 0;
    end = end < width ? end : width;
    struct reach reach = {UINT16_MAX, -1};
    for (int x = begin; x < end; x++) {
        reach.low = lowest[x] < reach.low ? lowest[x] : reach.low;
        reach.high = highest[x] > reach.high ? highest[x] : reach.high;
    }
    return reach;
}

// The window around a reach, with the room that rounding leaves shared out to both sides.
static void set_window(const struct match_level *level, struct reach reach, int most_lanes,
                       struct match_tile *tile) {
    const int count = level->disparity_count;
    int low = reach.low - exp_margin;
    int high = reach.high + exp_margin;
    low = low < 0 ? 0 : (low < count ? low : count - 1);
    high = high < low ? low : (high < count ? high : count - 1);
    int lanes = (high - low + MATCH_LANES) / MATCH_LANES * MATCH_LANES;
    lanes = lanes < most_lanes ? lanes : most_lanes;
    int base = low - (lanes - (high - low + 1)) / 2;
    base = base + lanes <= level->lanes ? base : level->lanes - lanes;
    base = base > 0 ? base : 0;
    INVARIANT(lanes > 0 && base + lanes <= level->lanes);
    tile->base = (int16_t)base;
    tile->lanes = (int16_t)lanes;
}

// Tiles where the coarser level found nothing lie between their neighbours' surfaces.
static void close_gaps(const struct match_level *level, struct reach *reaches) {
    const struct reach all = {0, level->disparity_count - 1};
    struct reach before = {UINT16_MAX, -1};
    for (int t = 0; t < level->tiles; t++) {
        if (reaches[t].low <= reaches[t].high) {
            before = reaches[t];
            continue;
        }
        int after = t;
        while (after < level->tiles && reaches[after].low > reaches[after].high) {
            after++;
        }
        struct reach joined = before;
        if (after < level->tiles) {
            const struct reach *other = &reaches[after];
            joined.low = other->low < joined.low ? other->low : joined.low;
            joined.high = other->high > joined.high ? other->high : joined.high;
        }
        joined = joined.low <= joined.high ? joined : all;
        for (; t < after; t++) {
            reaches[t] = joined;
        }
        t--;
    }
}

void match_plan_windows(const struct match_level *level, int band_begin, uint16_t *columns,
                        struct match_tile *tiles) {
    struct reach reaches[IMAGE_MAX_SIDE_PX / MATCH_TILE_COLUMNS];
    INVARIANT(level->tiles <= IMAGE_MAX_SIDE_PX / MATCH_TILE_COLUMNS);
    if (level->coarser == NULL) {
        for (int t = 0; t < level->tiles; t++) {
            reaches[t] = (struct reach){0, level->disparity_count - 1};
        }
    } else {
        int16_t *highest = (int16_t *)(columns + level->coarser->width);
        reach_of_columns(level, band_begin, columns, highest);
        for (int t = 0; t < level->tiles; t++) {
            reaches[t] = reach_of_tile(level, t, columns, highest);
        }
        close_gaps(level, reaches);
    }
    // Narrower windows until the row fits its memory.
    const size_t room = level->row_bytes / MATCH_TILE_COLUMNS;
    int most_lanes = level->lanes;
    size_t lanes;
    do {
        lanes = 0;
        for (int t = 0; t < level->tiles; t++) {
            set_window(level, reaches[t], most_lanes, &tiles[t]);
            tiles[t].offset = (int32_t)lanes * MATCH_TILE_COLUMNS;
            lanes += (size_t)tiles[t].lanes;
        }
        most_lanes -= MATCH_LANES;
    } while (lanes > room);
}
