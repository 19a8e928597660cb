// SPDX-License-Identifier: Apache-2.0
// For ARM processors with NEON: all 64-bit ones, and 32-bit ones if compiled for them.
#if defined(__ARM_NEON)

#include "stereo/match/match_kernels.h"
#include "stereo/match/match_vector_neon.h"
// The phases use the vectors included above.
#include "stereo/match/match_column_phase.h"
#include "stereo/match/match_cost_phase.h"
#include "stereo/match/match_finish_phase.h"
#include "stereo/match/match_row_phase.h"

const struct match_kernels match_neon_kernels = {
    .name = "neon",
    .cost_rows = cost_rows,
    .columns = columns,
    .rows = rows,
    .finish = finish,
};

#endif
