// SPDX-License-Identifier: Apache-2.0
// Text that each set of kernels compiles. Path costs: dynamic programming along three directions of
// H. Hirschmueller, "Stereo processing by semiglobal matching and mutual information", PAMI 30(2),
// 2008: from the row above, from the left and (selection.h) from the right.
// Rows needed: the averages of the row; from above, the path costs of the row above.
#ifndef VERGENCE_STEREO_MATCH_PATH_COST_H
#define VERGENCE_STEREO_MATCH_PATH_COST_H

#include <string.h>

#include "core/invariant.h"
#include "stereo/match/lanes.h"
#include "stereo/match/state.h"

// Penalty of a jump across a step of grey levels: an edge makes it plausible. The lowest is
// `least`.
static inline uint8_t match_p2(uint8_t step, uint8_t least) {
#if defined(VECTOR_HAS_CELLS)
    const int lowered = TUNE_P2 - TUNE_P2_SLOPE * step;
    return (uint8_t)(lowered > least ? lowered : least);
#else
    enum { STEPS = TUNE_P2 / TUNE_P2_SLOPE };
    const uint8_t lowered = (uint8_t)(TUNE_P2 - TUNE_P2_SLOPE * (step < STEPS ? step : STEPS));
    return lowered > least ? lowered : least;
#endif
}

// The least penalty of a jump: see match_p2. Lower ones lose steep surfaces on coarser levels.
static inline uint8_t match_least_p2(const struct match_level *level) {
    return match_is_finest(level) ? TUNE_P2_MIN : TUNE_P2_MIN_COARSER;
}

struct path_penalties {
    struct vector p1;  // penalty of a change by one disparity
    struct vector p2;  // penalty of any other change
};

// message[i] = cost[i] + min(p[i], p[i-1] + small, p[i+1] + small, large), where p is the previous
// path cost in `path_cost` and neighbours beyond the ends are infinite; then its lowest lane is
// subtracted: equation 13.
MATCH_INLINE void add_path_cost(const struct lanes *cost, struct path_penalties penalties,
                                struct lanes *path_cost, const int lanes) {
    const int count = lanes / MATCH_LANES;
    struct vector before = vector_all(UINT8_MAX);
    struct vector smallest = vector_all(UINT8_MAX);
    for (int k = 0; k < count; k++) {
        const struct vector here = path_cost->part[k];
        const struct vector beside = lower_neighbour(path_cost, k, before, lanes);
        const struct vector step =
            vector_min(vector_min(here, vector_add(beside, penalties.p1)), penalties.p2);
        path_cost->part[k] = vector_add(cost->part[k], step);
        smallest = vector_min(smallest, path_cost->part[k]);
        before = here;
    }
    const struct vector lowest = vector_lowest(smallest);
    for (int k = 0; k < count; k++) {
        path_cost->part[k] = vector_sub(path_cost->part[k], lowest);
    }
}

enum {
    // Upper bound of a path cost's contribution to a sum of two that must fit 8 bits.
    SUMMAND_MAX = 127,
    ROW_GROUPS = MATCH_ROWS_ABREAST / VECTOR_MEMBERS,
};

struct row_view {
    const struct match_level *level;
    const struct match_tile *tiles;
    struct match_line *line;  // one a row
    const uint8_t *cost[MATCH_ROWS_ABREAST];
    const uint8_t *above[MATCH_ROWS_ABREAST];  // messages from above
    // Messages from above plus the path costs from the left; may be `above`.
    uint8_t *sum[MATCH_ROWS_ABREAST];
    uint8_t *path_cost[MATCH_ROWS_ABREAST];  // path costs of the last pixel of a tile
    struct rectify_span left[MATCH_ROWS_ABREAST], right[MATCH_ROWS_ABREAST];
};

#if defined(VECTOR_HAS_CELLS)

static inline void pass_right(const struct row_view *view, const struct match_tile *tile,
                              int x_begin, int columns, int rows, bool sheared, int lanes) {
    for (int r = 0; r < rows; r++) {
        uint8_t *path = view->path_cost[r];
        ptrdiff_t cell = tile->offset;
        for (int x = x_begin; x < x_begin + columns; x++, cell += lanes) {
            if (sheared) {
                cells_shear(path, match_rise(tile->slope_along, x), UINT8_MAX, UINT8_MAX, lanes);
            }
            const uint32_t lowest = cells_path(path, view->cost[r] + cell, path, TUNE_P1,
                                               view->line[r].row.penalty[x], lanes);
            cells_sum(path, lowest, view->above[r] + cell, view->sum[r] + cell, SUMMAND_MAX, lanes);
        }
    }
}

#else

// Path costs from the left through one tile, each added to the one from above.
MATCH_INLINE void pass_right(const struct row_view *shared, const struct match_tile *tile,
                             int x_begin, int columns, const int groups, const bool sheared,
                             const int lanes) {
    // A local copy, as stores of bytes might alias the original.
    const struct row_view view = *shared;
    const uint8_t *penalty[MATCH_ROWS_ABREAST];
    for (int r = 0; r < groups * VECTOR_MEMBERS; r++) {
        penalty[r] = view.line[r].row.penalty;
    }
    const struct vector small = vector_all(TUNE_P1);
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

#endif

// Moves the path costs to another window; from beyond a row (`from` is NULL) the first cost.
static inline void enter_tile_with_path_costs(const struct row_view *view, const int rows,
                                              const struct match_tile *from,
                                              const struct match_tile *tile) {
    for (int r = 0; r < rows; r++) {
        if (from == NULL) {
            memset(view->path_cost[r], 0, (size_t)tile->lanes);
        } else if (!match_same_window(from, tile)) {
            MATCH_ALIGNED uint8_t realigned[MATCH_MAX_DISPARITIES];
            match_realign(view->path_cost[r], from, NULL, tile, realigned);
            match_copy_cells(realigned, view->path_cost[r], tile->lanes);
        }
    }
}

static inline void prepare_line(const struct match_level *level, struct match_line *line, int y) {
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

#endif
