// SPDX-License-Identifier: Apache-2.0
// Phase 3 (included by match_plain.c and the other kernel sets): path costs along the row from both
// sides, and the winner of their sum with those from above. Rows are independent: several at once.
#ifndef VERGENCE_STEREO_MATCH_MATCH_ROW_PHASE_H
#define VERGENCE_STEREO_MATCH_MATCH_ROW_PHASE_H

#include <string.h>

#include "core/invariant.h"
#include "stereo/match/match_path_cost.h"
#include "stereo/match/match_state.h"
#include "stereo/match/match_validate_phase.h"

enum {
    // Upper bound of a path cost's contribution to a sum of two that must fit 8 bits.
    SUMMAND_MAX = 127,
    // Lanes next to a winner, which do not count as rivals, at the middle of near_lanes.
    NEAR_MIDDLE = MATCH_MAX_DISPARITIES,
    ROW_GROUPS = MATCH_ROWS_ABREAST / VECTOR_MEMBERS,
};

static const uint8_t near_lanes[2 * MATCH_MAX_DISPARITIES + MATCH_LANES] = {
    [NEAR_MIDDLE - 1] = UINT8_MAX, [NEAR_MIDDLE] = UINT8_MAX, [NEAR_MIDDLE + 1] = UINT8_MAX};

// outside_lanes + 16 - n: the first n of 16 lanes; outside_lanes + 32 - n: all but the first n.
static const uint8_t outside_lanes[3 * MATCH_LANES] = {
    0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF,        0xFF, 0xFF, 0xFF, 0xFF, 0xFF,
    0xFF, 0xFF, 0xFF, 0xFF, 0xFF, [32] = 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF,
    0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF,        0xFF, 0xFF, 0xFF, 0xFF};

struct row_view {
    const struct match_level *level;
    const struct match_tile *tiles;
    struct match_line *line;  // one a row
    const uint8_t *cost[MATCH_ROWS_ABREAST];
    const uint8_t *above[MATCH_ROWS_ABREAST];  // messages from above
    uint8_t *sum[MATCH_ROWS_ABREAST];  // of those and the path costs from the left; may be `above`
    uint8_t *path_cost[MATCH_ROWS_ABREAST];  // of the last pixel of a tile
    struct rectify_span left[MATCH_ROWS_ABREAST], right[MATCH_ROWS_ABREAST];
};

// The lanes of the window that may win at x: their right pixel is inside the right row's span.
static inline void searched(const struct row_view *view, int r, const struct match_tile *tile,
                            int x, int *begin, int *end) {
    const struct match_level *level = view->level;
    const int position = x - level->disparity_min - tile->base;
    const int first = position - view->right[r].end + 1;
    const int beyond = position - view->right[r].begin + 1;
    *begin = first > 0 ? first : 0;
    *end = beyond < tile->lanes ? beyond : tile->lanes;
}

// Path costs from the left through one tile, each added to the one from above.
MATCH_INLINE void pass_right(const struct row_view *of, const struct match_tile *tile, int x_begin,
                             int columns, const int groups, const bool sheared, const int lanes) {
    // A local copy, as stores of bytes might alias the original.
    const struct row_view view = *of;
    const uint8_t *penalty[MATCH_ROWS_ABREAST];
    for (int r = 0; r < groups * VECTOR_MEMBERS; r++) {
        penalty[r] = view.line[r].row.penalty;
    }
    const struct vector small = vector_all(MATCH_P1);
    const struct vector max = vector_all(SUMMAND_MAX);
    const int count = lanes / MATCH_LANES;
    struct lanes path_cost[ROW_GROUPS];
    for (int q = 0; q < groups; q++) {
        load_lanes((const uint8_t *const *)view.path_cost + q * VECTOR_MEMBERS, 0, &path_cost[q],
                   lanes);
    }
    ptrdiff_t cell = tile->offset;
    for (int x = x_begin; x < x_begin + columns; x++, cell += lanes) {
        const int rise = sheared ? match_rise(tile->slope_along, x) : 0;
        for (int q = 0; q < groups; q++) {
            const int r = q * VECTOR_MEMBERS;
            const struct path_penalties penalties = {small, vector_each(penalty + r, x)};
            struct lanes cost;
            load_lanes(view.cost + r, cell, &cost, lanes);
            shear(&path_cost[q], rise, vector_all(UINT8_MAX), vector_all(UINT8_MAX), lanes);
            add_path_cost(&cost, penalties, &path_cost[q], lanes);
            for (int k = 0; k < count; k++) {
                const ptrdiff_t at = cell + (ptrdiff_t)k * MATCH_LANES;
                const struct vector above = vector_load(view.above + r, at);
                vector_store(
                    view.sum + r, at,
                    vector_add(vector_min(above, max), vector_min(path_cost[q].part[k], max)));
            }
        }
    }
    for (int q = 0; q < groups; q++) {
        store_lanes(&path_cost[q], view.path_cost + q * VECTOR_MEMBERS, 0, lanes);
    }
}

