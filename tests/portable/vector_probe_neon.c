// SPDX-License-Identifier: Apache-2.0
#if defined(__ARM_NEON)

#include "stereo/match/match_vector_neon.h"
// The operations of the level included above.
#include "vector_probe_run.h"

const struct vector_probe vector_probe_neon = {"neon", run};

#endif
