// SPDX-License-Identifier: Apache-2.0
/// Every tuned number of the matcher, a line each: unit, meaning. No other file of this folder has
/// one; what remains elsewhere are sizes, formats and bounds of numbers. The slow reference
/// (tests/oracle/match_reference*.cpp) reads the same table. `tools/bench tuning` measures what
/// each does, a quarter lower and higher; with --write the differences follow here, after a bar: of
/// bad-1.0, of what is kept and wrong and of what is right of textured, lower and then higher.
#ifndef VERGENCE_STEREO_MATCH_TUNING_H
#define VERGENCE_STEREO_MATCH_TUNING_H

#include <stdbool.h>
#include <stdint.h>

#include "stereo/image/reason.h"

// clang-format off
enum {
    // Smoothing of noisy pairs (noise.c): sums of |second derivative| of a block of 8x8, noise of one grey level has 233.
    TUNE_NOISE_WEAK = 160,          // sum: from here on weak smoothing
    TUNE_NOISE_STRONG = 560,        // sum: from here on strong smoothing
    TUNE_NOISE_FLOOR_SHARE = 50,    // 1/n of the blocks: the smoothest ones show noise alone
    TUNE_FINE_TEXTURE = 6,          // times the noise: half of the blocks have more: no smoothing
    TUNE_COARSE_SHARE = 15,         // 1/64: half of the blocks have less of their slopes over 8 px in those over 2: coarse texture
    TUNE_COARSE_SIGNAL = 5,         // times the noise: blocks with less say nothing about coarseness
    TUNE_SMOOTHING_WEAK = 2,        // 1/16: weight of each neighbour
    TUNE_SMOOTHING_COARSE = 4,      // 1/16: where noise is weak and texture coarse
    TUNE_SMOOTHING_STRONG = 5,      // 1/16
    // Features (features.h) and cost (cost.h).
    TUNE_COLOUR_STEP = 5,           // 1/8: of the largest step of a channel, to be comparable with grey
    TUNE_SUPPORT_NARROWED = 128,    // 1/256 columns: least width on the left of a column on the right, of a steep surface
    TUNE_CENSUS_WEIGHT = 4,         // cost: of a differing bit of 24
    TUNE_GRADIENT_MAX = 12,         // cost: of the difference of gradients, at most
    // Aggregation (aggregation.h).
    TUNE_EDGE_STEP = 112,           // grey levels: steps as large stop an average
    TUNE_EDGE_WEIGHT = 58982,       // 1/65536: of a neighbour without a step
    TUNE_DOWN_LESS = 16,            // 1/n less weight downwards, where all rows count and not only those ahead
    TUNE_AHEAD_ROWS = 6,            // rows below the band that averages look at
    TUNE_LEAN_ALONG = 8,            // cost: of a neighbouring disparity in an average along the row
    TUNE_LEAN_DOWN = 4,             // cost: the same along the column
    // Path costs (path_cost.h).
    TUNE_P1 = 20,                   // cost: of a change by one disparity
    TUNE_P2 = 135,                  // cost: of any other change
    TUNE_P2_SLOPE = 6,              // cost: less for each grey level of a step
    TUNE_P2_MIN = 30,               // cost: at least, on the finest level
    TUNE_P2_MIN_COARSER = 45,       // cost: at least, on coarser levels; less loses steep surfaces
    // Levels and windows (pyramid.c).
    TUNE_SEARCH_ALL_SHIFT = 2,      // halvings: a level of 1/2^n of the width or less searches everything
    TUNE_WINDOW_MEAN = 2,           // times the mean window of a preset: for no more there is memory
    TUNE_WINDOW_MEMORY = 3,         // 1/8: of the disparities of all columns, for which there is memory
    // Slopes (pyramid.c): 1/256 disparities a pixel.
    TUNE_SLOPE_AROUND = 4,          // coarser pixels around a tile that its slope is taken from
    TUNE_SLOPE_STEP = 4,            // coarser pixels that a difference spans
    TUNE_SLOPE_TOLERANCE = 14,      // 1/16 disparity: differences as near their median are of one surface
    TUNE_SLOPE_SHARE_DOWN = 75,     // percent of the differences must be of one surface, down
    TUNE_SLOPE_SHARE_ALONG = 88,    // percent: along
    TUNE_SLOPE_STEEP = 96,          // slope: from here on SLOPE_SHARE_HALF is enough
    TUNE_SLOPE_SHARE_HALF = 60,     // percent: of the differences over half as many pixels, of a steep slope
    TUNE_SLOPE_PIXELS = 8,          // differences: fewer say nothing
    TUNE_SLOPE_KNOWN = 15,          // percent: of all differences must be known
    TUNE_SLOPE_REACH = 6,           // tiles: a tile without texture takes the slope of others as near
    TUNE_SLOPE_GAP = 40,            // slope: if those on both sides differ by less
    TUNE_SLOPE_MIN = 36,            // slope: flatter surfaces are left to leaning averages
    // Acceptance: the limits of match_rules below.
    TUNE_LEFT_RIGHT = 1,            // lanes: of a winner from the one that its right pixel is assigned to
    TUNE_COST_MAX = 41,             // cost: of a winner
    TUNE_CONTRAST_MIN = 6,          // grey levels: of a winner that has a rival; with less it has no texture | +0.00 +0.01 +0.11, -0.00 -0.01 -0.17
    TUNE_MARGIN_MIN = 23,           // cost: lead over the best rival, where contrast is faint
    TUNE_TEXTURE_MIN = 8,           // of 49 blocks: with texture | -0.00 +0.10 +0.18, +0.00 -0.08 -0.25
    TUNE_SHARE_MIN = 217,           // 1/255: accepted pixels around a block, without texture next to it | -0.00 +0.98 +0.51, +0.34 -0.39 -3.67
    TUNE_SHARE_EDGE = 204,          // 1/255: accepted pixels of a block with slopes along the row, or around it, the same
    TUNE_SHARE_COARSE = 204,        // 1/255: accepted pixels around a block where the texture of the pair is coarse | +0.00 +0.24 +0.10, +0.00 -0.07 -1.40
    TUNE_PLAIN_MAX_PX = 0,          // px: from an occluded one towards an outline, without texture in between
    TUNE_ISLAND_PX = 60,            // pixels: of one surface (default of match_options) | -0.03 +0.02 +0.00, -0.00 -0.02 +0.00
    // What is measured: cost and margin (validation.h).
    TUNE_COST_SMOOTHED = 2,         // cost: more of smoothed images, which are more alike
    TUNE_SHARE_ANY_COST = 150,      // 1/255: accepted pixels around a block, the winners of which may have any cost | +0.00 +0.02 +0.14, +0.00 -0.01 -1.55
    TUNE_MARGIN_LEAST = 13,         // cost: the lead where contrast is high
    TUNE_CONTRAST_FAINT = 16,       // grey levels up to which the whole margin is required | -0.00 +0.02 +0.03, +0.00 -0.01 -0.03
    TUNE_CONTRAST_COLUMNS = 16,     // columns of which contrast is measured; a power of two
    // What is measured: texture and shares of blocks of 8x8 pixels (validation.c).
    TUNE_PAIR_NOISE_SHARE = 10,     // 1/n of the blocks: the smoothest differences between the images show noise alone | -0.00 -0.05 -0.08, -0.00 +0.03 +0.16
    TUNE_DEPTH_EDGE_PX = 8,         // px over four columns: a larger one is a depth edge, whose slopes do not count | +0.01 -0.00 +0.00, +0.00 -0.01 -0.01
    TUNE_DEPTH_EDGE_COLUMNS = 3,    // columns to each side of a depth edge without texture | -0.00 +0.07 +0.03, +0.00 -0.04 -0.18
    TUNE_SIGNAL = 2,                // times the energy of noise: slopes along the row | +0.00 +0.15 +0.45, -0.00 -0.09 -0.45
    TUNE_UPRIGHT = 10,              // 1/n of the energy of slopes along the column, at least, for texture along the row | +0.01 -0.08 -0.36, -0.01 +0.07 +0.26
    TUNE_STRONG_SIGNAL = 128,       // times the energy of noise: strong slopes | +0.00 +0.05 +0.00, +0.00 -0.02 -0.00
    TUNE_TEXTURED_NEAR = 4,         // of 9 blocks: texture next to a block | -0.00 +0.30 +0.19, +0.01 -0.10 -0.35
    TUNE_STRONG_COARSE = 3,         // of 25 blocks: with as many strong slopes coarse texture needs no share | +0.00 +0.06 +0.00, +0.00 -0.04 -0.00
    // What is measured: pixels beside an outline, which an object hides (validation.c).
    TUNE_HIDDEN_BEFORE = 4,         // of the 16 pixels before are occluded | -0.00 -0.01 -0.00, +0.00 +0.01 +0.00
    TUNE_HIDDEN_MAX_PX = 24,        // px: up to the outline | +0.00 +0.00 +0.00, +0.00 -0.00 +0.00
    TUNE_PLAIN_BEFORE_PX = 8,       // px: plain before | +0.00 -0.00 +0.00, -0.00 +0.00 +0.00
    TUNE_PLAIN_SLOPE = 32,          // times the energy of noise: plain pixels have less | -0.00 +0.00 +0.00, -0.00 -0.00 +0.00
    TUNE_OUTLINE_SLOPE = 1000,      // times the energy of noise: an outline has more | +0.00 -0.00 +0.00, +0.00 +0.00 +0.00
    TUNE_OUTLINE_PX = 5,            // px: an outline reaches that within | +0.00 +0.00 +0.00, +0.00 +0.00 +0.00
    // Islands (speckle.c) and rows between (validation.h).
    TUNE_ISLAND_STEP = 512,         // 1/256 px: neighbours of one island differ by less | -0.00 -0.01 -0.00, -0.00 +0.00 +0.00
    TUNE_ROW_STEP = 256,            // 1/256 px: rows between those of the preset fast are interpolated up to this step
    // Time, not results (schedule.c, match.c).
    TUNE_TILES_BETWEEN = 4,         // tiles that the band above is ahead, so that no thread reads what another writes
    TUNE_BANDS_EACH = 4,            // bands of a thread between two points where all wait, at most
    TUNE_PAPER_LANES = 240,         // disparities that take as long as a pixel of the preset paper
    // Repetitive texture (repeats.c).
    TUNE_REPEAT_WINDOW_PX = 24,     // px compared, at least
    TUNE_REPEAT_WINDOW = 3,         // 1/2 of a period compared
    TUNE_REPEAT_LAG_PX = 3,         // px: shortest period; closer rivals are in every search
    TUNE_REPEAT_FALL = 2,           // times less different than what lies between
    TUNE_REPEAT_DIFFERENT = 1,      // grey levels between the two, at least
    // Preset paper (paper.c): sums of differing bits of 30 over 8 pixels; a quarter changes its own
    // mean error by at most 1.1 points (fewer jumps), mostly by less than 0.3.
    TUNE_PAPER_MISFIT = 10,         // bits of 30: 98 % of the correct matches have less
    TUNE_PAPER_AHEAD_PX = 8,        // px of the sums
    TUNE_PAPER_SLANT = 1,           // bits a pixel: penalty of a slant
    TUNE_PAPER_OTHER_PATH = 1,      // bits a pixel: penalty of the other walk's path
    TUNE_PAPER_JUMP = 4,            // bits a pixel: penalty of a jump
    TUNE_PAPER_ON_SURFACE = 6,      // bits a pixel: above, slants are tried
    TUNE_PAPER_JUMP_MAX_PX = 32,    // px: longest jump
    TUNE_PAPER_AGREE_PX = 1,        // px: two walks agree
    TUNE_PAPER_AROUND_PX = 4,       // px to each side of the checks' sums
    TUNE_PAPER_MARGIN = 1,          // bits: mean rise two disparities away from a match
};
// clang-format on

