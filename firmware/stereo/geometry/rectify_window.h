// SPDX-License-Identifier: Apache-2.0
/// The parts of a rectified plane that two cameras see. Positions on it are "slopes", x/z and y/z
/// of the rect frame; the parallax of a point is baseline / depth, also a slope.
#ifndef VERGENCE_STEREO_GEOMETRY_RECTIFY_WINDOW_H
#define VERGENCE_STEREO_GEOMETRY_RECTIFY_WINDOW_H

#include <stdbool.h>

#include "stereo/geometry/lens.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RECTIFY_OUTLINE_POINTS = 192 };

/// Smallest and largest rect z / camera z over a camera's view.
struct rectify_depth_ratio {
    double min, max;
};

/// The view of one camera: a closed polygon.
struct rectify_outline {
    double slope[RECTIFY_OUTLINE_POINTS][2];
    struct rectify_depth_ratio depth_ratio;
};

/// Bounding boxes of the shared view, in each camera's slopes.
struct rectify_window {
    double left_low, left_high;
    double right_low, right_high;
    double top, bottom;
};

/// Traces the border of the view of a valid lens, for a lens that is not Brown-Conrady of its part
/// within 55 degrees of the rectified plane's axis, along x and along y. ERROR_OVERLAP if part of
/// it looks away from the plane.
int rectify_window_trace(const struct lens *lens, const double R_rect_camera[9],
                         struct rectify_outline *outline);

/// The shared view over all parallaxes in [far, near], 0 <= far < near: a point at left slope x has
/// right slope x - parallax. Returns false (window undefined) if it is empty.
bool rectify_window_find(const struct rectify_outline *left, const struct rectify_outline *right,
                         double parallax_far, double parallax_near, struct rectify_window *window);

#ifdef __cplusplus
}
#endif

#endif
