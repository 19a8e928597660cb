// SPDX-License-Identifier: Apache-2.0
/// Rejection of isolated matches (speckles).
#ifndef VERGENCE_STEREO_MATCH_SPECKLE_FILTER_H
#define VERGENCE_STEREO_MATCH_SPECKLE_FILTER_H

#include "core/arena.h"
#include "core/parallel.h"
#include "stereo/match/match.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Largest step between neighbours of one island, in 1/256 px of disparity: of a surface that gains
/// one and a half a row, with noise.
enum { SPECKLE_FILTER_ISLAND_STEP_Q8 = 512 };

/// Working memory of `speckle_filter_run_all` in bytes for an image of that width.
size_t speckle_filter_need_bytes(int width, int speckle_px, int threads);

/// Marks every valid pixel of an island (4-connected, neighbours within
/// SPECKLE_FILTER_ISLAND_STEP_Q8) of fewer than `speckle_px` pixels with REASON_SPECKLE. Each pixel
/// is visited a constant number of times. Rows are distributed over threads; the result does not
/// depend on that. ERROR_MEMORY; nothing is changed then.
int speckle_filter_run_all(int speckle_px, const struct parallel *parallel, struct arena *arena,
                           struct match_output *output);

#ifdef __cplusplus
}
#endif

#endif
