// SPDX-License-Identifier: Apache-2.0
/// State shared by the parts of the matcher during one run. Private to match*.c.
///
/// The pair is matched on one or more levels: level 0 is the full size, each further one half the
/// size of the one before. Every level processes its rows in bands of MATCH_BAND_ROWS, divided into
/// tiles of MATCH_TILE_COLUMNS columns; each tile searches its own window of disparities (all of
/// them on the coarsest level, those near the coarser level's surface on the others). A band goes
/// through three phases:
///   1. by rows:  features, cost, edge-aware average along the row            (match_cost_phase.h)
///   2. by tiles: edge-aware average down and up (with MATCH_AHEAD_ROWS rows of look-ahead),
///                dynamic-programming path cost from the row above          (match_column_phase.h)
///   3. by rows:  path costs from the left and the right, winner, checks       (match_row_phase.h)
/// Each thread processes one band at a time, so that nearly all of a band's cells stay in one
/// processor's cache; in phase 2 a tile waits for those above it. All threads wait for each other
/// before and after a batch of bands.
#ifndef VERGENCE_STEREO_MATCH_MATCH_STATE_H
#define VERGENCE_STEREO_MATCH_MATCH_STATE_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "stereo/match/match.h"
#include "stereo/match/match_validity.h"

// Number of rows shared by the bands in progress, for this many threads.
#define MATCH_RING_ROWS(threads) ((threads)*MATCH_BAND_ROWS + MATCH_AHEAD_ROWS)
// Number of rows of a surface, for a batch of this level and one of the next finer level.
#define MATCH_SURFACE_ROWS(bands) (2 * (bands)*MATCH_BAND_ROWS + 16)

enum {
    MATCH_LANES = 16,        // disparities are padded to a multiple of this
    MATCH_P1 = 20,           // of a change by one disparity
    MATCH_COST_MAX = 120,    // so that a path cost stays below 256
    MATCH_WEIGHT_ONE = 128,  // shares of a blend are in 1/128, between 1 and 127
    MATCH_CENSUS_PLANES = 3,
    MATCH_CENSUS_BITS = 8 * MATCH_CENSUS_PLANES,
    MATCH_CENSUS_WEIGHT = 4,
    MATCH_CENSUS_RADIUS = 2,
    MATCH_GRADIENT_TRUNCATION = 12,
    // Prices of a neighbouring disparity in an average along a column and along a row.
    MATCH_LEAN_DOWN = 4,
    MATCH_LEAN_ALONG = 8,
    MATCH_TILE_COLUMNS = 16,
    MATCH_BAND_ROWS = 8,
    MATCH_AHEAD_ROWS = 6,
    MATCH_MAX_THREADS = 8,
    MATCH_MAX_RING_ROWS = MATCH_RING_ROWS(MATCH_MAX_THREADS),
    MATCH_MAX_BATCH = 16,  // bands between two points where all threads wait for each other
    MATCH_MAX_SURFACE_ROWS = MATCH_SURFACE_ROWS(MATCH_MAX_BATCH),
    // A winner with a smaller margin is ambiguous, where contrast is faint and where it is high.
    MATCH_MARGIN_MIN = 23,
    MATCH_LEAST_MARGIN = 15,
    // A surface between levels holds disparities in 1/MATCH_SURFACE_ONE; MATCH_DOUBTFUL is added to
    // one with such a rival.
    MATCH_SURFACE_ONE = 16,
    MATCH_DOUBTFUL = 1 << 14,
    // Slopes of a surface are in 1/MATCH_SLOPE_ONE disparities a row or a column, at most 2.
    MATCH_SLOPE_ONE = 256,
    MATCH_RISE_MAX = 2,
    MATCH_SLOPE_MAX = MATCH_RISE_MAX * MATCH_SLOPE_ONE,
    MATCH_TEXTURE_COLUMNS = 16,
    MATCH_ROWS_ABREAST = 4,  // maximum rows per call of a kernel
    // Rows that the features of that many rows need, and one more on each side to smooth them.
    MATCH_SOURCE_ROWS = MATCH_ROWS_ABREAST + 2 * MATCH_CENSUS_RADIUS + 2,
    MATCH_SMOOTHING_ONE = 16,
    MATCH_PAIR_ROWS = 2,  // minimum rows per call of a kernel
    MATCH_MAX_LEVELS = 7,
    MATCH_SHIFT_MAX = 8,   // of a level's columns and rows: see match_set_levels
    MATCH_MASS_ONE = 512,  // masses of recursive averages are in 1/512, below 10 each
};

/// Weights of the first and the second of two values in a blend: low and high byte, together
/// MATCH_WEIGHT_ONE.
typedef uint16_t match_share;

/// The window of disparities that a tile searches, and the position of its cells in a row of cells:
/// column x of the tile at offset + (x - first column) * lanes. Averages and path costs follow the
/// slopes of its surface.
struct match_tile {
    int32_t offset;  // bytes
    int16_t base;    // index of the first lane: disparity - disparity_min of the level
    int16_t lanes;   // a multiple of MATCH_LANES
    bool doubtful;   // the coarser level saw other good matches
    int16_t slope_down, slope_along;  // in 1/MATCH_SLOPE_ONE; 0: unknown, or nearly level
};

