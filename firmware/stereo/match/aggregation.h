// SPDX-License-Identifier: Apache-2.0
// Text that each set of kernels compiles. Aggregation: recursive averages of the costs that stop at
// edges of the left image and follow the slope of the surface, along the row and along the columns.
// Rows needed: along the row its own costs; down, all rows above by the average of the row above;
// up, those below in the band and TUNE_AHEAD_ROWS more.
#ifndef VERGENCE_STEREO_MATCH_AGGREGATION_H
#define VERGENCE_STEREO_MATCH_AGGREGATION_H

#include <string.h>

#include "core/invariant.h"
#include "stereo/match/cost.h"
#include "stereo/match/lanes.h"
#include "stereo/match/state.h"

// A pair of shares from the first one, between 1 and 127.
#if defined(VECTOR_HAS_CELLS)
static inline match_share match_share_of(uint16_t share) {
    return cells_share(share);
}
#else
static inline match_share match_share_of(uint16_t share) {
    return (match_share)((MATCH_WEIGHT_ONE << 8) - UINT8_MAX * share);
}
#endif

// The weights of two masses, of which at least one is not 0, in a blend: 128 a / (a + b), rounded
// down. Without branches, so that compilers can vectorize it: in binary places and 16 bits, or by
// a processor that divides vectors. There 24 bits are exact: a quotient that is not whole is a
// 10,240th or more below the next whole number, and the float nearest to it is too.
static inline match_share match_share_between(uint16_t mass_a, uint16_t mass_b) {
#if defined(__SSE4_1__)
    const float quotient = (float)(mass_a * MATCH_WEIGHT_ONE) / (float)(mass_a + mass_b);
    uint16_t share = (uint16_t)(int32_t)quotient;
    share = share < MATCH_WEIGHT_ONE ? share : MATCH_WEIGHT_ONE - 1;
#elif defined(__bfin__)
    const uint16_t share = (uint16_t)quotient_7_places(mass_a, (uint32_t)mass_a + mass_b);
#else
    const uint16_t whole = (uint16_t)(mass_a + mass_b);
    uint16_t rest = mass_a;
    uint16_t share = 0;
    for (int i = 0; i < 7; i++) {
        rest = (uint16_t)(2 * rest);
        const uint16_t taken = rest >= whole ? whole : 0;
        rest = (uint16_t)(rest - taken);
        share = (uint16_t)(2 * share + (taken != 0 ? 1 : 0));
    }
#endif
    return match_share_of(share == 0 ? 1 : share);
}

// The two weights swapped.
static inline match_share match_share_swapped(match_share share) {
#if defined(VECTOR_HAS_CELLS)
    return cells_share_swapped(share);
#else
    return (match_share)(share >> 8 | share << 8);
#endif
}

// Weight of a neighbour across a step of grey levels, in 1/65536: 0.9 (1 - step / 112)^8, which is
// close to 0.9 exp(-step / 14). Computed where vectors do it, else found in a table.
#define WEIGHT_UNIT (UINT16_MAX / TUNE_EDGE_STEP)
#if defined(VECTOR_HAS_CELLS)
#define WEIGHT_SQUARE(share) ((share) * (share) >> 16)
#define WEIGHT(step)                                                                          \
    (WEIGHT_SQUARE(                                                                           \
         WEIGHT_SQUARE(WEIGHT_SQUARE((uint32_t)(WEIGHT_UNIT * (TUNE_EDGE_STEP - (step)))))) * \
         TUNE_EDGE_WEIGHT >>                                                                  \
     16)
#define WEIGHTS_4(step) WEIGHT(step), WEIGHT((step) + 1), WEIGHT((step) + 2), WEIGHT((step) + 3)
#define WEIGHTS_16(step) \
    WEIGHTS_4(step), WEIGHTS_4((step) + 4), WEIGHTS_4((step) + 8), WEIGHTS_4((step) + 12)

static inline uint16_t match_weight(uint8_t step) {
    _Static_assert(TUNE_EDGE_STEP == 7 * 16, "as many weights");
    static const uint16_t weights[TUNE_EDGE_STEP + 1] = {
        WEIGHTS_16(0),  WEIGHTS_16(16), WEIGHTS_16(32), WEIGHTS_16(48),
        WEIGHTS_16(64), WEIGHTS_16(80), WEIGHTS_16(96)};
    return weights[step < TUNE_EDGE_STEP ? step : TUNE_EDGE_STEP];
}
#else
static inline uint16_t match_weight(uint8_t step) {
    const uint16_t capped = step < TUNE_EDGE_STEP ? step : TUNE_EDGE_STEP;
    const uint16_t base = (uint16_t)(WEIGHT_UNIT * (TUNE_EDGE_STEP - capped));
    const uint16_t square = (uint16_t)((uint32_t)base * base >> 16);
    const uint16_t fourth = (uint16_t)((uint32_t)square * square >> 16);
    const uint16_t eighth = (uint16_t)((uint32_t)fourth * fourth >> 16);
    return (uint16_t)((uint32_t)eighth * TUNE_EDGE_WEIGHT >> 16);
}
#endif

