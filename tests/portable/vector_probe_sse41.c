// SPDX-License-Identifier: Apache-2.0
#if defined(__x86_64__)

#include "stereo/match/match_vector_sse41.h"
// The operations of the level included above.
#include "vector_probe_run.h"

const struct vector_probe vector_probe_sse41 = {"sse41", run};

#endif
