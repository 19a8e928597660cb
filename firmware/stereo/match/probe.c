// SPDX-License-Identifier: Apache-2.0
#include "stereo/match/probe.h"

#include <string.h>

#include "core/invariant.h"
#include "stereo/match/vector_plain.h"
// The step uses the vectors included above.
#include "stereo/match/path_cost.h"
#include "stereo/match/state.h"

// The kernels must be the first member.
static const struct match_probe *probe_of(const struct match_level *level) {
    return (const struct match_probe *)level->state->options.kernels;
}

static struct match_probe_row row_of(const struct match_level *level, const struct match_band *band,
                                     enum match_probe_event event, int y) {
    INVARIANT(y >= band->begin && y < level->height);
    return (struct match_probe_row){
        .event = event,
        .level = (int)(level - level->state->level),
        .y = y,
        .width = level->width,
        .height = level->height,
        .shift_x = level->shift_x,
        .shift_y = level->shift_y,
        .disparity_min = level->disparity_min,
        .disparity_count = level->disparity_count,
        .plane_bytes = level->row_bytes,
        .tiles = y < band->begin + MATCH_BAND_ROWS ? band->tile : band->next,
        .owner = level,
    };
}

static void probed_cost_rows(struct match_level *level, struct match_scratch *scratch,
                             int y_begin) {
    const struct match_probe *probe = probe_of(level);
    probe->real->cost_rows(level, scratch, y_begin);
    for (int r = 0; r < MATCH_ROWS_ABREAST && y_begin + r < level->height; r++) {
        const struct match_features *left = &scratch->line[r].cost.left;
        struct match_probe_row row = row_of(level, scratch->band, MATCH_PROBE_COSTS, y_begin + r);
        for (int plane = 0; plane < MATCH_CENSUS_PLANES; plane++) {
            row.census[plane] = left->census[plane];
        }
        row.gradient = left->gradient;
        row.cost = scratch->band->from_above[r];
        row.cost_along = level->ring[row.y % level->ring_rows];
        probe->look(probe->self, &row);
    }
}

static void look_at_path_costs(const struct match_level *level, const struct match_band *band,
                               int y) {
    const struct match_probe *probe = probe_of(level);
    INVARIANT(y >= band->begin && y < band->end);
    struct match_probe_row row = row_of(level, band, MATCH_PROBE_PATH_COSTS, y);
    row.cost_around = level->ring[y % level->ring_rows];
    row.from_above = band->from_above[y - band->begin];
    probe->look(probe->self, &row);
}

static void look_at_winners(const struct match_level *level, const struct match_band *band,
                            const struct match_line *line, int y) {
    const struct match_probe *probe = probe_of(level);
    struct match_probe_row row = row_of(level, band, MATCH_PROBE_WINNERS, y);
    row.winner = line->row.lane;
    row.around = line->row.around;
    row.margin = line->row.margin;
    row.consistent = line->row.consistent;
    row.fits = line->row.fits;
    if (row.level == 0) {
        row.reason = image_u8_row(&level->state->output->reason, y << level->shift_y);
    }
    probe->look(probe->self, &row);
}

// Reports the results of phase 2 before phase 3 reuses their memory.
static void probed_rows(struct match_level *level, struct match_scratch *scratch, int y_begin) {
    const int beyond = y_begin + MATCH_ROWS_ABREAST;
    const int end = beyond < level->height ? beyond : level->height;
    for (int y = y_begin; y < end; y++) {
        look_at_path_costs(level, scratch->band, y);
    }
    probe_of(level)->real->rows(level, scratch, y_begin);
    for (int y = y_begin; y < end; y++) {
        look_at_winners(level, scratch->band, &scratch->line[y - y_begin], y);
    }
}

struct match_probe match_probe_of(const struct match_kernels *real, match_probe_look *look,
                                  void *self) {
    const struct match_kernels *kernels = real != NULL ? real : match_kernels_best();
    struct match_probe probe = {.kernels = *kernels, .real = kernels, .look = look, .self = self};
    probe.kernels.cost_rows = probed_cost_rows;
    probe.kernels.rows = probed_rows;
    return probe;
}

struct match_probe_window match_probe_window_at(const struct match_probe_row *row, int x) {
    INVARIANT(x >= 0 && x < row->width);
    const struct match_tile *tile = &row->tiles[x / MATCH_TILE_COLUMNS];
    const int cell = tile->offset + x % MATCH_TILE_COLUMNS * tile->lanes;
    return (struct match_probe_window){.first = tile->base,
                                       .count = tile->lanes,
                                       .cell = (size_t)cell,
                                       .doubtful = tile->doubtful,
                                       .slope_down = tile->slope_down,
                                       .slope_along = tile->slope_along};
}

// Advances a path cost to the pixel at `cell` of a plane of costs, to which the surface rises by
// `rise`, and leaves it in `path_cost`.
static void pass_on(const uint8_t *costs, size_t cell, uint8_t penalty, int rise,
                    uint8_t *path_cost, int lanes) {
    const uint8_t *const cost_at[] = {costs};
    uint8_t *const message_at[] = {path_cost};
    struct lanes cost;
    struct lanes running;
    load_lanes(cost_at, (ptrdiff_t)cell, &cost, lanes);
    load_lanes((const uint8_t *const *)message_at, 0, &running, lanes);
    const struct path_penalties penalties = {vector_all(TUNE_P1), vector_all(penalty)};
    shear(&running, rise, vector_all(UINT8_MAX), vector_all(UINT8_MAX), lanes);
    add_path_cost(&cost, penalties, &running, lanes);
    store_lanes(&running, message_at, 0, lanes);
}

void match_probe_path_costs(const struct match_probe_row *row, bool from_right, uint8_t *plane) {
    INVARIANT(row->event == MATCH_PROBE_PATH_COSTS);
    const uint8_t *step = row->owner->step_along[row->y % row->owner->ring_rows];
    uint8_t path_cost[MATCH_MAX_DISPARITIES] = {0};
    MATCH_ALIGNED uint8_t realigned[MATCH_MAX_DISPARITIES];
    const struct match_tile *from = NULL;
    for (int i = 0; i < row->width; i++) {
        const int x = from_right ? row->width - 1 - i : i;
        const struct match_tile *tile = &row->tiles[x / MATCH_TILE_COLUMNS];
        if (from != NULL && !match_same_window(from, tile)) {
            match_realign(path_cost, from, NULL, tile, realigned);
            memcpy(path_cost, realigned, (size_t)tile->lanes);
        }
        from = tile;
        const uint8_t penalty =
            i == 0 ? 0 : match_p2(step[from_right ? x + 1 : x], match_least_p2(row->owner));
        const size_t cell = match_probe_window_at(row, x).cell;
        const int rise =
            from_right ? -match_rise(tile->slope_along, x + 1) : match_rise(tile->slope_along, x);
        pass_on(row->cost_around, cell, penalty, rise, path_cost, tile->lanes);
        memcpy(plane + cell, path_cost, (size_t)tile->lanes);
    }
}