// Excludes the lanes from i on that may not win.
static inline struct vector hide_outside(const struct row_view *view, int r_begin,
                                         const struct match_tile *tile, int x, int i,
                                         struct vector total) {
    const uint8_t *front[VECTOR_MEMBERS];
    const uint8_t *behind[VECTOR_MEMBERS];
    for (int r = 0; r < VECTOR_MEMBERS; r++) {
        int begin;
        int end;
        searched(view, r_begin + r, tile, x, &begin, &end);
        begin = begin < i ? 0 : (begin > i + MATCH_LANES ? MATCH_LANES : begin - i);
        end = end < i ? 0 : (end > i + MATCH_LANES ? MATCH_LANES : end - i);
        front[r] = outside_lanes + MATCH_LANES - begin;
        behind[r] = outside_lanes + 2 * MATCH_LANES - end;
    }
    return vector_or(total, vector_or(vector_load(front, 0), vector_load(behind, 0)));
}

// Adds up all path costs of pixel x of the rows from r_begin on, and records the winner of each.
MATCH_INLINE void choose(const struct row_view *view, int r_begin, const struct match_tile *tile,
                         int x, ptrdiff_t cell, const struct lanes *path_cost, const bool hide,
                         const int lanes) {
    const int count = lanes / MATCH_LANES;
    struct vector total[PATH_COST_VECTORS];
    struct vector lowest = vector_all(UINT8_MAX);
    for (int k = 0; k < count; k++) {
        total[k] = vector_add(vector_load((const uint8_t *const *)view->sum + r_begin,
                                          cell + (ptrdiff_t)k * MATCH_LANES),
                              path_cost->part[k]);
        if (hide) {
            total[k] = hide_outside(view, r_begin, tile, x, k * MATCH_LANES, total[k]);
        }
        lowest = vector_min(lowest, total[k]);
    }
    lowest = vector_lowest(lowest);
    int lane[VECTOR_MEMBERS];
    first_lowest(total, lowest, lane, count);
    const uint8_t *near[VECTOR_MEMBERS];
    for (int r = 0; r < VECTOR_MEMBERS; r++) {
        near[r] = near_lanes + NEAR_MIDDLE - lane[r];
    }
    struct vector rival = vector_all(UINT8_MAX);
    for (int k = 0; k < count; k++) {
        rival =
            vector_min(rival, vector_or(total[k], vector_load(near, (ptrdiff_t)k * MATCH_LANES)));
    }
    const struct vector margin = vector_sub(vector_lowest(rival), lowest);
    for (int r = 0; r < VECTOR_MEMBERS; r++) {
        view->line[r_begin + r].row.lane[x] = (int16_t)lane[r];
        view->line[r_begin + r].row.margin[x] = vector_first(margin, r);
    }
}

