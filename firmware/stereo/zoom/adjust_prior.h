// SPDX-License-Identifier: Apache-2.0
/// What is known of the views of a rig before any picture.
#ifndef VERGENCE_STEREO_ZOOM_ADJUST_PRIOR_H
#define VERGENCE_STEREO_ZOOM_ADJUST_PRIOR_H

#include "core/arena.h"
#include "stereo/zoom/camera_view.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    ADJUST_STATES_MAX = 2,
    ADJUST_VIEWS_MAX = 2 * ADJUST_STATES_MAX,
    ADJUST_TERMS_MAX = ADJUST_VIEWS_MAX * VIEW_TERMS,
    ADJUST_SEEN_MAX = ADJUST_VIEWS_MAX,
};

/// View of a side (0 left, 1 right) at a state.
static inline int adjust_view(int state, int side) {
    return 2 * state + side;
}

/// Adds the covariance of the corrections of `states` <= ADJUST_STATES_MAX states to `covariance`
/// (terms x terms, zero at first). ERROR_MEMORY.
int adjust_prior_covariance(const struct zoom_calibration *calibration,
                            const struct zoom_state *state, int states, struct arena *arena,
                            double *covariance);
size_t adjust_prior_need_bytes(int states);

#ifdef __cplusplus
}
#endif

#endif