// Weight of the average from above across an edge of `weight`. It reaches further than the rows of
// look-ahead below, and would lag behind a slanted surface: a sixteenth less.
static inline uint16_t match_weight_down(uint16_t weight) {
    return (uint16_t)(weight - weight / TUNE_DOWN_LESS);
}

// A neighbour's mass as it arrives across an edge of `weight`.
static inline uint16_t match_carry(uint16_t mass, uint16_t weight) {
    return (uint16_t)((uint32_t)mass * weight >> 16);
}

// Weights of the steps between rows, of the rows from y_begin on.
static void weigh_steps_down(const struct match_level *level, int y_begin, int rows) {
    const int columns = level->tiles * MATCH_TILE_COLUMNS;
    for (int r = 0; r < rows; r++) {
        const int slot = (y_begin + r) % level->ring_rows;
        const uint8_t *restrict step = level->step_down[slot];
        uint16_t *restrict weight = level->weight_down[slot];
        for (int x = 0; x < columns; x++) {
            weight[x] = match_weight(step[x]);
        }
    }
}

// Masses of the averages along the rows from both sides, and the masses that arrive at each pixel.
// Rows are processed in parallel: each depends on its own previous mass, not on other rows.
MATCH_INLINE void row_masses(struct match_line *line, int width, const int rows) {
    uint16_t mass[MATCH_ROWS_ABREAST];
    const uint16_t *weight[MATCH_ROWS_ABREAST];
    uint16_t *from_left[MATCH_ROWS_ABREAST];
    uint16_t *from_right[MATCH_ROWS_ABREAST];
    for (int r = 0; r < rows; r++) {
        weight[r] = line[r].cost.weight;
        from_left[r] = line[r].cost.forward;
        from_right[r] = line[r].cost.backward;
        mass[r] = 0;
    }
    for (int x = 0; x < width; x++) {
        for (int r = 0; r < rows; r++) {
            from_left[r][x] = match_carry(mass[r], weight[r][x]);
            mass[r] = (uint16_t)(MATCH_MASS_ONE + from_left[r][x]);
        }
    }
    for (int r = 0; r < rows; r++) {
        from_right[r][width - 1] = 0;
        mass[r] = MATCH_MASS_ONE;
    }
    for (int x = width - 2; x >= 0; x--) {
        for (int r = 0; r < rows; r++) {
            from_right[r][x] = match_carry(mass[r], weight[r][x + 1]);
            mass[r] = (uint16_t)(MATCH_MASS_ONE + from_right[r][x]);
        }
    }
}

MATCH_INLINE void row_shares(const struct match_level *level, struct match_scratch *scratch,
                             int y_begin, const int rows) {
    const int width = level->width;
    for (int r = 0; r < rows; r++) {
        const uint8_t *restrict step = level->step_along[(y_begin + r) % level->ring_rows];
        uint16_t *restrict weight = scratch->line[r].cost.weight;
        for (int x = 0; x < width; x++) {
            weight[x] = match_weight(step[x]);
        }
    }
    row_masses(scratch->line, width, rows);
    for (int r = 0; r < rows; r++) {
        match_share *restrict forward = scratch->line[r].cost.forward;
        match_share *restrict joined = scratch->line[r].cost.joined;
        match_share *restrict backward = scratch->line[r].cost.backward;
        for (int x = 0; x < width; x++) {
            const uint16_t from_left = forward[x];
            const uint16_t from_right = backward[x];
            joined[x] = match_share_between((uint16_t)(MATCH_MASS_ONE + from_left), from_right);
            forward[x] = match_share_between(from_left, MATCH_MASS_ONE);
            backward[x] = match_share_between(from_right, MATCH_MASS_ONE);
        }
    }
}

#if defined(VECTOR_HAS_CELLS)

