// SPDX-License-Identifier: Apache-2.0
// For x86 processors with AVX2.
#if defined(__x86_64__)

#include "stereo/match/match_kernels.h"
#include "stereo/match/match_vector_avx2.h"
// The phases use the vectors included above.
#include "stereo/match/match_column_phase.h"
#include "stereo/match/match_cost_phase.h"
#include "stereo/match/match_finish_phase.h"
#include "stereo/match/match_row_phase.h"

const struct match_kernels match_avx2_kernels = {
    .name = "avx2",
    .cost_rows = cost_rows,
    .columns = columns,
    .rows = rows,
    .finish = finish,
};

#endif
