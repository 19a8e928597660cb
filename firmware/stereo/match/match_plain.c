// SPDX-License-Identifier: Apache-2.0
// The definition.
#include "stereo/match/match_kernels.h"
#include "stereo/match/match_vector_plain.h"
// The phases use the vectors included above.
#include "stereo/match/match_column_phase.h"
#include "stereo/match/match_cost_phase.h"
#include "stereo/match/match_finish_phase.h"
#include "stereo/match/match_row_phase.h"

const struct match_kernels match_plain_kernels = {
    .name = "plain",
    .cost_rows = cost_rows,
    .columns = columns,
    .rows = rows,
    .finish = finish,
};
