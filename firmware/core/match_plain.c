// SPDX-License-Identifier: Apache-2.0
#include "core/match_bodies.h"

const struct match_kernels match_plain_kernels = {
    .name = "plain",
    .cost = cost_body,
    .blend = blend_body,
    .message = message_body,
    .add = add_body,
    .winner = winner_body,
};
