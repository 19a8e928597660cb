// SPDX-License-Identifier: Apache-2.0
#if defined(__x86_64__)

#include "stereo/match/match_vector_sse41.h"
// It uses the vectors included above.
#include "match_paths_phase.h"

const struct match_paths match_paths_sse41 = {VECTOR_MEMBERS, pass};

#endif