/// What the rules of acceptance measure: of a winner, of a block of pixels, of a run of pixels, and
/// of an island, in this order.
enum match_measure {
    MATCH_LEFT_RIGHT,
    MATCH_COST,      // where the share of accepted pixels is high it counts as 0
    MATCH_CONTRAST,  // only if the cost or the margin fails: for the reason
    MATCH_MARGIN,
    MATCH_TEXTURE,
    MATCH_SHARE,         // with texture next to the block, or slopes along the row, the highest
    MATCH_SHARE_EDGE,    // of the block itself or around; without such slopes, the highest
    MATCH_SHARE_COARSE,  // where the pair's texture is fine or slopes are strong, the same
    MATCH_PLAIN,
    MATCH_ISLAND,
    MATCH_RULES
};

/// A pixel whose measure is on the wrong side of the limit is rejected for the reason.
struct match_rule {
    const char *name;
    enum match_measure measured;
    bool at_most;  // the limit is an upper one
    int limit;
    uint8_t reason;
};

/// A rule for each measure.
static const struct match_rule match_rules[MATCH_RULES] = {
    {"left and right agree", MATCH_LEFT_RIGHT, true, TUNE_LEFT_RIGHT, REASON_OCCLUDED},
    {"cost", MATCH_COST, true, TUNE_COST_MAX, REASON_OUT_OF_RANGE},
    {"contrast", MATCH_CONTRAST, false, TUNE_CONTRAST_MIN, REASON_NO_TEXTURE},
    {"margin", MATCH_MARGIN, false, TUNE_MARGIN_MIN, REASON_AMBIGUOUS},
    {"texture", MATCH_TEXTURE, false, TUNE_TEXTURE_MIN, REASON_NO_TEXTURE},
    {"share", MATCH_SHARE, false, TUNE_SHARE_MIN, REASON_NO_TEXTURE},
    {"share of edges along the rows", MATCH_SHARE_EDGE, false, TUNE_SHARE_EDGE, REASON_NO_TEXTURE},
    {"share of coarse texture", MATCH_SHARE_COARSE, false, TUNE_SHARE_COARSE, REASON_AMBIGUOUS},
    {"hidden", MATCH_PLAIN, true, TUNE_PLAIN_MAX_PX, REASON_OCCLUDED},
    {"island", MATCH_ISLAND, false, TUNE_ISLAND_PX, REASON_SPECKLE},
};

