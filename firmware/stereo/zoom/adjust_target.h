// SPDX-License-Identifier: Apache-2.0
/// A rigid thing of known shape in view, such as a board with its corners or two marks at a known
/// distance: what a pair cannot show, its size gives.
#ifndef VERGENCE_STEREO_ZOOM_ADJUST_TARGET_H
#define VERGENCE_STEREO_ZOOM_ADJUST_TARGET_H

#include <stdbool.h>

#include "stereo/zoom/adjust_prior.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A point of a target in one view.
struct target_observation {
    int view, point;
    double pixel_px[2];
};

struct adjust_target {
    int points, observations;
    const double (*point_mm)[3];  // positions in the target's own frame
    const struct target_observation *observation;
    double sigma_px;  // sigma of one coordinate of an observation
    // Pose, placed by adjust_target_place:
    double R_instrument_target[9], position_mm[3];
    double residual_px;  // rms of one coordinate, at the last fit
};

/// Places the target where the views see it, at least three of its points in both cameras of a
/// state; two points make a length. False if that fails.
bool adjust_target_place(const struct camera_view *view, struct adjust_target *target);

/// Adds what the target shows, its pose eliminated, to the normal equations of `terms` corrections.
void adjust_target_add(const struct camera_view *view, struct adjust_target *target, int terms,
                       double *H, double *g);

#ifdef __cplusplus
}
#endif

#endif
