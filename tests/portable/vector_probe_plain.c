// SPDX-License-Identifier: Apache-2.0
#include "stereo/match/match_vector_plain.h"
// The operations of the level included above.
#include "vector_probe_run.h"

const struct vector_probe vector_probe_plain = {"plain", run};