/// Whether a value of what is measured is on the right side of the limit.
static inline bool match_accepts(enum match_measure measured, int value) {
    const struct match_rule *rule = &match_rules[measured];
    return rule->at_most ? value <= rule->limit : value >= rule->limit;
}

/// The numbers of a preset.
struct match_method {
    const char *name;
    int coarse_disparities;  // a level with more disparities than this gets a coarser one; 0: never
    int halvings;     // halvings of columns and disparities from the finest level to the next
    int halved_rows;  // 1 where a row of the finest level covers two rows of the input
    int lanes;        // average per column, for which there is memory
    // A tile searches the disparities that the coarser level found in the tile and this many of its
    // pixels around, and `margin` more on both sides.
    int around_columns, around_rows, margin;
    // The whole requested range is searched everywhere; near a coarser surface only beyond it.
    bool whole_range;
};

/// In the order of enum match_preset.
static const struct match_method match_methods[] = {
    {"fast", 16, 2, 1, 48, 3, 2, 6, false}, {"standard", 16, 2, 0, 48, 3, 2, 6, false},
    {"best", 16, 2, 0, 0, 3, 2, 6, true},   {"board", 16, 1, 0, 32, 4, 2, 3, false},
    {"paper", 0, 0, 0, 0, 0, 0, 0, false},
};

