// SPDX-License-Identifier: Apache-2.0
// The kernels in plain C, and which set is chosen.
#include "stereo/match/kernels.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "stereo/match/vector_plain.h"
// The steps use the vectors included above.
#include "stereo/match/kernels_text.h"

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
