// SPDX-License-Identifier: Apache-2.0
/// Matches on texture that repeats itself. Near a coarser surface the other periods are not
/// searched, and a coarser level may not see them either; but the left image alone tells them:
/// where it looks the same one period and two further on, so do the matches.
#ifndef VERGENCE_STEREO_MATCH_REPEATS_H
#define VERGENCE_STEREO_MATCH_REPEATS_H

#include "stereo/match/match.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Valid pixels whose surroundings repeat so that the disparity of another period lies in the range
/// asked for. The ends of the pattern may have decided which one is right, as those of a chessboard
/// do; nothing tells here whether they did.
uint32_t match_count_repeats(const struct match_input *input, const struct match_options *options,
                             const struct parallel *parallel, const struct match_output *output);

#ifdef __cplusplus
}
#endif

#endif