/// A channel of an image, and the means of all three.
enum match_channel { MATCH_RED, MATCH_GREEN, MATCH_BLUE, MATCH_GREY, MATCH_CHANNELS };

/// A bit of the census: whether a pixel of the 5x5 window is brighter than another one in a
/// channel. In a pair without colour all channels are grey.
struct match_comparison {
    uint8_t channel;  // enum match_channel
    uint8_t row, column, other_row, other_column;
};

// The census of the finest level; bit i % 8 of plane i / 8 is comparison i.
// clang-format off
static const struct match_comparison match_finest_census[24] = {
    // Neighbours with the centre; those above and below count twice.
    {MATCH_GREY, 2, 1, 2, 2}, {MATCH_GREY, 2, 3, 2, 2},
    {MATCH_GREY, 1, 2, 2, 2}, {MATCH_GREY, 3, 2, 2, 2},
    {MATCH_GREY, 1, 2, 2, 2}, {MATCH_GREY, 3, 2, 2, 2},
    {MATCH_GREY, 1, 1, 2, 2}, {MATCH_GREY, 1, 3, 2, 2},
    {MATCH_GREY, 3, 1, 2, 2}, {MATCH_GREY, 3, 3, 2, 2},
    // Opposite pixels.
    {MATCH_GREY, 1, 1, 3, 3}, {MATCH_GREY, 1, 3, 3, 1},
    {MATCH_GREY, 1, 2, 3, 2}, {MATCH_GREY, 2, 0, 2, 4},
    {MATCH_GREY, 0, 1, 4, 1}, {MATCH_GREY, 0, 3, 4, 3},
    // In red and blue; one counts twice.
    {MATCH_RED, 1, 2, 2, 2}, {MATCH_RED, 3, 2, 2, 2},
    {MATCH_RED, 1, 2, 3, 2}, {MATCH_RED, 1, 2, 3, 2},
    {MATCH_RED, 2, 0, 2, 4},
    {MATCH_BLUE, 2, 1, 2, 2}, {MATCH_BLUE, 2, 3, 2, 2},
    {MATCH_BLUE, 2, 1, 2, 3},
};

