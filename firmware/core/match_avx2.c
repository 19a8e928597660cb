// SPDX-License-Identifier: Apache-2.0
#if defined(__x86_64__)
#include "core/match_bodies.h"

const struct match_kernels match_avx2_kernels = {
    .name = "avx2",
    .cost = cost_body,
    .blend = blend_body,
    .message = message_body,
    .add = add_body,
    .winner = winner_body,
};
#endif
