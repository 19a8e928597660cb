// SPDX-License-Identifier: Apache-2.0
/// What the parts of the matcher share during one run. Private to match*.c.
///
/// A band of MATCH_BAND_ROWS rows goes through three phases, each split over threads in a way
/// that cannot change a byte:
///   1. by rows:    features, cost, edge-aware aggregation along the row      (match_cost_phase.h)
///   2. by columns: edge-aware aggregation down and up (with MATCH_AHEAD_ROWS rows of
///                  look-ahead), dynamic-programming message from the row above
///                  (match_column_phase.h)
///   3. by rows:    messages from the left and the right, winner, checks       (match_row_phase.h)
#ifndef VERGENCE_CORE_MATCH_STATE_H
#define VERGENCE_CORE_MATCH_STATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/match.h"

enum {
    MATCH_LANES = 16,      // disparities are padded to a multiple of this
    MATCH_COST_MAX = 127,  // so that cost + penalty stays below 256
    MATCH_PENALTY_MAX = 128,
    MATCH_PENALTY_SMALL = 20,  // a change by one disparity
    MATCH_WEIGHT_ONE = 128,    // shares of a blend are in 1/128, between 1 and 127
    MATCH_CENSUS_PLANES = 3,
    MATCH_CENSUS_WEIGHT = 4,
    MATCH_GRADIENT_TRUNCATION = 18,
    MATCH_LEAN = 4,  // price of a neighbouring disparity in an average along a column
    MATCH_BAND_ROWS = 8,
    MATCH_AHEAD_ROWS = 6,
    MATCH_RING_ROWS = MATCH_BAND_ROWS + MATCH_AHEAD_ROWS,
    MATCH_STRIP_COLUMNS = 16,
    MATCH_ROWS_ABREAST = 2,
    MATCH_CENSUS_RADIUS = 2,
    MATCH_MASS_ONE = 4096,  // masses of recursive averages are in 1/4096, below 10 each
    MATCH_MASS_STEP = 32,   // resolution of the table of inverse masses
    MATCH_MASS_STEPS = 2 * 10 * MATCH_MASS_ONE / MATCH_MASS_STEP,
    MATCH_INVERSE_ONE = 1 << 20,
};

/// Features of one row: 24 census bits in three byte planes, and the horizontal gradient.
struct match_features {
    uint8_t *census[MATCH_CENSUS_PLANES];
    uint8_t *gradient;  // 128 + clipped gradient
};

struct match_penalties {
    uint8_t small;  // a change by one disparity
    uint8_t large;  // any other change
};

/// The winner among the summed messages of a pixel.
struct match_winner {
    int index;        // first disparity index with the lowest sum
    uint16_t lowest;  // its sum
    uint16_t rival;   // lowest sum among indices at least 2 away; UINT16_MAX when there is none
};

/// Scratch of one row in phase 3.
struct match_line {
    uint8_t *cells;          // width x lanes: messages from the left
    uint8_t *message[2];     // from the right: present and previous pixel, lanes each
    uint16_t *sum;           // lanes: sums of one pixel
    uint16_t *right_lowest;  // width: lowest sum that claims a right pixel
    int16_t *right_index;    // width: its disparity index
    int16_t *index;          // width: winners of the row
};

/// Scratch of one thread.
struct match_scratch {
    uint8_t *window[2 * MATCH_CENSUS_RADIUS + 1];  // padded image rows
    struct match_features left, right;             // right: reversed, padded on both sides
    uint8_t *cells;                                // width x lanes: costs
    uint16_t *weight;                              // width + 1, between x - 1 and x
    uint16_t *mass;                                // width
    uint8_t *strip;                                // running averages of MATCH_STRIP_COLUMNS
    struct match_line line[MATCH_ROWS_ABREAST];
};

struct match_state {
    const struct match_input *input;
    struct match_options options;
    struct match_output *output;
    int width, height;
    int lanes;                 // disparities padded to a multiple of MATCH_LANES
    int right_pad;             // padding in front of the reversed right features
    int right_pad_total;       // padding in front and behind
    int band_begin, band_end;  // rows of the present band
    int cost_end;              // first row whose cost is not yet in the ring

    uint8_t *ring[MATCH_RING_ROWS];            // aggregated cost, row y in slot y % MATCH_RING_ROWS
    uint8_t *from_above[MATCH_BAND_ROWS + 1];  // [0]: last row of the band before
    uint8_t *above_lowest;                     // per column: lowest message of the last row
    uint8_t *down;                             // downward average
    uint16_t *down_mass;
    uint16_t weight_of_step[256];             // edge-aware weight by grey step, in 1/4096
    uint8_t large_of_step[256];               // large penalty by grey step
    uint16_t inverse_mass[MATCH_MASS_STEPS];  // MATCH_WEIGHT_ONE / mass, in 1/MATCH_INVERSE_ONE
    int threads;
    struct match_scratch *scratch;  // one a thread
};

/// Runs `call(N)` with the count of lanes as a constant where it is a common one, so that the loops
/// over lanes unroll. The functions below it are inlined into each case.
#define MATCH_WITH_CONSTANT_LANES(lanes, call) \
    do {                                       \
        switch (lanes) {                       \
            case 16:                           \
                call(16);                      \
                break;                         \
            case 32:                           \
                call(32);                      \
                break;                         \
            case 48:                           \
                call(48);                      \
                break;                         \
            case 64:                           \
                call(64);                      \
                break;                         \
            case 80:                           \
                call(80);                      \
                break;                         \
            case 96:                           \
                call(96);                      \
                break;                         \
            case 128:                          \
                call(128);                     \
                break;                         \
            default:                           \
                call(lanes);                   \
                break;                         \
        }                                      \
    } while (0)

#define MATCH_INLINE static inline __attribute__((always_inline))

/// Which share, in 1/128, the first of two masses (their sum >= MATCH_MASS_ONE) gets in a blend.
static inline int match_share(const struct match_state *state, uint32_t mass_a, uint32_t mass_b) {
    const uint32_t inverse = state->inverse_mass[(mass_a + mass_b) / MATCH_MASS_STEP];
    const int share = (int)((mass_a * inverse + MATCH_INVERSE_ONE / 2) / MATCH_INVERSE_ONE);
    return share < 1 ? 1 : (share < MATCH_WEIGHT_ONE ? share : MATCH_WEIGHT_ONE - 1);
}

/// A neighbour's mass as it arrives across an edge of `weight`, both in 1/4096.
static inline uint32_t match_carry(uint32_t mass, uint16_t weight) {
    return mass * weight / MATCH_MASS_ONE;
}

#endif
