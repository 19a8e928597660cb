// SPDX-License-Identifier: Apache-2.0
/// The kernels' dynamic-programming step (firmware/stereo/match/match_path_cost.h) along paths: one
/// object per processor level, compiled from match_paths_phase.h, for comparison in the test.
#ifndef VERGENCE_TESTS_ORACLE_MATCH_PATHS_H
#define VERGENCE_TESTS_ORACLE_MATCH_PATHS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct match_paths {
    int members;  // paths in parallel

    /// Path costs along `members` paths of `pixels` pixels. costs[m] and messages[m] hold `lanes`
    /// (a multiple of 16) bytes per pixel, large[m] the large penalty on the way to each; the first
    /// one counts as 0.
    void (*pass)(const uint8_t *const costs[], const uint8_t *const large[], uint8_t small,
                 int pixels, int lanes, uint8_t *const path_costs[]);
};

extern const struct match_paths match_paths_plain;
#if defined(__x86_64__)
extern const struct match_paths match_paths_sse41;
extern const struct match_paths match_paths_avx2;
#endif

#ifdef __cplusplus
}
#endif

#endif
