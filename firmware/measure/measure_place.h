// SPDX-License-Identifier: Apache-2.0
/// A place that a measurement looks at, stated by a pixel of a camera.
#ifndef VERGENCE_MEASURE_MEASURE_PLACE_H
#define VERGENCE_MEASURE_MEASURE_PLACE_H

#include <stdbool.h>

#include "measure/measure_subject.h"
#include "stereo/zoom/zoom_calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A line of sight in the instrument's frame, which stays where it is when the cameras move.
struct measure_place {
    double origin_mm[3], direction[3];
};

/// The line of sight of a pixel (of the whole sensor) of camera `side` at a state. False: the lens
/// has none for it.
bool measure_place_of(const struct zoom_calibration *calibration, const struct zoom_state *state,
                      int side, const double pixel_px[2], struct measure_place *place);

/// The same line in the left camera's frame at a state. False: it does not lead away from that
/// camera, or too far to a side.
bool measure_place_ray(const struct measure_place *place,
                       const struct zoom_calibration *calibration, const struct zoom_state *state,
                       struct measure_ray *ray);

#ifdef __cplusplus
}
#endif

#endif