// Of noisy pairs, where smoothing is more than weak. Pixels farther apart: less detail, but more contrast.
static const struct match_comparison match_smoothed_census[24] = {
    // Neighbours with the centre; those above and below count twice.
    {MATCH_GREY, 2, 1, 2, 2}, {MATCH_GREY, 2, 3, 2, 2},
    {MATCH_GREY, 1, 2, 2, 2}, {MATCH_GREY, 3, 2, 2, 2},
    {MATCH_GREY, 1, 2, 2, 2}, {MATCH_GREY, 3, 2, 2, 2},
    {MATCH_GREY, 1, 1, 2, 2}, {MATCH_GREY, 1, 3, 2, 2},
    {MATCH_GREY, 3, 1, 2, 2}, {MATCH_GREY, 3, 3, 2, 2},
    // Opposite pixels.
    {MATCH_GREY, 1, 1, 3, 3}, {MATCH_GREY, 1, 3, 3, 1},
    {MATCH_GREY, 1, 0, 3, 4}, {MATCH_GREY, 1, 4, 3, 0},
    {MATCH_GREY, 0, 0, 4, 4}, {MATCH_GREY, 0, 4, 4, 0},
    {MATCH_RED, 2, 1, 2, 2}, {MATCH_RED, 2, 3, 2, 2},
    {MATCH_RED, 1, 2, 2, 2}, {MATCH_RED, 3, 2, 2, 2},
    {MATCH_RED, 2, 0, 2, 4}, {MATCH_RED, 0, 2, 4, 2},
    {MATCH_BLUE, 2, 1, 2, 3}, {MATCH_BLUE, 1, 2, 3, 2},
};

// Of coarser levels: all neighbours with the centre.
static const struct match_comparison match_coarser_census[24] = {
    {MATCH_GREY, 0, 0, 2, 2}, {MATCH_GREY, 0, 1, 2, 2}, {MATCH_GREY, 0, 2, 2, 2},
    {MATCH_GREY, 0, 3, 2, 2}, {MATCH_GREY, 0, 4, 2, 2}, {MATCH_GREY, 1, 0, 2, 2},
    {MATCH_GREY, 1, 1, 2, 2}, {MATCH_GREY, 1, 2, 2, 2}, {MATCH_GREY, 1, 3, 2, 2},
    {MATCH_GREY, 1, 4, 2, 2}, {MATCH_GREY, 2, 0, 2, 2}, {MATCH_GREY, 2, 1, 2, 2},
    {MATCH_GREY, 2, 3, 2, 2}, {MATCH_GREY, 2, 4, 2, 2}, {MATCH_GREY, 3, 0, 2, 2},
    {MATCH_GREY, 3, 1, 2, 2}, {MATCH_GREY, 3, 2, 2, 2}, {MATCH_GREY, 3, 3, 2, 2},
    {MATCH_GREY, 3, 4, 2, 2}, {MATCH_GREY, 4, 0, 2, 2}, {MATCH_GREY, 4, 1, 2, 2},
    {MATCH_GREY, 4, 2, 2, 2}, {MATCH_GREY, 4, 3, 2, 2}, {MATCH_GREY, 4, 4, 2, 2},
};
// clang-format on

#endif
