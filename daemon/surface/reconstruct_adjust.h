// SPDX-License-Identifier: Apache-2.0
/// The calibration of a captured pair from the calibration of all zooms, corrected by what the
/// pair's own pictures show.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_ADJUST_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_ADJUST_H

#include "console/pair/pair_adjust.h"
#include "daemon/surface/result/reconstruct_context.h"

#ifdef __cplusplus
extern "C" {
#endif

/// As pair_adjust, with the reports in `context`.
int reconstruct_adjust(const struct zoom_calibration *zoom, const struct pair *const *pairs,
                       const struct zoom_state *states, int count,
                       const struct pair_adjust_scene *scene, struct calibration *calibration,
                       struct reconstruct_context *context, struct message *message);

/// Warns of what the pictures did not show, if it matters.
void reconstruct_adjust_doubt(struct reconstruct_context *context);

#ifdef __cplusplus
}
#endif

#endif