// As below; the average of a pixel is that of the next one's neighbour.
static void average_forward(const struct cost_view *view, const struct match_tile *tile,
                            int x_begin, int first, int columns, int rows, bool sheared,
                            int lanes) {
    for (int r = 0; r < rows; r++) {
        uint8_t *running = view->running[r];
        const uint8_t *from = running;
        ptrdiff_t cell = tile->offset + (ptrdiff_t)first * lanes;
        for (int x = x_begin + first; x < x_begin + columns; x++, cell += lanes) {
            const uint8_t *own = view->raw[r] + cell;
            if (sheared) {
                from = cells_sheared(from, match_rise(tile->slope_along, x), own[0], own[lanes - 1],
                                     running, lanes);
            }
            uint8_t *to = view->averaged[r] + cell;
            cells_blend(from, own, to, TUNE_LEAN_ALONG, view->line[r].cost.forward[x], lanes);
            from = to;
        }
        cells_copy(from, running, lanes);
    }
}

static void average_backward(const struct cost_view *view, const struct match_tile *tile,
                             int x_begin, int columns, int rows, bool sheared, int lanes) {
    for (int r = 0; r < rows; r++) {
        uint8_t *running = view->running[r];
        ptrdiff_t cell = tile->offset + (ptrdiff_t)columns * lanes;
        for (int x = x_begin + columns - 1; x >= x_begin; x--) {
            cell -= lanes;
            const uint8_t *own = view->raw[r] + cell;
            if (sheared) {
                cells_shear(running, -match_rise(tile->slope_along, x + 1), own[0], own[lanes - 1],
                            lanes);
            }
            cells_join(running, own, view->averaged[r] + cell, TUNE_LEAN_ALONG,
                       view->line[r].cost.joined[x], view->line[r].cost.backward[x], lanes);
        }
    }
}

#else

enum { COST_GROUPS = MATCH_ROWS_ABREAST / VECTOR_MEMBERS };