/// What an image is compared in. The first three are those of an image in colour, in their order.
enum match_channel { MATCH_RED, MATCH_GREEN, MATCH_BLUE, MATCH_GREY, MATCH_CHANNELS };

/// A bit of the census: whether a pixel of the 5x5 window is brighter than another one in a
/// channel. In a pair without colour all channels are grey.
struct match_comparison {
    uint8_t channel;  // enum match_channel
    uint8_t row, column, other_row, other_column;
};

/// Bit i % 8 of plane i / 8 is comparison i: of the finest level, of that level where smoothing is
/// more than weak, and of the other levels.
extern const struct match_comparison match_finest_census[MATCH_CENSUS_BITS];
extern const struct match_comparison match_smoothed_census[MATCH_CENSUS_BITS];
extern const struct match_comparison match_coarser_census[MATCH_CENSUS_BITS];

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
        uint16_t *weight;                   // by column: of the edge between x - 1 and x
        match_share *forward;   // of the average from the left, where the pixel's own cost is added
        match_share *joined;    // of that average, where it meets what comes from the right
        match_share *backward;  // of the average from the right, where the pixel's own cost is
                                // added
    } cost;
    struct {
        uint8_t *penalty;     // large penalty between x - 1 and x
        uint8_t *margin;      // margin of the winner over its best rival
        int16_t *lane;        // the winner, first in its window, then in the level's range; -1:
                              // there is no winner
        uint32_t *around;     // averaged costs before, at and after the winner, in the lower bytes
        uint8_t *fit;         // averaged cost of the winner
        uint8_t *consistent;  // whether left and right agree
        uint8_t *contrast;    // of MATCH_TEXTURE_COLUMNS pixels around
        uint8_t *fits;        // whether the winner may be right
        uint8_t *darkest, *brightest;  // of MATCH_TEXTURE_COLUMNS pixels from x on
        uint32_t *claim;               // lowest cost that claims a right pixel, and its lane
    } row;
};

/// Working memory of one thread.
struct match_scratch {
    uint8_t *source[MATCH_SOURCE_ROWS];  // padded image rows
    struct match_band *band;             // in progress
    uint16_t *box;  // sums while a row, and two pixels more, is scaled down or smoothed
    struct match_line line[MATCH_ROWS_ABREAST];
    uint8_t *running;  // averages or messages of MATCH_TILE_COLUMNS columns, all lanes
    int32_t *finish;   // a row of disparities at the end
};

/// A band in progress.
struct match_band {
    int begin, end;            // rows
    int cost_begin, cost_end;  // rows whose costs its thread computes: some belong to the next band
    struct match_tile *before, *tile, *next;  // windows of the band above, of it, of the one below
    uint8_t *last_above;                      // path costs of the last row of the band above
    uint8_t *from_above[MATCH_BAND_ROWS];
    uint8_t *last_sum;            // sums of path costs of the last row
    uint8_t *down_before, *down;  // downward average before the band and after it
};

/// Parameters of a preset.
struct match_method {
    const char *name;
    int coarse_disparities;  // a level with more disparities than this gets a coarser one; 0: never
    int halvings;            // of columns and disparities from the finest level to the next
    int halved_rows;         // of the finest level: 1 where a row of it covers two
    int lanes;               // average per column, for which there is memory
    // A tile searches the disparities that the coarser level found in the tile and this many of its
    // pixels around, and `margin` more on both sides.
    int around_columns, around_rows, margin;
    // The whole requested range is searched everywhere; near a coarser surface only beyond it.
    bool whole_range;
};

/// Rows of a pair at one scale.
struct match_level {
    struct match_state *state;
    struct match_level *coarser;  // NULL: everything is searched
    int shift_x, shift_y;         // 2^shift_x columns and 2^shift_y rows of the input make a pixel
    int width, height;
    int tiles;  // a row
    int disparity_min, disparity_count;
    struct match_believed believed;
    int right_pad;     // padding in front of the reversed right features
    int right_length;  // of the padded features
    int lanes;         // most lanes of a tile
    size_t row_bytes;  // of one row of cells
    int rows_done;

    int batch;                                     // bands of a batch, at most
    struct match_tile *tile[MATCH_MAX_BATCH + 2];  // windows of the bands, one above, one below
    uint8_t *cells[MATCH_MAX_THREADS][MATCH_BAND_ROWS + 1];  // band n uses n % threads
    int down_rows;
    uint8_t *down[MATCH_MAX_THREADS + 1];  // downward averages between the bands
    // Shared by the bands in progress. Row y is in slot y % ring_rows and so on.
    int ring_rows, surface_rows;
    uint8_t *ring[MATCH_MAX_RING_ROWS];   // aggregated cost
    uint16_t *down_mass;                  // by column
    uint8_t *guide[MATCH_MAX_RING_ROWS];  // left rows, where the finest level's are scaled down
    // Steps of the left image: from the pixel before in the row, and from the row above. 0 at the
    // ends of the image, and in columns beyond it.
    uint8_t *step_along[MATCH_MAX_RING_ROWS], *step_down[MATCH_MAX_RING_ROWS];
    uint16_t *weight_down[MATCH_MAX_RING_ROWS];  // of those from the row above: see match_weight
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
    int smoothing;         // see match_smoothing; of levels at full size
    bool coloured;         // steps of the finest level come from the left image in colour
    bool compares_colour;  // the census compares channels of both images in colour
    int threads;
    struct match_scratch *scratch;  // one per thread
};

