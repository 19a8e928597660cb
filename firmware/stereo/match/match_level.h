// SPDX-License-Identifier: Apache-2.0
/// One level of the matcher: memory, bands, and the coarser levels that supply rows and choose the
/// disparities that each tile of a band searches (match_window.c). Private to match*.c.
#ifndef VERGENCE_STEREO_MATCH_MATCH_LEVEL_H
#define VERGENCE_STEREO_MATCH_MATCH_LEVEL_H

#include "stereo/match/match_state.h"

enum {
    MATCH_SOURCE_PAD = 16,  // columns before and after a row that is compared
    MATCH_CENSUS_SIDE = 2 * MATCH_CENSUS_RADIUS + 1,
};

/// Counts memory, and allocates it if there is an arena.
struct match_memory {
    struct arena *arena;  // NULL: only count
    size_t need_bytes;
    bool failed;
};

/// Sets the geometry of all levels for a full-size image, from state->options and state->method.
void match_set_levels(struct match_state *state, int width, int height);

/// Allocates the memory of all levels and threads.
void match_take_memory(struct match_state *state, struct match_memory *memory);

/// Prepares the first band.
void match_begin_levels(struct match_state *state);

/// Runs bands of a level, and of coarser ones as needed, until at least `rows` rows are done.
void match_advance(struct match_level *level, int rows);

/// At the end: smooths the output and fills the rows that the finest level covers.
void match_finish(struct match_state *state);

/// Whether a level is the one whose disparities are the result.
static inline bool match_is_finest(const struct match_level *level) {
    return level == &level->state->level[0];
}

/// The least penalty of a jump: see match_p2. Lower ones lose steep surfaces on coarser levels.
static inline uint8_t match_least_p2(const struct match_level *level) {
    return match_is_finest(level) ? 30 : 45;
}

/// Whether a level searches all its disparities everywhere. Those of a quarter of the width and
/// less do: they take little time, and what they do not find the finest one does not search.
static inline bool match_searches_everything(const struct match_level *level) {
    return level->coarser == NULL || level->shift_x >= 2;
}

/// Whether a level searches the requested range everywhere, independent of the coarser one.
bool match_searches_whole_range(const struct match_level *level);

/// Number of lanes a column that a level searches, roughly.
int match_mean_lanes(const struct match_level *level);

/// Number of rows of the coarser level that `match_plan_windows` reads for a band: those below this
/// one.
int match_window_rows(const struct match_level *level, int band_begin);

/// Chooses the windows of the band that begins at row `band_begin` of a level, into `tiles`: all
/// disparities, or those near the coarser surface around the tile. `above`: the windows of the band
/// before. Overwrites `scratch` of one thread.
void match_plan_windows(const struct match_level *level, int band_begin,
                        const struct match_scratch *scratch, const struct match_tile *above,
                        struct match_tile *tiles);

/// Chooses the slopes of the same tiles: those of the coarser level's surface there.
void match_plan_slopes(const struct match_level *level, int band_begin, struct match_tile *tiles);

/// Pixels of a channel around those of a tile, by row, column and pixel.
typedef uint8_t match_support[MATCH_CENSUS_SIDE][MATCH_CENSUS_SIDE][MATCH_TILE_COLUMNS];

/// The support of `columns` left pixels of a tile from x_begin on, in the middle one of five padded
/// rows, sheared like the tile's surface: the left pixels that show what the right image shows in a
/// square around the matching pixel.
void match_shear_support(uint8_t *const source[], const struct match_tile *tile, int x_begin,
                         int columns, match_support support);

#endif
