// SPDX-License-Identifier: Apache-2.0
/// The kernels' dynamic-programming step (firmware/stereo/match/match_message.h), run along paths:
/// one object a processor level, compiled from match_paths_phase.h, for the test to compare.
#ifndef VERGENCE_TESTS_ORACLE_MATCH_PATHS_H
#define VERGENCE_TESTS_ORACLE_MATCH_PATHS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct match_paths {
    int members;  // paths side by side

    /// Messages along `members` paths of `pixels` pixels. costs[m] and messages[m] hold `lanes` (a
    /// multiple of 16) bytes a pixel, large[m] the large penalty on the way to each; the first one
    /// counts as 0.
    void (*pass)(const uint8_t *const costs[], const uint8_t *const large[], uint8_t small,
                 int pixels, int lanes, uint8_t *const messages[]);
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