// Path costs from the right through one tile, each added to the others; chooses the winners.
MATCH_INLINE void pass_left(const struct row_view *of, const struct match_tile *tile, int x_begin,
                            int columns, const bool hide, const int groups, const bool sheared,
                            const int lanes) {
    const struct row_view view = *of;
    const uint8_t *penalty[MATCH_ROWS_ABREAST];
    for (int r = 0; r < groups * VECTOR_MEMBERS; r++) {
        penalty[r] = view.line[r].row.penalty + 1;
    }
    const struct vector small = vector_all(MATCH_P1);
    struct lanes path_cost[ROW_GROUPS];
    for (int q = 0; q < groups; q++) {
        load_lanes((const uint8_t *const *)view.path_cost + q * VECTOR_MEMBERS, 0, &path_cost[q],
                   lanes);
    }
    const int slope = tile->slope_along;  // no winner is stored there
    ptrdiff_t cell = tile->offset + (ptrdiff_t)columns * lanes;
    for (int x = x_begin + columns - 1; x >= x_begin; x--) {
        const int rise = sheared ? -match_rise(slope, x + 1) : 0;
        cell -= lanes;
        for (int q = 0; q < groups; q++) {
            const int r = q * VECTOR_MEMBERS;
            const struct path_penalties penalties = {small, vector_each(penalty + r, x)};
            struct lanes cost;
            load_lanes(view.cost + r, cell, &cost, lanes);
            shear(&path_cost[q], rise, vector_all(UINT8_MAX), vector_all(UINT8_MAX), lanes);
            add_path_cost(&cost, penalties, &path_cost[q], lanes);
            choose(&view, r, tile, x, cell, &path_cost[q], hide, lanes);
        }
    }
    for (int q = 0; q < groups; q++) {
        store_lanes(&path_cost[q], view.path_cost + q * VECTOR_MEMBERS, 0, lanes);
    }
}

// Moves the path costs to another window; from beyond a row (`from` is NULL) the first cost.
static void enter_tile_with_path_costs(const struct row_view *view, const int rows,
                                       const struct match_tile *from,
                                       const struct match_tile *tile) {
    for (int r = 0; r < rows; r++) {
        if (from == NULL) {
            memset(view->path_cost[r], 0, (size_t)tile->lanes);
        } else if (!match_same_window(from, tile)) {
            uint8_t realigned[MATCH_MAX_DISPARITIES];
            match_realign(view->path_cost[r], from, NULL, tile, realigned);
            memcpy(view->path_cost[r], realigned, (size_t)tile->lanes);
        }
    }
}

// Whether some lane of some pixel of the tile may not win.
static bool hides(const struct row_view *view, const int rows, const struct match_tile *tile,
                  int x_begin, int columns) {
    for (int r = 0; r < rows; r++) {
        int begin;
        int end;
        searched(view, r, tile, x_begin + columns - 1, &begin, &end);
        const int last_begin = begin;
        searched(view, r, tile, x_begin, &begin, &end);
        if (last_begin > 0 || end < tile->lanes || x_begin < view->left[r].begin ||
            x_begin + columns > view->left[r].end) {
            return true;
        }
    }
    return false;
}

// Narrows [*begin, *end) to the lanes that may win at x. Returns whether there are any.
static bool may_win(const struct row_view *view, int r, const struct match_tile *tile, int x,
                    int *begin, int *end) {
    // Lanes from here on are padding. They may win, which shows that nothing searched fits; but a
    // pixel whose right pixels are all in these lanes is at a border, where no match is possible:
    // its right pixel is just outside the row.
    const int wanted = view->level->disparity_count - tile->base;
    searched(view, r, tile, x, begin, end);
    return x >= view->left[r].begin && x < view->left[r].end && *begin < *end && *begin < wanted;
}

// Records the winners of a tile.
static void record_tile(const struct row_view *view, const int rows, const struct match_tile *tile,
                        int x_begin, int columns, bool hidden) {
    const int origin = view->level->disparity_min + tile->base;
    for (int r = 0; r < rows; r++) {
        const struct match_line *line = &view->line[r];
        const uint8_t *cost = view->cost[r] + tile->offset;
        if (!hidden) {
            record_winners(line, origin, tile, x_begin, columns, cost, 0, tile->lanes);
        }
        for (int x = x_begin; hidden && x < x_begin + columns; x++, cost += tile->lanes) {
            int begin;
            int end;
            int16_t *lane = &line->row.lane[x];
            if (may_win(view, r, tile, x, &begin, &end)) {
                // If every lane that may win costs as much as an excluded one, the first wins.
                *lane = (int16_t)(*lane < begin ? begin : *lane);
                record_winners(line, origin, tile, x, 1, cost, begin, end);
            } else {
                *lane = -1;
            }
        }
        for (int x = x_begin; tile->doubtful && x < x_begin + columns; x++) {
            uint8_t *margin = &line->row.margin[x];
            *margin = *margin < MATCH_LEAST_MARGIN ? *margin : MATCH_LEAST_MARGIN - 1;
        }
    }
}

