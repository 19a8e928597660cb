// SPDX-License-Identifier: Apache-2.0
#include "stereo/match/match_vector_plain.h"
// It uses the vectors included above.
#include "match_paths_phase.h"

const struct match_paths match_paths_plain = {VECTOR_MEMBERS, pass};
