// SPDX-License-Identifier: Apache-2.0
// Text that each set of kernels compiles: the order of the steps within a call, over the tiles of
// some rows or the rows of a tile. The vectors, and the name of the set, are defined before.
#ifndef VERGENCE_STEREO_MATCH_KERNELS_TEXT_H
#define VERGENCE_STEREO_MATCH_KERNELS_TEXT_H

#include <string.h>

#include "core/invariant.h"
#include "stereo/match/aggregation.h"
#include "stereo/match/cost.h"
#include "stereo/match/features.h"
#include "stereo/match/kernels.h"
#include "stereo/match/path_cost.h"
#include "stereo/match/selection.h"
#include "stereo/match/state.h"
#include "stereo/match/validation.h"

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
            match_copy_cells(view->running[r], view->averaged[r] + tile->offset, tile->lanes);
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

static void cost_rows(struct match_level *level, struct match_scratch *scratch, int y_begin) {
    struct cost_view view = {.level = level, .line = scratch->line};
    const struct match_band *band = scratch->band;
    view.tiles = y_begin < band->begin + MATCH_BAND_ROWS ? band->tile : band->next;
    for (int r = 0; r < MATCH_ROWS_ABREAST; r++) {
        view.averaged[r] = level->ring[(y_begin + r) % level->ring_rows];
        // Path costs from above do not exist before phase 2.
        view.raw[r] = band->from_above[r];
        view.running[r] = scratch->running + (size_t)r * (size_t)level->lanes;
    }
    right_features(level, scratch, y_begin, MATCH_ROWS_ABREAST);
    left_features(level, scratch, view.tiles, y_begin, MATCH_ROWS_ABREAST);
    weigh_steps_down(level, y_begin, MATCH_ROWS_ABREAST);
    row_shares(level, scratch, y_begin, MATCH_ROWS_ABREAST);
    average_rows(&view, MATCH_ROWS_ABREAST / VECTOR_MEMBERS);
}

// The masses above row y as they arrive in it. The first row of the image has no row above: its
// average and its path cost are its cost.
static inline void carry_down(struct column_view *view, int y, struct column_shares *shares) {
    const uint8_t *step = steps_above(view, y);
    const uint16_t *weight = weights_above(view, y);
    const uint16_t *mass_below = view->mass_below[y - view->band->begin];
    const uint8_t least = match_least_p2(view->level);
    for (int c = 0; c < MATCH_TILE_COLUMNS; c++) {
        const uint16_t carried = match_carry(view->mass[c], match_weight_down(weight[c]));
        shares->before[c] = match_share_between(carried, MATCH_MASS_ONE);
        const uint16_t mass = (uint16_t)(MATCH_MASS_ONE + carried);
        view->mass[c] = mass;
        shares->below[c] = match_share_swapped(match_share_between(mass, mass_below[c]));
        shares->penalty[c] = match_p2(step[c], least);
    }
    shares->rise = match_rise(view->tile->slope_down, y);
    shares->rise_below = -match_rise(view->tile->slope_down, y + 1);
    if (y == 0) {
        memset(shares->penalty, 0, sizeof shares->penalty);
    }
}

#if defined(VECTOR_HAS_CELLS)

static void pass_down(const struct column_shares *shares, bool below, uint8_t *down, uint8_t *cost,
                      uint8_t *previous, uint8_t *path_cost, bool sheared, int lanes) {
    _Alignas(4) uint8_t moved[CELLS_MAX];
    for (int c = 0; c < MATCH_TILE_COLUMNS; c++) {
        const int rise = sheared ? shares->rise : 0;
        const uint8_t first = cost[0], last = cost[lanes - 1];
        cells_blend(cells_sheared(down, rise, first, last, moved, lanes), cost, down,
                    TUNE_LEAN_DOWN, shares->before[c], lanes);
        if (below) {
            const int rise_below = sheared ? shares->rise_below : 0;
            cells_blend(cells_sheared(path_cost, rise_below, first, last, moved, lanes), down, cost,
                        TUNE_LEAN_DOWN, shares->below[c], lanes);
        } else {
            cells_copy(down, cost, lanes);
        }
        const uint32_t lowest =
            cells_path(cells_sheared(previous, rise, UINT8_MAX, UINT8_MAX, moved, lanes), cost,
                       path_cost, TUNE_P1, shares->penalty[c], lanes);
        cells_lower(path_cost, lowest, lanes);
        down += lanes;
        cost += lanes;
        previous += lanes;
        path_cost += lanes;
    }
}

