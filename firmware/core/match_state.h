// SPDX-License-Identifier: Apache-2.0
/// What the parts of the matcher share during one run. Private to match*.c.
///
/// A band of MATCH_BAND_ROWS rows goes through three phases, each split over threads in a way
/// that cannot change a byte:
///   1. by rows:    features, cost, edge-aware aggregation along the row      (match_cost.c)
///   2. by columns: edge-aware aggregation down and up (with MATCH_AHEAD_ROWS rows of
///                  look-ahead), dynamic-programming message from the row above (match_column.c)
///   3. by rows:    messages from the left and the right, winner, checks       (match_row.c)
#ifndef VERGENCE_CORE_MATCH_STATE_H
#define VERGENCE_CORE_MATCH_STATE_H

#include "core/match.h"
#include "core/match_kernels.h"

enum {
    MATCH_BAND_ROWS = 16,
    MATCH_AHEAD_ROWS = 8,
    MATCH_RING_ROWS = MATCH_BAND_ROWS + MATCH_AHEAD_ROWS,
    MATCH_COLUMNS_A_PART = 32,
    MATCH_CENSUS_RADIUS = 2,
    MATCH_PENALTY_SMALL = 20,
    MATCH_MASS_ONE = 4096,  // masses of recursive averages are in 1/4096
};

/// Scratch of one thread.
struct match_scratch {
    uint8_t *window[2 * MATCH_CENSUS_RADIUS + 1];  // padded image rows
    struct match_features left, right;             // right: reversed, padded on both sides
    uint8_t *cost;                                 // width x lanes
    uint8_t *message[2];                           // previous and present, each between pads
    uint16_t *sum;                                 // width x lanes
    uint16_t *weight;                              // width + 1, between x - 1 and x
    uint16_t *mass;                                // width
    uint8_t *column;                               // running upward average of one part
    uint16_t *right_lowest;                        // width: lowest sum that claims a right pixel
    int16_t *right_index;                          // width: its disparity index
    int16_t *index;                                // width: winners of the row
};

struct match_state {
    const struct match_input *input;
    struct match_options options;
    const struct match_kernels *kernels;
    struct match_output *output;
    int width, height;
    int lanes;           // disparities padded to a multiple of MATCH_LANES
    int message_stride;  // lanes + 1: a pad between pixels stops messages from leaking
    int right_pad;       // padding in front of the reversed right features
    int right_pad_total; // padding in front and behind
    int band_begin, band_end;  // rows of the present band
    int cost_end;              // first row whose cost is not yet in the ring

    uint8_t *ring[MATCH_RING_ROWS];        // aggregated cost, row y in slot y % MATCH_RING_ROWS
    uint8_t *from_above[MATCH_BAND_ROWS + 1];  // [0]: last row of the band before
    uint8_t *above_lowest;                 // per column: lowest message of the last row
    uint8_t *down;                         // downward average
    uint16_t *down_mass;
    uint16_t weight_of_step[256];          // edge-aware weight by grey step, in 1/4096
    uint8_t large_of_step[256];            // large penalty by grey step
    int threads;
    struct match_scratch *scratch;         // one a thread
};

/// Blends weighed by masses: how much of 1/128 the first of two masses gets.
static inline int match_share(uint32_t mass_a, uint32_t mass_b) {
    return (int)((mass_a * MATCH_WEIGHT_ONE + (mass_a + mass_b) / 2) / (mass_a + mass_b));
}

/// A neighbour's mass as it arrives across an edge of `weight`, both in 1/4096.
static inline uint32_t match_carry(uint32_t mass, uint16_t weight) {
    return mass * weight / MATCH_MASS_ONE;
}

void match_cost_row(struct match_state *state, struct match_scratch *scratch, int y);
void match_columns(struct match_state *state, struct match_scratch *scratch, int x_begin,
                   int x_end);
void match_row(struct match_state *state, struct match_scratch *scratch, int y);

#endif
