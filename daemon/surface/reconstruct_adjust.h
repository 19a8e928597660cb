// SPDX-License-Identifier: Apache-2.0
/// The calibration of a captured pair from the calibration of all zooms, corrected by what the
/// pair's own pictures show.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_ADJUST_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_ADJUST_H

#include "daemon/base/message.h"
#include "daemon/session/last_pair.h"
#include "daemon/surface/result/reconstruct_context.h"
#include "stereo/zoom/adjust_pair.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What is known of the scene of the first pair.
struct reconstruct_adjust_scene {
    double near_mm;  // nearest depth; 0: not known. Corners count at all depths beyond it
    /// A thing of known size, as its left (view 0) and right camera (1) see it; NULL: none.
    const struct adjust_target *target;
};

/// Refines the first of `count` pairs, taken in these states; the second, if there is one, is of
/// the same scene at another zoom, with pan untouched. Returns 0 with the calibration of the frames
/// as they are and the reports in `context`, or an error with `message` set.
int reconstruct_adjust(const struct zoom_calibration *zoom, const struct pair *const *pairs,
                       const struct zoom_state *states, int count,
                       const struct reconstruct_adjust_scene *scene,
                       struct calibration *calibration, struct reconstruct_context *context,
                       struct message *message);

/// Warns of what the pictures did not show, if it matters.
void reconstruct_adjust_doubt(struct reconstruct_context *context);

#ifdef __cplusplus
}
#endif

#endif
