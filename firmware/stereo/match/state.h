// SPDX-License-Identifier: Apache-2.0
/// What the steps of the matcher share during one run, and what pyramid.c and schedule.c offer each
/// other. Private to this folder.
///
/// The pair is matched on one or more levels: level 0 is the full size, each further one about half
/// the size of the one before. Every level processes its rows in bands of MATCH_BAND_ROWS, divided
/// into tiles of MATCH_TILE_COLUMNS columns; each tile searches its own window of disparities (all
/// of them on the coarsest level, those near the coarser level's surface on the others).
#ifndef VERGENCE_STEREO_MATCH_STATE_H
#define VERGENCE_STEREO_MATCH_STATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "stereo/match/checks.h"
#include "stereo/match/match.h"
#include "stereo/match/tuning.h"

// Number of rows shared by the bands in progress, for this many threads, and of the band below.
#define MATCH_RING_ROWS(threads) (((threads) + 1) * MATCH_BAND_ROWS)
// Number of rows of a surface, for a batch of this level and one of the next finer level.
#define MATCH_SURFACE_ROWS(bands) (2 * (bands)*MATCH_BAND_ROWS + 16)

enum {
    MATCH_LANES = 16,        // disparities are padded to a multiple of this
    MATCH_COST_MAX = 120,    // keeps a path cost below 256
    MATCH_WEIGHT_ONE = 128,  // shares of a blend are in 1/128, between 1 and 127
    MATCH_CENSUS_PLANES = 3,
    MATCH_CENSUS_RADIUS = 2,
    MATCH_TILE_COLUMNS = 16,
    MATCH_BAND_ROWS = 8,
    MATCH_MAX_THREADS = 8,
    MATCH_MAX_RING_ROWS = MATCH_RING_ROWS(MATCH_MAX_THREADS),
    MATCH_MAX_BATCH = 16,  // bands between two points where all threads wait for each other
    MATCH_MAX_SURFACE_ROWS = MATCH_SURFACE_ROWS(MATCH_MAX_BATCH),
    // A surface between levels holds disparities in 1/MATCH_SURFACE_ONE; MATCH_DOUBTFUL is added to
    // one with such a rival.
    MATCH_SURFACE_ONE = 16,
    MATCH_DOUBTFUL = 1 << 14,
    // Slopes of a surface are in 1/MATCH_SLOPE_ONE disparities a row or a column, at most 2.
    MATCH_SLOPE_ONE = 256,
    MATCH_RISE_MAX = 2,
    MATCH_SLOPE_MAX = MATCH_RISE_MAX * MATCH_SLOPE_ONE,
    MATCH_ROWS_ABREAST = 4,  // rows per call of a kernel
    // Rows that the features of that many rows need, and one more on each side to smooth them.
    MATCH_SOURCE_ROWS = MATCH_ROWS_ABREAST + 2 * MATCH_CENSUS_RADIUS + 2,
    MATCH_SMOOTHING_ONE = 16,
    MATCH_BOX_MORE = 12,
    MATCH_MAX_LEVELS = 7,
    MATCH_SHIFT_MAX = 8,    // largest shift of a level's columns or rows: see match_set_levels
    MATCH_MASS_ONE = 512,   // masses of recursive averages are in 1/512, below 10 each
    MATCH_SHEAR_MAX = 15,   // columns by which a support may be sheared
    MATCH_SOURCE_PAD = 32,  // columns before and after a row that is compared: a tile's and those
    MATCH_CENSUS_SIDE = 2 * MATCH_CENSUS_RADIUS + 1,
#if defined(__bfin__)
    MATCH_HAS_CELLS = 1,  // the kernels are those of stereo/bfin/cells.h
#else
    MATCH_HAS_CELLS = 0,
#endif
};

/// Weights of the first and the second of two values in a blend: low and high byte, together
/// MATCH_WEIGHT_ONE. Of the Blackfin's cells, a `cells_share`.
typedef uint16_t match_share;

/// The window of disparities that a tile searches, and the position of its cells in a row of cells:
/// column x of the tile at offset + (x - first column) * lanes. Averages and path costs follow the
/// slopes of its surface.
struct match_tile {
    int32_t offset;  // bytes
    int16_t base;    // index of the first lane: disparity - disparity_min of the level
    int16_t lanes;   // a multiple of MATCH_LANES
    bool doubtful;   // the coarser level saw other good matches
    int16_t slope_down, slope_along;  // unit: 1/MATCH_SLOPE_ONE; 0: unknown, or nearly level
};

/// Features of one row: 24 census bits in three byte planes, and the horizontal gradient.
struct match_features {
    uint8_t *census[MATCH_CENSUS_PLANES];
    uint8_t *gradient;  // 128 + clipped gradient
};

