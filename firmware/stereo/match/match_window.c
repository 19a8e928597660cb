// SPDX-License-Identifier: Apache-2.0
#include "core/invariant.h"
#include "stereo/match/match_level.h"

// Lowest and highest index that the coarser level found near a tile; low > high: none was found.
// `default_value`: roughly where most of them are.
struct reach {
    int low, high, default_value;
    bool doubtful;  // most have a rival
};

static const struct reach NOWHERE = {UINT16_MAX, -1, 0, false};

// Number of halvings between this level and the coarser one.
static int halvings_x(const struct match_level *level) {
    return level->coarser->shift_x - level->shift_x;
}

static int halvings_y(const struct match_level *level) {
    return level->coarser->shift_y - level->shift_y;
}

int match_window_rows(const struct match_level *level, int band_begin) {
    const int rows =
        ((band_begin + MATCH_BAND_ROWS) >> halvings_y(level)) + level->state->method->around_rows;
    return rows < level->coarser->height ? rows : level->coarser->height;
}

// Findings of the coarser level near the band, by its columns.
struct columns_found {
    uint16_t *lowest;
    int16_t *highest;
    int16_t *doubts;  // number of places with a rival minus number without
};

// -1 (not found) is the highest unsigned number, so that it never lowers a minimum.
static void search_columns(const struct match_level *level, int band_begin,
                           const struct columns_found *found) {
    const struct match_level *coarser = level->coarser;
    const int width = coarser->width;
    uint16_t *restrict lowest = found->lowest;
    int16_t *restrict highest = found->highest;
    int16_t *restrict doubts = found->doubts;
    for (int x = 0; x < width; x++) {
        lowest[x] = UINT16_MAX;
        highest[x] = -1;
        doubts[x] = 0;
    }
    int begin = (band_begin >> halvings_y(level)) - level->state->method->around_rows;
    begin = begin > 0 ? begin : 0;
    const int end = match_window_rows(level, band_begin);
    INVARIANT(coarser->rows_done >= end && coarser->rows_done - begin <= coarser->surface_rows);
    for (int y = begin; y < end; y++) {
        const int16_t *restrict surface = coarser->surface[y % coarser->surface_rows];
        for (int x = 0; x < width; x++) {
            const int16_t doubtful = surface[x] >= MATCH_DOUBTFUL ? MATCH_DOUBTFUL : 0;
            const int16_t index = (int16_t)(surface[x] - doubtful);
            lowest[x] = (uint16_t)index < lowest[x] ? (uint16_t)index : lowest[x];
            highest[x] = index > highest[x] ? index : highest[x];
            const int16_t sure = index >= 0 ? -1 : 0;
            doubts[x] = (int16_t)(doubts[x] + (doubtful != 0 ? 1 : sure));
        }
    }
}

static struct reach reach_of_tile(const struct match_level *level, int t,
                                  const struct columns_found *found) {
    const uint16_t *lowest = found->lowest;
    const int16_t *highest = found->highest;
    const int width = level->coarser->width;
    const int around = level->state->method->around_columns;
    int begin = (t * MATCH_TILE_COLUMNS >> halvings_x(level)) - around;
    int end = ((t + 1) * MATCH_TILE_COLUMNS >> halvings_x(level)) + around;
    begin = begin > 0 ? begin : 0;
    end = end < width ? end : width;
    struct reach reach = NOWHERE;
    int sum = 0;
    int count = 0;
    int doubts = 0;
    for (int x = begin; x < end; x++) {
        reach.low = lowest[x] < reach.low ? lowest[x] : reach.low;
        reach.high = highest[x] > reach.high ? highest[x] : reach.high;
        doubts += found->doubts[x];
        if (highest[x] >= 0) {
            sum += lowest[x] + highest[x];
            count += 2;
        }
    }
    reach.default_value = count > 0 ? sum / count : 0;
    reach.doubtful = doubts > 0;
    return reach;
}

static int clamp(int value, int low, int high) {
    return value < low ? low : (value > high ? high : value);
}

// Whether a level searches the requested range everywhere, independent of the coarser one.
static bool searches_whole_range(const struct match_level *level) {
    return level->state->method->whole_range && level == &level->state->level[0];
}

// The window around a reach. Where rounding leaves room, it keeps the position of the tile above,
// so that cells need not be moved between windows.
static void set_window(const struct match_level *level, struct reach reach, int max_lanes,
                       int base_above, struct match_tile *tile) {
    const int count = level->disparity_count;
    const int margin = level->state->method->margin;
    const bool whole_range = searches_whole_range(level);
    int low = clamp(reach.low - margin, 0, count - 1);
    int high = clamp(reach.high + margin, low, count - 1);
    if (whole_range) {
        low = low < level->believed.first ? low : level->believed.first;
        high = high > level->believed.last ? high : level->believed.last;
    }
    int lanes = (high - low + MATCH_LANES) / MATCH_LANES * MATCH_LANES;
    int lowest_base = high + 1 - lanes;
    int highest_base = low;
    if (lanes > max_lanes) {
        // Not enough room: keep the end with the majority.
        lanes = max_lanes;
        lowest_base = highest_base =
            reach.default_value - low < high - reach.default_value ? low : high + 1 - lanes;
    }
    lowest_base = clamp(lowest_base, 0, level->lanes - lanes);
    highest_base = clamp(highest_base, lowest_base, level->lanes - lanes);
    tile->base = (int16_t)clamp(base_above, lowest_base, highest_base);
    tile->lanes = (int16_t)lanes;
    tile->doubtful = reach.doubtful && !whole_range;
    INVARIANT(lanes > 0 && tile->base >= 0 && tile->base + lanes <= level->lanes);
}

// Tiles without findings of the coarser level lie between their neighbours' surfaces.
static void close_gaps(const struct match_level *level, struct reach *reaches) {
    const struct reach all = {0, level->disparity_count - 1, level->disparity_count / 2, false};
    struct reach before = NOWHERE;
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

void match_plan_windows(const struct match_level *level, int band_begin,
                        const struct match_scratch *scratch, const struct match_tile *above,
                        struct match_tile *tiles) {
    struct reach reaches[IMAGE_MAX_SIDE_PX / MATCH_TILE_COLUMNS];
    INVARIANT(level->tiles <= IMAGE_MAX_SIDE_PX / MATCH_TILE_COLUMNS);
    if (level->coarser == NULL) {
        for (int t = 0; t < level->tiles; t++) {
            reaches[t] = (struct reach){0, level->disparity_count - 1, 0, false};
        }
    } else {
        // Nothing is in progress: the working memory of one thread is free.
        const struct columns_found found = {scratch->box, (int16_t *)scratch->line[0].cost.backward,
                                            (int16_t *)scratch->line[1].cost.forward};
        search_columns(level, band_begin, &found);
        for (int t = 0; t < level->tiles; t++) {
            reaches[t] = reach_of_tile(level, t, &found);
        }
        close_gaps(level, reaches);
    }
    // Narrows the windows until the row fits its memory.
    const size_t room = level->row_bytes / MATCH_TILE_COLUMNS;
    int max_lanes = level->lanes;
    int lanes;
    do {
        lanes = 0;
        for (int t = 0; t < level->tiles; t++) {
            set_window(level, reaches[t], max_lanes, above[t].base, &tiles[t]);
            tiles[t].offset = lanes * MATCH_TILE_COLUMNS;
            lanes += tiles[t].lanes;
        }
        max_lanes -= MATCH_LANES;
    } while ((size_t)lanes > room);
}
