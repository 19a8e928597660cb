// SPDX-License-Identifier: Apache-2.0
/// Where the motors must go: pan angles that turn both cameras to a point, focus for a distance.
#ifndef VERGENCE_STEREO_ZOOM_ZOOM_AIM_H
#define VERGENCE_STEREO_ZOOM_ZOOM_AIM_H

#include "stereo/zoom/zoom_calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The point of the instrument's frame that lies `distance_mm` in front of the middle between the
/// entrance pupils (at pan 0 and the smallest focal lengths) and `right_mm` to the right of it.
void zoom_point_ahead(const struct zoom_calibration *calibration, double distance_mm,
                      double right_mm, double point_mm[3]);

/// Sets the pan angles of `state` so that both optical axes pass straight above or below the point
/// (there is no tilt), or through it. ERROR_RANGE (`fault`, may be NULL, names the camera's pan) if
/// that is outside a calibrated range, or no angle does; `state` is then unchanged.
int zoom_aim(const struct zoom_calibration *calibration, const double point_mm[3],
             struct zoom_state *state, struct calibration_fault *fault);

/// The focus position at which things at a distance from the entrance pupil are sharp, which may
/// lie outside the calibrated range.
double zoom_focus_counts(const struct zoom_camera *camera, double zoom_counts, double distance_mm);

#ifdef __cplusplus
}
#endif

#endif