#else

// One row on the way down. The average of the rows above, at `down`, is updated with the costs at
// `cost`. Together with the average from below, in `path_cost`, it becomes the average of all rows,
// at `cost`. The path costs of the row above, at `previous`, become those of this row, at
// `path_cost`.
MATCH_INLINE void pass_down(const struct column_shares *shares, bool below, uint8_t *down,
                            uint8_t *cost, uint8_t *previous, uint8_t *path_cost,
                            const bool sheared, const int lanes) {
    const struct vector small = vector_all(TUNE_P1);
    for (int c = 0; c < MATCH_TILE_COLUMNS; c += VECTOR_MEMBERS) {
        uint8_t *down_at[VECTOR_MEMBERS];
        uint8_t *cost_at[VECTOR_MEMBERS];
        uint8_t *previous_at[VECTOR_MEMBERS];
        uint8_t *message_at[VECTOR_MEMBERS];
        const uint8_t *penalty_at[VECTOR_MEMBERS];
        member_cells(down, c, down_at, lanes);
        member_cells(cost, c, cost_at, lanes);
        member_cells(previous, c, previous_at, lanes);
        member_cells(path_cost, c, message_at, lanes);
        for (int member = 0; member < VECTOR_MEMBERS; member++) {
            penalty_at[member] = shares->penalty + c + member;
        }
        struct lanes average;
        struct lanes own;
        load_lanes((const uint8_t *const *)down_at, 0, &average, lanes);
        load_lanes((const uint8_t *const *)cost_at, 0, &own, lanes);
        if (sheared) {
            shear_average(&average, shares->rise, (const uint8_t *const *)cost_at, 0, lanes);
        }
        blend_leaning(&average, &own, member_shares(shares->before + c), &own, lanes);
        store_lanes(&own, down_at, 0, lanes);
        if (below) {
            load_lanes((const uint8_t *const *)message_at, 0, &average, lanes);
            if (sheared) {
                shear_average(&average, shares->rise_below, (const uint8_t *const *)cost_at, 0,
                              lanes);
            }
            blend_leaning(&average, &own, member_shares(shares->below + c), &own, lanes);
        }
        store_lanes(&own, cost_at, 0, lanes);
        struct lanes running;
        load_lanes((const uint8_t *const *)previous_at, 0, &running, lanes);
        if (sheared) {
            shear(&running, shares->rise, vector_all(UINT8_MAX), vector_all(UINT8_MAX), lanes);
        }
        const struct path_penalties penalties = {small, vector_each(penalty_at, 0)};
        add_path_cost(&own, penalties, &running, lanes);
        store_lanes(&running, message_at, 0, lanes);
    }
}

#endif

MATCH_INLINE void pass_down_band(struct column_view *view, uint8_t *spare, const bool sheared,
                                 const int lanes) {
    const struct match_band *band = view->band;
    const struct match_tile *tile = view->tile;
    uint8_t *down = match_cell(band->down, tile, 0);
    uint8_t *previous = spare;
    uint8_t *cost = ring_cells(view, tile, band->begin);
    if (band->begin == 0) {
        // A 128th of it changes no cost up to MATCH_COST_MAX.
        memset(down, MATCH_WEIGHT_ONE / 2 - 1, (size_t)lanes * MATCH_TILE_COLUMNS);
        memset(previous, 0, (size_t)lanes * MATCH_TILE_COLUMNS);
    } else {
        if (band->down_before != band->down) {
            realign_columns(match_cell(band->down_before, view->before, 0), view->before, cost,
                            tile, down);
        }
        realign_columns(match_cell(band->last_above, view->before, 0), view->before, NULL, tile,
                        previous);
    }
    for (int y = band->begin; y < band->end; y++) {
        struct column_shares shares;
        carry_down(view, y, &shares);
        cost = ring_cells(view, tile, y);
        uint8_t *path_cost = match_cell(band->from_above[y - band->begin], tile, 0);
        pass_down(&shares, y < view->last, down, cost, previous, path_cost, sheared, lanes);
        previous = path_cost;
    }
}

