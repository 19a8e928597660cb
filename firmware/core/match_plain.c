// SPDX-License-Identifier: Apache-2.0
// The definition.
#include "core/match_kernels.h"
#include "core/match_lanes_plain.h"
// The phases use the lanes_* operations included above.
#include "core/match_column_phase.h"
#include "core/match_cost_phase.h"
#include "core/match_row_phase.h"

const struct match_kernels match_plain_kernels = {
    .name = "plain",
    .cost_row = cost_row,
    .columns = columns,
    .rows = rows,
};
