// SPDX-License-Identifier: Apache-2.0
#if defined(__x86_64__)

#include "stereo/match/match_vector_avx2.h"
// It uses the vectors included above.
#include "match_paths_phase.h"

const struct match_paths match_paths_avx2 = {VECTOR_MEMBERS, pass};

#endif
