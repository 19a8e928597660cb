// SPDX-License-Identifier: Apache-2.0
#include "match_probed.h"

#include <string.h>

#include "core/invariant.h"
#include "stereo/match/state.h"

static void probe_row(const struct match_probed *probed, struct match_level *level,
                      const struct match_tile *tiles, int y) {
    for (int x = 0; x < level->width; x++) {
        const struct match_tile *tile = &tiles[x / MATCH_TILE_COLUMNS];
        const ptrdiff_t pixel = (ptrdiff_t)y * level->width + x;
        probed->windows[pixel] =
            (struct match_window){tile->base, tile->base + tile->lanes, tile->doubtful,
                                  tile->slope_down, tile->slope_along};
        if (probed->averages != NULL) {
            memcpy(match_cell(level->ring[y % level->ring_rows], tile, x % MATCH_TILE_COLUMNS),
                   probed->averages + pixel * level->lanes + tile->base, (size_t)tile->lanes);
        }
    }
}

static void probed_cost_rows(struct match_level *level, struct match_scratch *scratch, int y_begin,
                             int rows) {
    const struct match_probed *probed = (const struct match_probed *)level->state->options.kernels;
    // Also of the other levels, and other data of a row.
    probed->real->cost_rows(level, scratch, y_begin, rows);
    if (level != &level->state->level[0]) {
        return;
    }
    INVARIANT(level->shift_x == 0 && level->shift_y == 0);
    const struct match_band *band = scratch->band;
    const bool present = y_begin < band->begin + MATCH_BAND_ROWS;
    for (int y = y_begin; y < y_begin + rows && y < level->height; y++) {
        probe_row(probed, level, present ? band->tile : band->next, y);
    }
}

struct match_probed match_probe(const struct match_kernels *real, const uint8_t *averages,
                                struct match_window *windows) {
    struct match_probed probed = {*real, real, averages, windows};
    probed.kernels.cost_rows = probed_cost_rows;
    return probed;
}
