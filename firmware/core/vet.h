// SPDX-License-Identifier: Apache-2.0
/// Rejection of matches by what their neighbours say.
#ifndef VERGENCE_CORE_VET_H
#define VERGENCE_CORE_VET_H

#include "core/arena.h"
#include "core/match.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Largest step between neighbours of one island, in 1/256 px of disparity.
enum { VET_ISLAND_STEP_Q8 = 256 };

/// Working memory of `vet_speckles` in bytes: depends on the area limit only.
size_t vet_need_bytes(int speckle_px);

/// Gives every valid pixel of an island (4-connected, neighbours within VET_ISLAND_STEP_Q8) of
/// fewer than `speckle_px` pixels REASON_SPECKLE. Each pixel is visited a constant number of times.
/// ERROR_MEMORY; nothing is changed then.
int vet_speckles(int speckle_px, struct arena *arena, struct match_output *output);

#ifdef __cplusplus
}
#endif

#endif
