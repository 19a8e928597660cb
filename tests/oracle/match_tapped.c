// SPDX-License-Identifier: Apache-2.0
#include "match_tapped.h"

#include <string.h>

#include "core/invariant.h"
#include "stereo/match/match_state.h"

static void tap_row(const struct match_tapped *tapped, struct match_level *level,
                    const struct match_tile *tiles, int y) {
    for (int x = 0; x < level->width; x++) {
        const struct match_tile *tile = &tiles[x / MATCH_TILE_COLUMNS];
        const ptrdiff_t pixel = (ptrdiff_t)y * level->width + x;
        tapped->windows[pixel] =
            (struct match_window){tile->base, tile->base + tile->lanes, tile->doubtful};
        if (tapped->averages != NULL) {
            memcpy(match_cell(level->ring[y % level->ring_rows], tile, x % MATCH_TILE_COLUMNS),
                   tapped->averages + pixel * level->lanes + tile->base, (size_t)tile->lanes);
        }
    }
}

static void tapped_cost_rows(struct match_level *level, struct match_scratch *scratch, int y_begin,
                             int rows) {
    const struct match_tapped *tapped = (const struct match_tapped *)level->state->options.kernels;
    // Also of the other levels, and other data of a row.
    tapped->real->cost_rows(level, scratch, y_begin, rows);
    if (level != &level->state->level[0]) {
        return;
    }
    INVARIANT(level->shift_x == 0 && level->shift_y == 0);
    const struct match_band *band = scratch->band;
    const bool present = y_begin < band->begin + MATCH_BAND_ROWS;
    for (int y = y_begin; y < y_begin + rows && y < level->height; y++) {
        tap_row(tapped, level, present ? band->tile : band->next, y);
    }
}

struct match_tapped match_tap(const struct match_kernels *real, const uint8_t *averages,
                              struct match_window *windows) {
    struct match_tapped tapped = {*real, real, averages, windows};
    tapped.kernels.cost_rows = tapped_cost_rows;
    return tapped;
}
