// SPDX-License-Identifier: Apache-2.0
// Phase 1 (included by match_plain.c and the other kernel sets): cost of every disparity and its
// edge-aware average along the row, up to MATCH_ROWS_ABREAST rows side by side.
#ifndef VERGENCE_STEREO_MATCH_MATCH_COST_PHASE_H
#define VERGENCE_STEREO_MATCH_MATCH_COST_PHASE_H

#include <string.h>

#include "core/invariant.h"
#include "stereo/match/match_feature_phase.h"
#include "stereo/match/match_path_cost.h"
#include "stereo/match/match_state.h"

enum { COST_GROUPS = MATCH_ROWS_ABREAST / VECTOR_MEMBERS };

struct cost_view {
    const struct match_level *level;
    const struct match_tile *tiles;
    const struct match_line *line;          // one a row
    uint8_t *raw[MATCH_ROWS_ABREAST];       // costs
    uint8_t *averaged[MATCH_ROWS_ABREAST];  // rows of the ring
    // Averages from the neighbour, in the window of the present tile.
    uint8_t *running[MATCH_ROWS_ABREAST];
};

// Costs of the columns [0, columns) of a tile that begins at x_begin, for the rows from r_begin on.
MATCH_INLINE void tile_costs(const struct cost_view *view, int r_begin,
                             const struct match_tile *tile, int x_begin, int columns,
                             const int lanes) {
    const struct match_level *level = view->level;
    const int first = level->width - 1 + level->right_pad + level->disparity_min + tile->base;
    INVARIANT(first - (x_begin + columns - 1) >= 0);
    INVARIANT(first - x_begin + lanes <= level->right_length);
    const uint8_t *left_at[MATCH_CENSUS_PLANES + 1][VECTOR_MEMBERS];
    const uint8_t *right_at[MATCH_CENSUS_PLANES + 1][VECTOR_MEMBERS];
    uint8_t *to[VECTOR_MEMBERS];
    for (int r = 0; r < VECTOR_MEMBERS; r++) {
        const struct match_line *line = &view->line[r_begin + r];
        for (int plane = 0; plane < MATCH_CENSUS_PLANES; plane++) {
            left_at[plane][r] = line->cost.left.census[plane];
            right_at[plane][r] = line->cost.right.census[plane];
        }
        left_at[MATCH_CENSUS_PLANES][r] = line->cost.left.gradient;
        right_at[MATCH_CENSUS_PLANES][r] = line->cost.right.gradient;
        to[r] = view->raw[r_begin + r] + tile->offset;
    }
    for (int column = 0; column < columns; column++) {
        const int x = x_begin + column;
        struct vector left[MATCH_CENSUS_PLANES + 1];
        for (int plane = 0; plane <= MATCH_CENSUS_PLANES; plane++) {
            left[plane] = vector_each(left_at[plane], x);
        }
        for (int i = 0; i < lanes; i += MATCH_LANES) {
            struct vector right[MATCH_CENSUS_PLANES + 1];
            for (int plane = 0; plane <= MATCH_CENSUS_PLANES; plane++) {
                right[plane] = vector_load(right_at[plane], first - x + i);
            }
            vector_store(to, column * lanes + i, vector_cost(left, right));
        }
    }
}

