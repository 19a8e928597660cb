// SPDX-License-Identifier: Apache-2.0
// Phase 2 (included by match_plain.c and the other kernel sets): edge-aware averages down the
// columns and, with a bounded look-ahead, up; then the dynamic-programming path cost from the row
// above. A tile is processed row by row: neighbouring columns do not depend on each other, and its
// cells stay in the fastest cache.
#ifndef VERGENCE_STEREO_MATCH_MATCH_COLUMN_PHASE_H
#define VERGENCE_STEREO_MATCH_MATCH_COLUMN_PHASE_H

#include <string.h>

#include "core/invariant.h"
#include "stereo/match/match_level.h"
#include "stereo/match/match_path_cost.h"
#include "stereo/match/match_state.h"

struct column_view {
    const struct match_level *level;
    const struct match_band *band;
    const struct match_tile *before, *tile, *next;  // windows of three bands
    int x_begin;
    int last;                           // row without a row below it yet
    uint16_t mass[MATCH_TILE_COLUMNS];  // of what comes from the row before, on the way
    // What arrives from below at each row of the band.
    uint16_t mass_below[MATCH_BAND_ROWS][MATCH_TILE_COLUMNS];
};

struct share_row {
    match_share of_column[MATCH_TILE_COLUMNS];
    int rise;  // lanes to this row from the row below
};

struct column_shares {
    match_share before[MATCH_TILE_COLUMNS];  // of what comes from the row before
    match_share below[MATCH_TILE_COLUMNS];   // of what comes from below
    uint8_t penalty[MATCH_TILE_COLUMNS];     // large penalty between the row before and this one
    int rise, rise_below;  // lanes to this row from the row before, and from the row below
};

// Steps between the rows y - 1 and y, by column of the tile, and their weights.
static inline const uint8_t *steps_above(const struct column_view *view, int y) {
    return view->level->step_down[y % view->level->ring_rows] + view->x_begin;
}

static inline const uint16_t *weights_above(const struct column_view *view, int y) {
    return view->level->weight_down[y % view->level->ring_rows] + view->x_begin;
}

static inline uint8_t *ring_cells(const struct column_view *view, const struct match_tile *tile,
                                  int y) {
    return match_cell(view->level->ring[y % view->level->ring_rows], tile, 0);
}

// The blend in which `a` leans: an average along a surface that is slanted by up to one disparity
// per row, and not only along a vertical one.
MATCH_INLINE void blend_leaning(const struct lanes *a, const struct lanes *b,
                                struct vector_shares shares, struct lanes *result,
                                const int lanes) {
    const struct vector price = vector_all(MATCH_LEAN_DOWN);
    struct vector before = vector_all(UINT8_MAX);
    for (int k = 0; k < lanes / MATCH_LANES; k++) {
        const struct vector here = a->part[k];
        result->part[k] = vector_blend(leaning(a, k, before, price, lanes), b->part[k], shares);
        before = here;
    }
}

MATCH_INLINE void member_cells(uint8_t *cells, int c, uint8_t *at[VECTOR_MEMBERS],
                               const int lanes) {
    for (int member = 0; member < VECTOR_MEMBERS; member++) {
        at[member] = cells + (ptrdiff_t)(c + member) * lanes;
    }
}

MATCH_INLINE struct vector_shares member_shares(const match_share *shares) {
    const match_share *at[VECTOR_MEMBERS];
    for (int member = 0; member < VECTOR_MEMBERS; member++) {
        at[member] = shares + member;
    }
    return vector_shares_each(at, 0);
}

// Adds row y to the averages of the rows below it, at `below`; the result goes to `to`, which may
// be `below`.
MATCH_INLINE void climb(const struct share_row *shares, uint8_t *below, uint8_t *cost, uint8_t *to,
                        const bool sheared, const int lanes) {
    for (int c = 0; c < MATCH_TILE_COLUMNS; c += VECTOR_MEMBERS) {
        uint8_t *below_at[VECTOR_MEMBERS];
        uint8_t *cost_at[VECTOR_MEMBERS];
        uint8_t *to_at[VECTOR_MEMBERS];
        member_cells(below, c, below_at, lanes);
        member_cells(cost, c, cost_at, lanes);
        member_cells(to, c, to_at, lanes);
        struct lanes from_below;
        struct lanes own;
        load_lanes((const uint8_t *const *)below_at, 0, &from_below, lanes);
        load_lanes((const uint8_t *const *)cost_at, 0, &own, lanes);
        if (sheared) {
            shear_average(&from_below, shares->rise, (const uint8_t *const *)cost_at, 0, lanes);
        }
        struct lanes average;
        blend_leaning(&from_below, &own, member_shares(shares->of_column + c), &average, lanes);
        store_lanes(&average, to_at, 0, lanes);
    }
}

// The masses below row y as they arrive in it.
static inline void carry_up(struct column_view *view, int y, struct share_row *shares) {
    const uint16_t *weight = weights_above(view, y + 1);
    uint16_t carried[MATCH_TILE_COLUMNS];
    for (int c = 0; c < MATCH_TILE_COLUMNS; c++) {
        carried[c] = match_carry(view->mass[c], weight[c]);
        shares->of_column[c] = match_share_between(carried[c], MATCH_MASS_ONE);
        view->mass[c] = (uint16_t)(MATCH_MASS_ONE + carried[c]);
    }
    if (y < view->band->end) {
        memcpy(view->mass_below[y - view->band->begin], carried, sizeof carried);
    }
}