// Tiles [begin, end) of the band.
static void columns(struct match_level *level, struct match_scratch *scratch, int begin, int end) {
    const struct match_band *band = scratch->band;
    const int ahead = band->end + TUNE_AHEAD_ROWS;
    const int slot = band->begin % level->ring_rows;
    for (int t = begin; t < end; t++) {
        struct column_view view = {
            .level = level,
            .band = band,
            .before = &band->before[t],
            .tile = &band->tile[t],
            .next = &band->next[t],
            .x_begin = t * MATCH_TILE_COLUMNS,
            .slot = slot,
            .last = (ahead < level->height ? ahead : level->height) - 1,
        };
        average_upwards(&view, scratch->running);
        uint16_t *down_mass = level->down_mass + view.x_begin;
        for (int c = 0; c < MATCH_TILE_COLUMNS; c++) {
            view.mass[c] = down_mass[c];
        }
#define PASS_DOWN_BAND(lanes, sheared) pass_down_band(&view, scratch->running, sheared, lanes)
        MATCH_WITH_CONSTANT_LANES(view.tile->lanes, view.tile->slope_down, PASS_DOWN_BAND);
#undef PASS_DOWN_BAND
        for (int c = 0; c < MATCH_TILE_COLUMNS; c++) {
            down_mass[c] = (uint16_t)view.mass[c];
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

// The last ones may be below the image.
static void rows(struct match_level *level, struct match_scratch *scratch, int y_begin) {
    const struct match_band *band = scratch->band;
    struct row_view view = {.level = level, .tiles = band->tile, .line = scratch->line};
    for (int r = 0; r < MATCH_ROWS_ABREAST; r++) {
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
    pass_both_ways(&view, MATCH_ROWS_ABREAST / VECTOR_MEMBERS);
    for (int r = 0; r < MATCH_ROWS_ABREAST && y_begin + r < level->height; r++) {
        validate_row(level, &scratch->line[r], y_begin + r, view.left[r]);
    }
}

// After the last band: medians of three disparities along the columns, and, where a row of the
// finest level covers two rows of the image, the rows between. Columns do not depend on each other.
static void finish(const struct match_level *level, struct match_scratch *scratch, int x_begin,
                   int x_end) {
    const struct image_i32 *disparity = &level->state->output->disparity_q8;
    const int columns = x_end - x_begin;
    // After a cancelled run only some rows exist.
    const int rows = level->rows_done;
    const int last = rows - 1;
    const int shift = level->shift_y;
    INVARIANT(columns >= 0 && last >= 0 && shift <= 1);
    int32_t *raw = scratch->finish;
    memcpy(raw, image_i32_row(disparity, 0) + x_begin, (size_t)columns * sizeof *raw);
    for (int y = 0; y < last; y++) {
        smooth_row(raw, image_i32_row(disparity, y << shift) + x_begin,
                   image_i32_row(disparity, (y + 1) << shift) + x_begin, columns);
    }
    for (int y = 0; y < rows && shift > 0; y++) {
        int32_t *upper = image_i32_row(disparity, 2 * y) + x_begin;
        int32_t *lower = image_i32_row(disparity, 2 * y + 1) + x_begin;
        memcpy(lower, upper, (size_t)columns * sizeof *lower);
        if (y > 0) {
            fill_between(image_i32_row(disparity, 2 * y - 1) + x_begin, upper, columns);
        }
    }
    for (int y = rows << shift; rows == level->height && y < disparity->height; y++) {
        memcpy(image_i32_row(disparity, y) + x_begin, image_i32_row(disparity, y - 1) + x_begin,
               (size_t)columns * sizeof *raw);
    }
}

static void scale(const struct match_level *level, const struct image_u8 *image, int y,
                  uint8_t *pixels) {
    uint16_t box[IMAGE_MAX_SIDE_PX];
    scale_row(image, y, level->shift_x, level->shift_y, level->width, box, pixels, 1);
}

const struct match_kernels VECTOR_KERNELS = {
    .name = VECTOR_NAME,
    .cost_rows = cost_rows,
    .columns = columns,
    .rows = rows,
    .scale = scale,
    .finish = finish,
};

#endif
