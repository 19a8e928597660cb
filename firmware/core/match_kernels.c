// SPDX-License-Identifier: Apache-2.0
#include "core/match_kernels.h"

const struct match_kernels *match_kernels_best(void) {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) {
        return &match_avx2_kernels;
    }
#endif
    return &match_plain_kernels;
}