// Averages through the rows of the next band that are available, into `running`.
MATCH_INLINE void climb_ahead(struct column_view *view, uint8_t *running, const bool sheared,
                              const int lanes) {
    for (int y = view->last - 1; y >= view->band->end; y--) {
        struct share_row shares;
        carry_up(view, y, &shares);
        shares.rise = -match_rise(view->next->slope_down, y + 1);
        climb(&shares, running, ring_cells(view, view->next, y), running, sheared, lanes);
    }
}

// Goes through the rows of the band: from_above of each row becomes the average of those below it.
MATCH_INLINE void climb_band(struct column_view *view, int y_begin, const bool sheared,
                             const int lanes) {
    const struct match_band *band = view->band;
    for (int y = y_begin; y >= band->begin; y--) {
        struct share_row shares;
        carry_up(view, y, &shares);
        shares.rise = -match_rise(view->tile->slope_down, y + 1);
        const int row = y - band->begin;
        if (row > 0) {
            climb(&shares, match_cell(band->from_above[row], view->tile, 0),
                  ring_cells(view, view->tile, y),
                  match_cell(band->from_above[row - 1], view->tile, 0), sheared, lanes);
        }
    }
}

// Copies the cells of the tile's columns from one window to another. Where the old one has no
// value, the row's own cells are used, or infinity if `fill` is NULL.
static void realign_columns(const uint8_t *cells, const struct match_tile *from,
                            const uint8_t *fill, const struct match_tile *to, uint8_t *to_cells) {
    if (match_same_window(from, to)) {
        memcpy(to_cells, cells, (size_t)MATCH_TILE_COLUMNS * (size_t)to->lanes);
        return;
    }
    for (int c = 0; c < MATCH_TILE_COLUMNS; c++) {
        match_realign(cells + (ptrdiff_t)c * from->lanes, from,
                      fill == NULL ? NULL : fill + (ptrdiff_t)c * to->lanes, to,
                      to_cells + (ptrdiff_t)c * to->lanes);
    }
}

// Leaves in from_above the average of the available rows below each row of the band, and in
// mass_below its mass.
static void average_upwards(struct column_view *view, uint8_t *running) {
    const struct match_band *band = view->band;
    const struct match_tile *tile = view->tile;
    const int last = view->last;
    const int below_band = band->end - band->begin;
    INVARIANT(last >= band->end - 1);
    for (int c = 0; c < MATCH_TILE_COLUMNS; c++) {
        view->mass[c] = MATCH_MASS_ONE;
    }
    if (last < band->end) {
        // The last row of the image: the row above it is the first that has a row below.
        if (below_band > 1) {
            memcpy(match_cell(band->from_above[below_band - 2], tile, 0),
                   ring_cells(view, tile, last), (size_t)tile->lanes * MATCH_TILE_COLUMNS);
        }
#define CLIMB_BAND(lanes, sheared) climb_band(view, last - 1, sheared, lanes)
        MATCH_WITH_CONSTANT_LANES(tile->lanes, tile->slope_down, CLIMB_BAND);
#undef CLIMB_BAND
        return;
    }
    const struct match_tile *next = view->next;
    memcpy(running, ring_cells(view, next, last), (size_t)next->lanes * MATCH_TILE_COLUMNS);
#define CLIMB_AHEAD(lanes, sheared) climb_ahead(view, running, sheared, lanes)
    MATCH_WITH_CONSTANT_LANES(next->lanes, next->slope_down, CLIMB_AHEAD);
#undef CLIMB_AHEAD
    realign_columns(running, next, ring_cells(view, tile, band->end - 1), tile,
                    match_cell(band->from_above[below_band - 1], tile, 0));
#define CLIMB_BAND(lanes, sheared) climb_band(view, band->end - 1, sheared, lanes)
    MATCH_WITH_CONSTANT_LANES(tile->lanes, tile->slope_down, CLIMB_BAND);
#undef CLIMB_BAND
}

// One row on the way down. The average of the rows above, at `down`, is updated with the costs at
// `cost`. Together with the average from below, in `path_cost`, it becomes the average of all rows,
// at `cost`. The path costs of the row above, at `previous`, become those of this row, at
// `path_cost`.
MATCH_INLINE void descend(const struct column_shares *shares, bool below, uint8_t *down,
                          uint8_t *cost, uint8_t *previous, uint8_t *path_cost, const bool sheared,
                          const int lanes) {
    const struct vector small = vector_all(MATCH_P1);
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

MATCH_INLINE void descend_band(struct column_view *view, uint8_t *spare, const bool sheared,
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
        descend(&shares, y < view->last, down, cost, previous, path_cost, sheared, lanes);
        previous = path_cost;
    }
}

// Tiles [begin, end) of the band.
static void columns(struct match_level *level, struct match_scratch *scratch, int begin, int end) {
    const struct match_band *band = scratch->band;
    INVARIANT(band->cost_end >= band->end);
    for (int t = begin; t < end; t++) {
        struct column_view view = {
            .level = level,
            .band = band,
            .before = &band->before[t],
            .tile = &band->tile[t],
            .next = &band->next[t],
            .x_begin = t * MATCH_TILE_COLUMNS,
            .last = (band->cost_end < level->height ? band->cost_end : level->height) - 1,
        };
        average_upwards(&view, scratch->running);
        uint16_t *down_mass = level->down_mass + view.x_begin;
        for (int c = 0; c < MATCH_TILE_COLUMNS; c++) {
            view.mass[c] = down_mass[c];
        }
#define DESCEND_BAND(lanes, sheared) descend_band(&view, scratch->running, sheared, lanes)
        MATCH_WITH_CONSTANT_LANES(view.tile->lanes, view.tile->slope_down, DESCEND_BAND);
#undef DESCEND_BAND
        for (int c = 0; c < MATCH_TILE_COLUMNS; c++) {
            down_mass[c] = (uint16_t)view.mass[c];
        }
    }
}

#endif