// Averages of the costs up to each column from column `first` of the tile on, weighted by the edges
// between. They lean, as a surface may be slanted along the row.
MATCH_INLINE void average_forward(const struct cost_view *of, const struct match_tile *tile,
                                  int x_begin, int first, int columns, const int groups,
                                  const bool sheared, const int lanes) {
    // A local copy, as stores of bytes might alias the original.
    const struct cost_view view = *of;
    const match_share *shares_at[MATCH_ROWS_ABREAST];
    for (int r = 0; r < groups * VECTOR_MEMBERS; r++) {
        shares_at[r] = view.line[r].cost.forward;
    }
    struct lanes average[COST_GROUPS];
    for (int q = 0; q < groups; q++) {
        load_lanes((const uint8_t *const *)view.running + q * VECTOR_MEMBERS, 0, &average[q],
                   lanes);
    }
    const struct vector price = vector_all(MATCH_LEAN_ALONG);
    ptrdiff_t cell = tile->offset + (ptrdiff_t)first * lanes;
    for (int x = x_begin + first; x < x_begin + columns; x++, cell += lanes) {
        const int rise = sheared ? match_rise(tile->slope_along, x) : 0;
        for (int q = 0; q < groups; q++) {
            const int r = q * VECTOR_MEMBERS;
            const struct vector_shares shares = vector_shares_each(shares_at + r, x);
            shear_average(&average[q], rise, (const uint8_t *const *)view.raw + r, cell, lanes);
            struct vector before = vector_all(UINT8_MAX);
            for (int k = 0; k < lanes / MATCH_LANES; k++) {
                const ptrdiff_t at = cell + (ptrdiff_t)k * MATCH_LANES;
                const struct vector cost = vector_load((const uint8_t *const *)view.raw + r, at);
                const struct vector here = average[q].part[k];
                average[q].part[k] =
                    vector_blend(leaning(&average[q], k, before, price, lanes), cost, shares);
                vector_store(view.averaged + r, at, average[q].part[k]);
                before = here;
            }
        }
    }
    for (int q = 0; q < groups; q++) {
        store_lanes(&average[q], view.running + q * VECTOR_MEMBERS, 0, lanes);
    }
}

// Adds the averages of the costs to the right of each column to those from the left.
MATCH_INLINE void average_backward(const struct cost_view *of, const struct match_tile *tile,
                                   int x_begin, int columns, const int groups, const bool sheared,
                                   const int lanes) {
    const struct cost_view view = *of;
    const match_share *joined_at[MATCH_ROWS_ABREAST];
    const match_share *backward_at[MATCH_ROWS_ABREAST];
    for (int r = 0; r < groups * VECTOR_MEMBERS; r++) {
        joined_at[r] = view.line[r].cost.joined;
        backward_at[r] = view.line[r].cost.backward;
    }
    struct lanes average[COST_GROUPS];
    for (int q = 0; q < groups; q++) {
        load_lanes((const uint8_t *const *)view.running + q * VECTOR_MEMBERS, 0, &average[q],
                   lanes);
    }
    const struct vector price = vector_all(MATCH_LEAN_ALONG);
    ptrdiff_t cell = tile->offset + (ptrdiff_t)columns * lanes;
    for (int x = x_begin + columns - 1; x >= x_begin; x--) {
        const int rise = sheared ? -match_rise(tile->slope_along, x + 1) : 0;
        cell -= lanes;
        for (int q = 0; q < groups; q++) {
            const int r = q * VECTOR_MEMBERS;
            const struct vector_shares joined = vector_shares_each(joined_at + r, x);
            const struct vector_shares backward = vector_shares_each(backward_at + r, x);
            shear_average(&average[q], rise, (const uint8_t *const *)view.raw + r, cell, lanes);
            struct vector before = vector_all(UINT8_MAX);
            for (int k = 0; k < lanes / MATCH_LANES; k++) {
                const ptrdiff_t at = cell + (ptrdiff_t)k * MATCH_LANES;
                const struct vector from_left =
                    vector_load((const uint8_t *const *)view.averaged + r, at);
                const struct vector cost = vector_load((const uint8_t *const *)view.raw + r, at);
                const struct vector here = average[q].part[k];
                const struct vector from_right = leaning(&average[q], k, before, price, lanes);
                vector_store(view.averaged + r, at, vector_blend(from_left, from_right, joined));
                average[q].part[k] = vector_blend(from_right, cost, backward);
                before = here;
            }
        }
    }
    for (int q = 0; q < groups; q++) {
        store_lanes(&average[q], view.running + q * VECTOR_MEMBERS, 0, lanes);
    }
}

