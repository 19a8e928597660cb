// SPDX-License-Identifier: Apache-2.0
// Text that each set of kernels compiles. Selection: the path costs from the right, added to the
// others; the winner of the sums, its margin over its best rival and what its sub-pixel position is
// computed from.
// Rows needed: the row's own.
#ifndef VERGENCE_STEREO_MATCH_SELECTION_H
#define VERGENCE_STEREO_MATCH_SELECTION_H

#include "core/invariant.h"
#include "stereo/match/path_cost.h"
#include "stereo/match/state.h"

enum {
    // Lanes next to a winner, which do not count as rivals, at the middle of near_lanes.
    NEAR_MIDDLE = MATCH_MAX_DISPARITIES,
    CLAIM_FIT = MATCH_MAX_DISPARITIES,  // a claim: cost times this, with the nearer lane first
};

static const uint8_t near_lanes[2 * MATCH_MAX_DISPARITIES + MATCH_LANES] = {
    [NEAR_MIDDLE - 1] = UINT8_MAX, [NEAR_MIDDLE] = UINT8_MAX, [NEAR_MIDDLE + 1] = UINT8_MAX};

// outside_lanes + 16 - n: the first n of 16 lanes; outside_lanes + 32 - n: all but the first n.
static const uint8_t outside_lanes[3 * MATCH_LANES] = {
    0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF,        0xFF, 0xFF, 0xFF, 0xFF, 0xFF,
    0xFF, 0xFF, 0xFF, 0xFF, 0xFF, [32] = 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF,
    0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF,        0xFF, 0xFF, 0xFF, 0xFF};

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

#if defined(VECTOR_HAS_CELLS)

static void pass_left(const struct row_view *view, const struct match_tile *tile, int x_begin,
                      int columns, bool hide, int rows, bool sheared, int lanes) {
    _Alignas(4) uint16_t sums[CELLS_MAX + 4];
    uint16_t *const total = sums + 2;
    for (int r = 0; r < rows; r++) {
        uint8_t *path = view->path_cost[r];
        const struct match_line *line = &view->line[r];
        ptrdiff_t cell = tile->offset + (ptrdiff_t)columns * lanes;
        for (int x = x_begin + columns - 1; x >= x_begin; x--) {
            cell -= lanes;
            if (sheared) {
                cells_shear(path, -match_rise(tile->slope_along, x + 1), UINT8_MAX, UINT8_MAX,
                            lanes);
            }
            const uint32_t lowest = cells_path(path, view->cost[r] + cell, path, TUNE_P1,
                                               line->row.penalty[x + 1], lanes);
            cells_total(path, lowest, view->sum[r] + cell, total, lanes);
            int begin = 0, end = lanes;
            if (hide) {
                searched(view, r, tile, x, &begin, &end);
            }
            for (int i = 0; i < begin && i < lanes; i++) {
                total[i] = UINT8_MAX;
            }
            for (int i = end > 0 ? end : 0; i < lanes; i++) {
                total[i] = UINT8_MAX;
            }
            line->row.lane[x] = (int16_t)cells_choose(total, lanes, &line->row.margin[x]);
        }
    }
}

#else

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

// The first lane of a member that is the lowest of all `total`.
MATCH_INLINE void first_lowest(const struct vector *total, struct vector lowest,
                               int lane[VECTOR_MEMBERS], const int count) {
    for (int r = 0; r < VECTOR_MEMBERS; r++) {
        lane[r] = -1;
    }
    // Two parts of a member fill a word.
    for (int k = 0; k < count; k += 2) {
        const uint32_t here = vector_equal(total[k], lowest);
        const uint32_t next = k + 1 < count ? vector_equal(total[k + 1], lowest) : 0;
        for (int r = 0; r < VECTOR_MEMBERS; r++) {
            const uint32_t bits = (here >> (MATCH_LANES * r) & 0xffff) +
                                  0x10000u * (next >> (MATCH_LANES * r) & 0xffff);
            if (count == 1) {
                lane[r] = __builtin_ctz(bits);
            } else if (lane[r] < 0 && bits != 0) {
                lane[r] = MATCH_LANES * k + __builtin_ctz(bits);
            }
        }
    }
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
MATCH_INLINE void pass_left(const struct row_view *shared, const struct match_tile *tile,
                            int x_begin, int columns, const bool hide, const int groups,
                            const bool sheared, const int lanes) {
    const struct row_view view = *shared;
    const uint8_t *penalty[MATCH_ROWS_ABREAST];
    for (int r = 0; r < groups * VECTOR_MEMBERS; r++) {
        penalty[r] = view.line[r].row.penalty + 1;
    }
    const struct vector small = vector_all(TUNE_P1);
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

#endif

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

// Completes the data of the winners of the pixels from x_begin on, line->row.lane, in a window of
// which the lanes [begin, end) could win. `cost`: their averaged costs; `origin`: the disparity of
// the window's first lane. Each right pixel is assigned to the left pixel with the lowest cost
// there.
static void record_winners(const struct match_line *line, int origin, const struct match_tile *tile,
                           int x_begin, int columns, const uint8_t *cost, int begin, int end) {
    int16_t *restrict lane_of = line->row.lane;
    uint32_t *restrict around = line->row.around;
    uint32_t *restrict claims = line->row.claim;
    const int count = tile->lanes;
    const int base = tile->base;
    for (int x = x_begin; x < x_begin + columns; x++) {
        const uint8_t *at = cost + (ptrdiff_t)(x - x_begin) * count;
        const int lane = lane_of[x];
        INVARIANT(lane >= begin && lane < end);
        const uint32_t fit = at[lane];
        // Without a neighbour on one side there is no sub-pixel position.
        const bool inside = lane > begin && lane + 1 < end;
        around[x] =
            inside ? at[lane - 1] | fit << 8 | (uint32_t)at[lane + 1] << 16 : fit * 0x010101u;
        // Without a branch: which of two claims is lower cannot be predicted.
        uint32_t *claim = &claims[x - origin - lane];
        const uint32_t own = fit * CLAIM_FIT + (uint32_t)(CLAIM_FIT - 1 - base - lane);
        *claim = own < *claim ? own : *claim;
        lane_of[x] = (int16_t)(lane + base);
    }
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
            *margin = *margin < TUNE_MARGIN_LEAST ? *margin : TUNE_MARGIN_LEAST - 1;
        }
    }
}

#endif