/// One row during phases 1 and 3. Phase 1 ends with its part before phase 3 begins, so both share
/// the memory.
struct match_line {
    struct {
        struct match_features left, right;  // right: reversed, padded on both sides
        uint32_t *right_census;             // instead of its planes: MATCH_HAS_CELLS
        uint16_t *weight;                   // weight of the edge between x - 1 and x, by column
        match_share *forward;  // share of the average from the left when the pixel's cost is added
        match_share *joined;   // share of the average from the left when the right one joins
        // Share of the average from the right when the pixel's cost is added.
        match_share *backward;
    } cost;
    struct {
        uint8_t *penalty;     // large penalty between x - 1 and x
        uint8_t *margin;      // margin of the winner over its best rival
        int16_t *lane;        // the winner, first in its window, then in the level's range; -1:
                              // there is no winner
        uint32_t *around;     // averaged costs before, at and after the winner, in the lower bytes
        uint8_t *fit;         // averaged cost of the winner
        uint8_t *consistent;  // whether left and right agree
        uint8_t *contrast;    // contrast of the TUNE_CONTRAST_COLUMNS pixels around
        uint8_t *fits;        // whether the winner may be right
        uint8_t *darkest, *brightest;  // extremes of TUNE_CONTRAST_COLUMNS pixels from x on
        uint32_t *claim;               // lowest cost that claims a right pixel, and its lane
    } row;
};

/// Working memory of one thread.
struct match_scratch {
    uint8_t *source[MATCH_SOURCE_ROWS];  // padded image rows
    struct match_band *band;             // the band in progress
    uint16_t *box;  // sums while a row, and MATCH_BOX_MORE pixels, is scaled down or smoothed
    struct match_line line[MATCH_ROWS_ABREAST];
    uint8_t *running;  // averages or messages of MATCH_TILE_COLUMNS columns, all lanes
    int32_t *finish;   // a row of disparities at the end
};

/// A band in progress.
struct match_band {
    int begin, end;            // rows
    int cost_begin, cost_end;  // rows whose costs its thread computes: those of the next band
    struct match_tile *before, *tile, *next;  // windows of the band above, of it, of the one below
    uint8_t *last_above;                      // path costs of the last row of the band above
    uint8_t *from_above[MATCH_BAND_ROWS];
    uint8_t *last_sum;            // sums of path costs of the last row
    uint8_t *down_before, *down;  // downward average before the band and after it
};

/// Rows of a pair at one scale.
struct match_level {
    struct match_state *state;
    struct match_level *coarser;  // NULL: everything is searched
    int shift_x, shift_y;         // 2^shift_x columns and 2^shift_y rows of the input make a pixel
    int width, height;
    int tiles;  // a row
    int disparity_min, disparity_count;
    struct match_accepted_range accepted;
    int right_pad;     // padding in front of the reversed right features
    int right_length;  // length of the padded right features
    int lanes;         // most lanes of a tile
    size_t row_bytes;  // size of one row of cells
    int rows_done;

    int batch;                                     // bands of a batch, at most
    struct match_tile *tile[MATCH_MAX_BATCH + 2];  // windows of the bands, one above, one below
    // Path costs of band n % threads. All but the last two rows are the levels' in turn, as are
    // those of `ring` but the ones of the band in progress, `kept`.
    uint8_t *cells[MATCH_MAX_THREADS][MATCH_BAND_ROWS + 1];
    uint8_t *kept[MATCH_BAND_ROWS];
    int down_rows;
    uint8_t *down[MATCH_MAX_THREADS + 1];  // downward averages between the bands
    // Shared by the bands in progress. Row y is in slot y % ring_rows and so on.
    int ring_rows, surface_rows;
    struct image_u8 picture[2];  // of a coarser level: rings of rows of both images, scaled down
    int picture_rows;            // of these rings
    uint8_t *ring[MATCH_MAX_RING_ROWS];   // aggregated cost
    uint16_t *down_mass;                  // masses of the downward averages, by column
    uint8_t *guide[MATCH_MAX_RING_ROWS];  // left rows, where the finest level's are scaled down
    // Steps of the left image: from the pixel before in the row, and from the row above. 0 at the
    // ends of the image, and in columns beyond it.
    uint8_t *step_along[MATCH_MAX_RING_ROWS], *step_down[MATCH_MAX_RING_ROWS];
    // Weights of the steps from the row above: see match_weight.
    uint16_t *weight_down[MATCH_MAX_RING_ROWS];
    // Disparities above disparity_min in 1/MATCH_SURFACE_ONE, counted from half a disparity below
    // it; -1: no disparity.
    int16_t *surface[MATCH_MAX_SURFACE_ROWS];
};