MATCH_INLINE void pass_both_ways(const struct row_view *view, const int groups) {
    const struct match_level *level = view->level;
    const int rows = groups * VECTOR_MEMBERS;
    for (int t = 0; t < level->tiles; t++) {
        const struct match_tile *tile = &view->tiles[t];
        const int columns = match_tile_columns(level, t);
        enter_tile_with_path_costs(view, rows, t == 0 ? NULL : tile - 1, tile);
#define PASS_RIGHT(lanes, sheared) \
    pass_right(view, tile, t *MATCH_TILE_COLUMNS, columns, groups, sheared, lanes)
        MATCH_WITH_CONSTANT_LANES(tile->lanes, tile->slope_along, PASS_RIGHT);
#undef PASS_RIGHT
    }
    for (int t = level->tiles - 1; t >= 0; t--) {
        const struct match_tile *tile = &view->tiles[t];
        const int columns = match_tile_columns(level, t);
        const int x = t * MATCH_TILE_COLUMNS;
        const bool hidden = hides(view, rows, tile, x, columns);
        enter_tile_with_path_costs(view, rows, t == level->tiles - 1 ? NULL : tile + 1, tile);
#define PASS_LEFT(lanes, sheared) pass_left(view, tile, x, columns, hidden, groups, sheared, lanes)
        MATCH_WITH_CONSTANT_LANES(tile->lanes, tile->slope_along, PASS_LEFT);
#undef PASS_LEFT
        record_tile(view, rows, tile, x, columns, hidden);
    }
}

static void prepare_line(const struct match_level *level, struct match_line *line, int y) {
    const uint8_t *restrict step = level->step_along[y % level->ring_rows];
    uint8_t *restrict penalty = line->row.penalty;
    const int width = level->width;
    const uint8_t least = match_least_p2(level);
    penalty[0] = penalty[width] = 0;
    for (int x = 1; x < width; x++) {
        penalty[x] = match_p2(step[x], least);
    }
    memset(line->row.claim, UINT8_MAX, (size_t)(width + 1) * sizeof *line->row.claim);
}

// Rows [y_begin, y_begin + row_count) of the band.
static void rows(struct match_level *level, struct match_scratch *scratch, int y_begin,
                 int row_count) {
    INVARIANT(row_count == MATCH_ROWS_ABREAST || row_count == MATCH_PAIR_ROWS);
    const struct match_band *band = scratch->band;
    struct row_view view = {.level = level, .tiles = band->tile, .line = scratch->line};
    for (int r = 0; r < row_count; r++) {
        const int y = y_begin + r;
        const int row = y - band->begin;
        INVARIANT(row < MATCH_BAND_ROWS);
        prepare_line(level, &scratch->line[r], y);
        view.cost[r] = level->ring[y % level->ring_rows];
        view.above[r] = band->from_above[row];
        // The last row's path costs are still needed by the next band.
        view.sum[r] = y == band->end - 1 ? band->last_sum : band->from_above[row];
        view.path_cost[r] = scratch->running + (size_t)r * (size_t)level->lanes;
        const int known = y < level->height ? y : level->height - 1;
        const struct match_input *input = level->state->input;
        view.left[r] = match_span(level, &input->left, input->left_span, known);
        view.right[r] = match_span(level, &input->right, input->right_span, known);
    }
    if (row_count == MATCH_ROWS_ABREAST) {
        pass_both_ways(&view, MATCH_ROWS_ABREAST / VECTOR_MEMBERS);
    } else {
        pass_both_ways(&view, MATCH_PAIR_ROWS / VECTOR_MEMBERS);
    }
    for (int r = 0; r < row_count && y_begin + r < level->height; r++) {
        validate_row(level, &scratch->line[r], y_begin + r, view.left[r]);
    }
}

#endif
