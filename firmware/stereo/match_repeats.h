// SPDX-License-Identifier: Apache-2.0
/// Detects matches on repetitive texture. Near a coarser surface the other periods are not
/// searched, and a coarser level may not see them either; but the left image alone shows them:
/// where it looks the same one period away on both sides, and two, so do the matches.
#ifndef VERGENCE_STEREO_MATCH_REPEATS_H
#define VERGENCE_STEREO_MATCH_REPEATS_H

#include "core/arena.h"
#include "core/parallel.h"
#include "stereo/match/match.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Counts valid pixels on repetitive texture for which the disparity of another period lies in the
/// requested range. The ends of the pattern may have decided correctly, as those of a chessboard
/// do; this function cannot detect that. `arena` lends 2 bytes a column and thread. ERROR_MEMORY.
int match_count_repeats(const struct match_input *input, const struct match_options *options,
                        const struct parallel *parallel, struct arena *arena,
                        const struct match_output *output, uint32_t *count);

#ifdef __cplusplus
}
#endif

#endif