// Moves the averages from the neighbour from the window of the tile `from` to that of `tile`. Where
// that has no value, the pixel's own cost is used. The first pixel (`from` is NULL) is its own
// average.
static void enter_tile_with_averages(const struct cost_view *view, const int rows,
                                     const struct match_tile *from, const struct match_tile *tile,
                                     int column) {
    for (int r = 0; r < rows; r++) {
        const uint8_t *own = match_cell(view->raw[r], tile, column);
        if (from == NULL) {
            memcpy(view->running[r], own, (size_t)tile->lanes);
        } else if (!match_same_window(from, tile)) {
            uint8_t realigned[MATCH_MAX_DISPARITIES];
            match_realign(view->running[r], from, own, tile, realigned);
            memcpy(view->running[r], realigned, (size_t)tile->lanes);
        }
    }
}

MATCH_INLINE void average_rows(const struct cost_view *view, const int groups) {
    const struct match_level *level = view->level;
    const int rows = groups * VECTOR_MEMBERS;
    for (int t = 0; t < level->tiles; t++) {
        const struct match_tile *tile = &view->tiles[t];
        const int columns = match_tile_columns(level, t);
        const int x = t * MATCH_TILE_COLUMNS;
        for (int r = 0; r < rows; r += VECTOR_MEMBERS) {
#define TILE_COSTS(lanes, sheared) tile_costs(view, r, tile, x, columns, lanes)
            MATCH_WITH_CONSTANT_LANES(tile->lanes, 0, TILE_COSTS);
#undef TILE_COSTS
        }
        enter_tile_with_averages(view, rows, t == 0 ? NULL : tile - 1, tile, 0);
        for (int r = 0; r < rows && t == 0; r++) {
            memcpy(view->averaged[r] + tile->offset, view->running[r], (size_t)tile->lanes);
        }
#define AVERAGE_FORWARD(lanes, sheared) \
    average_forward(view, tile, x, t == 0 ? 1 : 0, columns, groups, sheared, lanes)
        MATCH_WITH_CONSTANT_LANES(tile->lanes, tile->slope_along, AVERAGE_FORWARD);
#undef AVERAGE_FORWARD
    }
    for (int t = level->tiles - 1; t >= 0; t--) {
        const struct match_tile *tile = &view->tiles[t];
        const bool first = t == level->tiles - 1;
        const int columns = match_tile_columns(level, t);
        enter_tile_with_averages(view, rows, first ? NULL : tile + 1, tile, columns - 1);
#define AVERAGE_BACKWARD(lanes, sheared)                                                       \
    average_backward(view, tile, t *MATCH_TILE_COLUMNS, first ? columns - 1 : columns, groups, \
                     sheared, lanes)
        MATCH_WITH_CONSTANT_LANES(tile->lanes, tile->slope_along, AVERAGE_BACKWARD);
#undef AVERAGE_BACKWARD
    }
}

// Rows [y_begin, y_begin + rows), all in the band or all in the next one.
static void cost_rows(struct match_level *level, struct match_scratch *scratch, int y_begin,
                      int rows) {
    INVARIANT(rows == MATCH_ROWS_ABREAST || rows == MATCH_PAIR_ROWS);
    struct cost_view view = {.level = level, .line = scratch->line};
    const struct match_band *band = scratch->band;
    view.tiles = y_begin < band->begin + MATCH_BAND_ROWS ? band->tile : band->next;
    for (int r = 0; r < rows; r++) {
        view.averaged[r] = level->ring[(y_begin + r) % level->ring_rows];
        // Path costs from above do not exist before phase 2.
        view.raw[r] = band->from_above[r];
        view.running[r] = scratch->running + (size_t)r * (size_t)level->lanes;
    }
    right_features(level, scratch, y_begin, rows);
    left_features(level, scratch, view.tiles, y_begin, rows);
    if (rows == MATCH_ROWS_ABREAST) {
        row_shares(level, scratch, y_begin, MATCH_ROWS_ABREAST);
        average_rows(&view, MATCH_ROWS_ABREAST / VECTOR_MEMBERS);
    } else {
        row_shares(level, scratch, y_begin, MATCH_PAIR_ROWS);
        average_rows(&view, MATCH_PAIR_ROWS / VECTOR_MEMBERS);
    }
}

#endif
