// SPDX-License-Identifier: Apache-2.0
// Text that each set of kernels compiles. Cost of each disparity of a pixel: bits of the census
// that differ, and the difference of the gradients. Rows needed: the row's own features.
#ifndef VERGENCE_STEREO_MATCH_COST_H
#define VERGENCE_STEREO_MATCH_COST_H

#include "core/invariant.h"
#include "stereo/match/lanes.h"
#include "stereo/match/state.h"

struct cost_view {
    const struct match_level *level;
    const struct match_tile *tiles;
    const struct match_line *line;          // one a row
    uint8_t *raw[MATCH_ROWS_ABREAST];       // costs
    uint8_t *averaged[MATCH_ROWS_ABREAST];  // rows of the ring
    // Averages from the neighbour, in the window of the present tile.
    uint8_t *running[MATCH_ROWS_ABREAST];
};

#if defined(VECTOR_HAS_CELLS)

// As below, of one row.
static void tile_costs(const struct cost_view *view, int r, const struct match_tile *tile,
                       int x_begin, int columns, int lanes) {
    _Static_assert((int)TUNE_CENSUS_WEIGHT == (int)CELLS_BIT_COST, "");
    const struct match_level *level = view->level;
    const int first = level->width - 1 + level->right_pad + level->disparity_min + tile->base;
    INVARIANT(first - (x_begin + columns - 1) >= 0);
    INVARIANT(first - x_begin + lanes <= level->right_length);
    const struct match_line *line = &view->line[r];
    const struct match_features *left = &line->cost.left;
    uint8_t *to = view->raw[r] + tile->offset;
    for (int x = x_begin; x < x_begin + columns; x++, to += lanes) {
        const uint32_t own = left->census[0][x] | (uint32_t)left->census[1][x] << 8 |
                             (uint32_t)left->census[2][x] << 16;
        cells_cost(line->cost.right_census + first - x, own, line->cost.right.gradient + first - x,
                   left->gradient[x], TUNE_GRADIENT_MAX, to, lanes);
    }
}

#else

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

#endif

#endif
