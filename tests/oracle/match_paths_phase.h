// SPDX-License-Identifier: Apache-2.0
// The function of match_paths.h, with the vectors of the including file.
#ifndef VERGENCE_TESTS_ORACLE_MATCH_PATHS_PHASE_H
#define VERGENCE_TESTS_ORACLE_MATCH_PATHS_PHASE_H

#include "match_paths.h"
#include "stereo/match/match_path_cost.h"

MATCH_INLINE void pass_lanes(const uint8_t *const costs[], const uint8_t *const large[],
                             uint8_t small, int pixels, uint8_t *const path_costs[],
                             const int lanes) {
    struct lanes path_cost;
    for (int k = 0; k < lanes / MATCH_LANES; k++) {
        path_cost.part[k] = vector_all(0);
    }
    for (int n = 0; n < pixels; n++) {
        struct lanes cost;
        load_lanes(costs, (ptrdiff_t)n * lanes, &cost, lanes);
        const struct path_penalties penalties = {vector_all(small),
                                                 n == 0 ? vector_all(0) : vector_each(large, n)};
        add_path_cost(&cost, penalties, &path_cost, lanes);
        store_lanes(&path_cost, path_costs, (ptrdiff_t)n * lanes, lanes);
    }
}

static void pass(const uint8_t *const costs[], const uint8_t *const large[], uint8_t small,
                 int pixels, int lanes, uint8_t *const path_costs[]) {
#define PASS_LANES(constant) pass_lanes(costs, large, small, pixels, path_costs, constant)
    MATCH_WITH_CONSTANT_LANES(lanes, PASS_LANES);
#undef PASS_LANES
}

#endif
