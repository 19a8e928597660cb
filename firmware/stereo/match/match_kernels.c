// SPDX-License-Identifier: Apache-2.0
#include "stereo/match/match_kernels.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "stereo/match/match_state.h"

// Chosen as described in match.md.
// clang-format off
const struct match_comparison match_finest_census[MATCH_CENSUS_BITS] = {
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

// Of noisy pairs. Pixels farther apart: less detail, but more contrast.
const struct match_comparison match_smoothed_census[MATCH_CENSUS_BITS] = {
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

// All neighbours with the centre.
const struct match_comparison match_coarser_census[MATCH_CENSUS_BITS] = {
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

#if defined(__x86_64__)
static bool runs_sse41(void) {
    return __builtin_cpu_supports("sse4.1");
}
static bool runs_avx2(void) {
    return __builtin_cpu_supports("avx2");
}
#endif
static bool runs_always(void) {
    return true;
}

// Fastest first.
static const struct {
    const struct match_kernels *kernels;
    bool (*runs)(void);
} levels[] = {
#if defined(__x86_64__)
    {&match_avx2_kernels, runs_avx2},
    {&match_sse41_kernels, runs_sse41},
#endif
#if defined(__ARM_NEON)
    {&match_neon_kernels, runs_always},
#endif
    {&match_plain_kernels, runs_always},
};

const struct match_kernels *match_kernels_best(void) {
    size_t i = 0;
    while (!levels[i].runs()) {
        i++;
    }
    return levels[i].kernels;
}

const struct match_kernels *match_kernels_named(const char *name) {
    for (size_t i = 0; i < sizeof levels / sizeof *levels; i++) {
        if (strcmp(levels[i].kernels->name, name) == 0 && levels[i].runs()) {
            return levels[i].kernels;
        }
    }
    return NULL;
}