/// Runs `call(N, false)` with the number of lanes as a constant for common values, so that the
/// loops over lanes are unrolled; or `call(N, true)` in a tile that follows a `slope`, where
/// vectors of several members make up for the larger code, and else `call(lanes, true)`. The
/// functions below are inlined into each case.
#define MATCH_WITH_CONSTANT_LANES(lanes, slope, call)                             \
    do {                                                                          \
        if (VECTOR_MEMBERS > 1 && (slope) != 0 && (lanes) == 16) {                \
            call(16, true);                                                       \
            break;                                                                \
        }                                                                         \
        if (VECTOR_MEMBERS > 1 && (slope) != 0 && (lanes) == 32) {                \
            call(32, true);                                                       \
            break;                                                                \
        }                                                                         \
        switch ((slope) == 0 && (lanes) <= VECTOR_LANES_UNROLLED ? (lanes) : 0) { \
            case 16:                                                              \
                call(16, false);                                                  \
                break;                                                            \
            case 32:                                                              \
                call(32, false);                                                  \
                break;                                                            \
            case 48:                                                              \
                call(48, false);                                                  \
                break;                                                            \
            case 64:                                                              \
                call(64, false);                                                  \
                break;                                                            \
            default:                                                              \
                call(lanes, (slope) != 0);                                        \
                break;                                                            \
        }                                                                         \
    } while (0)

#define MATCH_INLINE static inline __attribute__((always_inline))

/// A pair of shares from the first one, between 1 and 127.
static inline match_share match_share_of(uint16_t share) {
    return (match_share)((MATCH_WEIGHT_ONE << 8) - UINT8_MAX * share);
}

/// The weights of two masses, of which at least one is not 0, in a blend: 128 a / (a + b), rounded
/// down. Without branches, so that compilers can vectorize it: in binary places and 16 bits, or by
/// a processor that divides vectors. There 24 bits are exact: a quotient that is not whole is a
/// 10,240th or more below the next whole number, and the float nearest to it is too.
static inline match_share match_share_between(uint16_t mass_a, uint16_t mass_b) {
#if defined(__SSE4_1__)
    const float quotient = (float)(mass_a * MATCH_WEIGHT_ONE) / (float)(mass_a + mass_b);
    uint16_t share = (uint16_t)(int32_t)quotient;
    share = share < MATCH_WEIGHT_ONE ? share : MATCH_WEIGHT_ONE - 1;
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

/// The two weights swapped.
static inline match_share match_share_swapped(match_share share) {
    return (match_share)(share >> 8 | share << 8);
}

/// Weight of a neighbour across a step of grey levels, in 1/65536: 0.9 (1 - step / 112)^8, which is
/// close to 0.9 exp(-step / 14).
static inline uint16_t match_weight(uint8_t step) {
    const uint16_t capped = step < 112 ? step : 112;
    const uint16_t base = (uint16_t)(65520 - 585 * capped);
    const uint16_t square = (uint16_t)((uint32_t)base * base >> 16);
    const uint16_t fourth = (uint16_t)((uint32_t)square * square >> 16);
    const uint16_t eighth = (uint16_t)((uint32_t)fourth * fourth >> 16);
    return (uint16_t)((uint32_t)eighth * 58982 >> 16);
}

/// Weight of the average from above across an edge of `weight`. It reaches further than the rows of
/// look-ahead below, and would lag behind a slanted surface: a sixteenth less.
static inline uint16_t match_weight_down(uint16_t weight) {
    return (uint16_t)(weight - weight / 16);
}

/// A neighbour's mass as it arrives across an edge of `weight`.
static inline uint16_t match_carry(uint16_t mass, uint16_t weight) {
    return (uint16_t)((uint32_t)mass * weight >> 16);
}

/// Penalty of a jump across a step of grey levels: an edge makes it plausible. The lowest is
/// `least`.
static inline uint8_t match_p2(uint8_t step, uint8_t least) {
    enum { LARGE_MAX = 135, LARGE_SLOPE = 6, STEPS = LARGE_MAX / LARGE_SLOPE };
    const uint8_t lowered = (uint8_t)(LARGE_MAX - LARGE_SLOPE * (step < STEPS ? step : STEPS));
    return lowered > least ? lowered : least;
}

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
    return level->state->smoothing > 0 && level->shift_x == 0 && level->shift_y == 0;
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

#endif
