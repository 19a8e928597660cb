// SPDX-License-Identifier: Apache-2.0
/// Inner loops of the matcher over disparities. One set of plain C bodies (match_bodies.h) is
/// compiled once a processor level; every set gives the same bytes.
/// All `count` arguments are multiples of MATCH_LANES; pointers need no alignment.
/// Costs and messages are 8 bit: cost <= MATCH_COST_MAX, penalties <= MATCH_PENALTY_MAX.
#ifndef VERGENCE_CORE_MATCH_KERNELS_H
#define VERGENCE_CORE_MATCH_KERNELS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
    MATCH_LANES = 16,        // disparities are padded to this
    MATCH_COST_MAX = 127,    // so that cost + penalty stays below 256
    MATCH_PENALTY_MAX = 128,
    MATCH_WEIGHT_ONE = 128,  // weights are in 1/128
    MATCH_CENSUS_PLANES = 3,
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

/// The winner among the summed costs of a pixel.
struct match_winner {
    int index;         // first disparity index with the lowest sum
    uint16_t lowest;   // its sum
    uint16_t rival;    // lowest sum among indices at least 2 away; UINT16_MAX when there is none
};

struct match_kernels {
    const char *name;

    /// cost[i] of left pixel x against right features at right_index + i.
    void (*cost)(const struct match_features *left, int x, const struct match_features *right,
                 int right_index, int count, uint8_t *cost);

    /// result = (a wa + b (128 - wa) + 64) / 128. `result` may be `a` or `b`.
    void (*blend)(const uint8_t *a, const uint8_t *b, int wa, int count, uint8_t *result);

    /// message[i] = cost[i] + min(p[i], p[i-1] + small, p[i+1] + small, large) with
    /// p = previous - lowest(previous). previous[-1] and previous[count] are readable and count as
    /// infinite. Returns the lowest message. Source: H. Hirschmueller, "Stereo processing
    /// by semiglobal matching and mutual information", PAMI 30(2), 2008, equation 13.
    int (*message)(const uint8_t *cost, const uint8_t *previous, int lowest,
                   struct match_penalties penalties, int count, uint8_t *message);

    /// sum[i] = a[i] + b[i]
    void (*add)(const uint8_t *a, const uint8_t *b, int count, uint16_t *sum);

    /// Adds `last` to sum and finds the winner among indices [begin, end).
    struct match_winner (*winner)(uint16_t *sum, const uint8_t *last, int count, int begin,
                                  int end);
};

extern const struct match_kernels match_plain_kernels;
#if defined(__x86_64__)
extern const struct match_kernels match_avx2_kernels;
#endif

/// The fastest set that this processor runs.
const struct match_kernels *match_kernels_best(void);

#ifdef __cplusplus
}
#endif

#endif