struct match_state {
    const struct match_input *input;
    struct match_options options;
    struct match_output *output;
    const struct match_method *method;
    const struct parallel *parallel;
    struct match_level level[MATCH_MAX_LEVELS];
    int levels;
    struct match_look look;  // its smoothing is that of levels at full size
    int threads;
    int ahead_rows;  // of the images, which the coarser levels' pictures show
    int kept_rows;   // rows of the images that the finest level needs in memory
    uint8_t *shared_cells[MATCH_MAX_THREADS][MATCH_BAND_ROWS - 1];
    uint8_t *shared_ring[MATCH_MAX_RING_ROWS - MATCH_BAND_ROWS];
    bool dry;                       // only asks for rows, in the order of a run
    struct match_scratch *scratch;  // one per thread
};

static inline uint8_t match_step(uint8_t a, uint8_t b) {
    return a > b ? (uint8_t)(a - b) : (uint8_t)(b - a);
}

/// Lanes that a surface of this slope rises from row or column n - 1 to n.
static inline int match_rise(int slope, int n) {
    const int positive = slope + MATCH_SLOPE_MAX;  // rounds down, as shifts do
    const int before = positive * n;
    return (before + positive) / MATCH_SLOPE_ONE - before / MATCH_SLOPE_ONE - MATCH_RISE_MAX;
}

/// The cells of column `column` of a tile in a row of cells.
static inline uint8_t *match_cell(uint8_t *row, const struct match_tile *tile, int column) {
    return row + tile->offset + (ptrdiff_t)column * tile->lanes;
}

/// Whether the rows of a level are smoothed before they are compared; means of several pixels have
/// less noise.
static inline bool match_is_smoothed(const struct match_level *level) {
    return level->state->look.smoothing > 0 && level->shift_x == 0 && level->shift_y == 0;
}

/// Whether the steps of the finest level come from the left image in colour, and its census
/// compares channels of both images in colour.
static inline bool match_is_coloured(const struct match_state *state) {
    return state->look.coloured[0];
}
static inline bool match_compares_colour(const struct match_state *state) {
    return state->look.coloured[0] && state->look.coloured[1];
}

/// Left row y of a level, for its texture; rows above and below the image repeat its ends.
static inline const uint8_t *match_guide(const struct match_level *level, int y) {
    const int row = y < 0 ? 0 : (y < level->height ? y : level->height - 1);
    if (level->shift_x == 0 && level->shift_y == 0) {
        return image_u8_row(&level->state->input->left, row);
    }
    return level->guide[row % level->ring_rows];
}

/// Valid pixels of row y of a level: all input pixels below them are valid.
static inline struct rectify_span match_span(const struct match_level *level,
                                             const struct image_u8 *image,
                                             const struct rectify_span *spans, int y) {
    const struct rectify_span whole = {0, (int16_t)level->width};
    if (spans == NULL) {
        return whole;
    }
    int begin = 0;
    int end = image->width;
    for (int row = y << level->shift_y; row < (y + 1) << level->shift_y; row++) {
        begin = spans[row].begin > begin ? spans[row].begin : begin;
        end = spans[row].end < end ? spans[row].end : end;
    }
    begin = (begin + (1 << level->shift_x) - 1) >> level->shift_x;
    end >>= level->shift_x;
    end = end < level->width ? end : level->width;
    return (struct rectify_span){(int16_t)begin, (int16_t)(begin < end ? end : begin)};
}

/// Columns of tile t; the last one may be narrower.
static inline int match_tile_columns(const struct match_level *level, int t) {
    const int rest = level->width - t * MATCH_TILE_COLUMNS;
    return rest < MATCH_TILE_COLUMNS ? rest : MATCH_TILE_COLUMNS;
}

/// Whether a level is the one whose disparities are the result.
static inline bool match_is_finest(const struct match_level *level) {
    return level == &level->state->level[0];
}

/// Whether a level searches all its disparities everywhere. Those of a quarter of the width and
/// less do: they take little time, and what they do not find the finest one does not search.
static inline bool match_searches_everything(const struct match_level *level) {
    return level->coarser == NULL || level->shift_x >= TUNE_SEARCH_ALL_SHIFT;
}

/// Whether a level searches the requested range everywhere, independent of the coarser one.
bool match_searches_whole_range(const struct match_level *level);

/// Number of lanes a column that a level searches, roughly.
int match_mean_lanes(const struct match_level *level);

/// Sets the geometry of all levels for a full-size image, from state->options and state->method.
void match_set_levels(struct match_state *state, int width, int height);

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

/// Allocates the memory of all levels and threads.
void match_take_memory(struct match_state *state, struct match_memory *memory);

/// Rows of the images that the coarser levels take at a time: whole rows of the coarsest one.
static inline int match_ahead_step(const struct match_state *state) {
    return 1 << state->level[state->levels - 1].shift_y;
}

/// Sets how many rows of pictures the levels need in memory, from their geometry.
void match_plan_rows(struct match_state *state);

/// Matches and checks: the order of all steps. state->look is set, and
/// the memory is taken from `arena`. ERROR_MEMORY, ERROR_CANCELLED.
int match_run_steps(struct match_state *state, match_progress *progress, void *progress_self,
                    struct arena *arena);

#endif
