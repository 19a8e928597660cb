// SPDX-License-Identifier: Apache-2.0
#if defined(__x86_64__)

#include "stereo/match/match_vector_avx2.h"
// The operations of the level included above.
#include "vector_probe_run.h"

const struct vector_probe vector_probe_avx2 = {"avx2", run};

#endif