// Averages of the costs up to each column from column `first` of the tile on, weighted by the edges
// between. They lean, as a surface may be slanted along the row.
MATCH_INLINE void average_forward(const struct cost_view *shared, const struct match_tile *tile,
                                  int x_begin, int first, int columns, const int groups,
                                  const bool sheared, const int lanes) {
    // A local copy, as stores of bytes might alias the original.
    const struct cost_view view = *shared;
    const match_share *shares_at[MATCH_ROWS_ABREAST];
    for (int r = 0; r < groups * VECTOR_MEMBERS; r++) {
        shares_at[r] = view.line[r].cost.forward;
    }
    struct lanes average[COST_GROUPS];
    for (int q = 0; q < groups; q++) {
        load_lanes((const uint8_t *const *)view.running + q * VECTOR_MEMBERS, 0, &average[q],
                   lanes);
    }
    const struct vector price = vector_all(TUNE_LEAN_ALONG);
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
MATCH_INLINE void average_backward(const struct cost_view *shared, const struct match_tile *tile,
                                   int x_begin, int columns, const int groups, const bool sheared,
                                   const int lanes) {
    const struct cost_view view = *shared;
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
    const struct vector price = vector_all(TUNE_LEAN_ALONG);
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

#endif

// Moves the averages from the neighbour from the window of the tile `from` to that of `tile`. Where
// that has no value, the pixel's own cost is used. The first pixel (`from` is NULL) is its own
// average.
static void enter_tile_with_averages(const struct cost_view *view, const int rows,
                                     const struct match_tile *from, const struct match_tile *tile,
                                     int column) {
    for (int r = 0; r < rows; r++) {
        const uint8_t *own = match_cell(view->raw[r], tile, column);
        if (from == NULL) {
            match_copy_cells(own, view->running[r], tile->lanes);
        } else if (!match_same_window(from, tile)) {
            MATCH_ALIGNED uint8_t realigned[MATCH_MAX_DISPARITIES];
            match_realign(view->running[r], from, own, tile, realigned);
            match_copy_cells(realigned, view->running[r], tile->lanes);
        }
    }
}

struct column_view {
    const struct match_level *level;
    const struct match_band *band;
    const struct match_tile *before, *tile, *next;  // windows of three bands
    int x_begin;
    int slot;  // of the band's first row in the rings
    int last;  // row without a row below it yet
    // Mass of the average through the previous row, on its way to this one.
    uint16_t mass[MATCH_TILE_COLUMNS];
    // What arrives from below at each row of the band.
    uint16_t mass_below[MATCH_BAND_ROWS][MATCH_TILE_COLUMNS];
};

struct share_row {
    match_share of_column[MATCH_TILE_COLUMNS];
    int rise;  // lanes to this row from the row below
};

struct column_shares {
    match_share before[MATCH_TILE_COLUMNS];  // share of the average from the row before
    match_share below[MATCH_TILE_COLUMNS];   // share of the average from below
    uint8_t penalty[MATCH_TILE_COLUMNS];     // large penalty between the row before and this one
    int rise, rise_below;  // lanes to this row from the row before, and from the row below
};

// The slot of row y of the band or of the one below it; the Blackfin divides slowly.
static inline int ring_slot(const struct column_view *view, int y) {
#if defined(VECTOR_HAS_CELLS)
    const int slot = view->slot + y - view->band->begin;
    return slot < view->level->ring_rows ? slot : slot - view->level->ring_rows;
#else
    return y % view->level->ring_rows;
#endif
}

// Steps between the rows y - 1 and y, by column of the tile, and their weights.
static inline const uint8_t *steps_above(const struct column_view *view, int y) {
    return view->level->step_down[ring_slot(view, y)] + view->x_begin;
}

static inline const uint16_t *weights_above(const struct column_view *view, int y) {
    return view->level->weight_down[ring_slot(view, y)] + view->x_begin;
}

static inline uint8_t *ring_cells(const struct column_view *view, const struct match_tile *tile,
                                  int y) {
    return match_cell(view->level->ring[ring_slot(view, y)], tile, 0);
}

#if defined(VECTOR_HAS_CELLS)

static void average_up(const struct share_row *shares, uint8_t *below, uint8_t *cost, uint8_t *to,
                       bool sheared, int lanes) {
    _Alignas(4) uint8_t moved[CELLS_MAX];
    for (int c = 0; c < MATCH_TILE_COLUMNS; c++, below += lanes, cost += lanes, to += lanes) {
        const uint8_t *from = cells_sheared(below, sheared ? shares->rise : 0, cost[0],
                                            cost[lanes - 1], moved, lanes);
        cells_blend(from, cost, to, TUNE_LEAN_DOWN, shares->of_column[c], lanes);
    }
}

#else

// The blend in which `a` leans: an average along a surface that is slanted by up to one disparity
// per row, and not only along a vertical one.
MATCH_INLINE void blend_leaning(const struct lanes *a, const struct lanes *b,
                                struct vector_shares shares, struct lanes *result,
                                const int lanes) {
    const struct vector price = vector_all(TUNE_LEAN_DOWN);
    struct vector before = vector_all(UINT8_MAX);
    for (int k = 0; k < lanes / MATCH_LANES; k++) {
        const struct vector here = a->part[k];
        result->part[k] = vector_blend(leaning(a, k, before, price, lanes), b->part[k], shares);
        before = here;
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
MATCH_INLINE void average_up(const struct share_row *shares, uint8_t *below, uint8_t *cost,
                             uint8_t *to, const bool sheared, const int lanes) {
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

#endif

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
MATCH_INLINE void average_up_ahead(struct column_view *view, uint8_t *running, const bool sheared,
                                   const int lanes) {
    for (int y = view->last - 1; y >= view->band->end; y--) {
        struct share_row shares;
        carry_up(view, y, &shares);
        shares.rise = -match_rise(view->next->slope_down, y + 1);
        average_up(&shares, running, ring_cells(view, view->next, y), running, sheared, lanes);
    }
}

// Goes through the rows of the band: from_above of each row becomes the average of those below it.
MATCH_INLINE void average_up_band(struct column_view *view, int y_begin, const bool sheared,
                                  const int lanes) {
    const struct match_band *band = view->band;
    for (int y = y_begin; y >= band->begin; y--) {
        struct share_row shares;
        carry_up(view, y, &shares);
        shares.rise = -match_rise(view->tile->slope_down, y + 1);
        const int row = y - band->begin;
        if (row > 0) {
            average_up(&shares, match_cell(band->from_above[row], view->tile, 0),
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
#define AVERAGE_UP_BAND(lanes, sheared) average_up_band(view, last - 1, sheared, lanes)
        MATCH_WITH_CONSTANT_LANES(tile->lanes, tile->slope_down, AVERAGE_UP_BAND);
#undef AVERAGE_UP_BAND
        return;
    }
    const struct match_tile *next = view->next;
    memcpy(running, ring_cells(view, next, last), (size_t)next->lanes * MATCH_TILE_COLUMNS);
#define AVERAGE_UP_AHEAD(lanes, sheared) average_up_ahead(view, running, sheared, lanes)
    MATCH_WITH_CONSTANT_LANES(next->lanes, next->slope_down, AVERAGE_UP_AHEAD);
#undef AVERAGE_UP_AHEAD
    realign_columns(running, next, ring_cells(view, tile, band->end - 1), tile,
                    match_cell(band->from_above[below_band - 1], tile, 0));
#define AVERAGE_UP_BAND(lanes, sheared) average_up_band(view, band->end - 1, sheared, lanes)
    MATCH_WITH_CONSTANT_LANES(tile->lanes, tile->slope_down, AVERAGE_UP_BAND);
#undef AVERAGE_UP_BAND
}

#endif
