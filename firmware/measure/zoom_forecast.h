// SPDX-License-Identifier: Apache-2.0
/// What a pair at a state would be good for, before it is taken.
#ifndef VERGENCE_MEASURE_ZOOM_FORECAST_H
#define VERGENCE_MEASURE_ZOOM_FORECAST_H

#include "focus/depth_iris.h"
#include "measure/zoom_field.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What limits it.
enum zoom_forecast_limit {
    ZOOM_FORECAST_PIXELS,  ///< the error of a point: a longer focal length would help
    ZOOM_FORECAST_COMMON,  ///< what all depths share: a pair at another zoom, a board or a length
    ZOOM_FORECAST_DEPTH,   ///< the depth that is sharp is less than that asked for
};

struct zoom_forecast {
    struct zoom_field field;
    double factor;           ///< focal length over the smallest, of the left camera
    bool has_iris;           ///< `iris` is known: the f-numbers are
    struct depth_iris iris;  ///< for the depths; focused on their middle
    double point_mm;         ///< expected error of a point on texture, along the axis
    double common_mm;        ///< of all depths together, before pairs adjust the cameras
    enum zoom_forecast_limit limit;
};

/// The forecast for a point in `frames` (as zoom_field_at) at a state that zoom_for_wish has set,
/// with depths `near_mm` to `far_mm` to be sharp (0 0: the point's alone). `limits` NULL: the iris
/// has no motor or its f-numbers are not known. ERROR_RANGE: as zoom_field_at, or near is not
/// beyond two focal lengths.
int zoom_forecast_at(const struct zoom_calibration *calibration, const struct zoom_frames *frames,
                     const struct zoom_state *state, const double point_mm[3], double near_mm,
                     double far_mm, const struct depth_iris_limits *limits,
                     struct zoom_forecast *forecast);

#ifdef __cplusplus
}
#endif

#endif
