// SPDX-License-Identifier: Apache-2.0
/// One camera at one state of its motors: lens and pose, and small corrections of both.
#ifndef VERGENCE_STEREO_ZOOM_CAMERA_VIEW_H
#define VERGENCE_STEREO_ZOOM_CAMERA_VIEW_H

#include <stdbool.h>

#include "stereo/zoom/zoom_calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What a correction changes. A change of the focal length does not change the distortion in px.
enum camera_view_term {
    VIEW_FOCAL,     // logarithm of the focal length
    VIEW_CENTRE_X,  // px
    VIEW_CENTRE_Y,
    VIEW_RADIAL_2,  // px outwards at the sensor's corner, from k1
    VIEW_RADIAL_4,
    VIEW_RADIAL_6,
    VIEW_TANGENTIAL_1,  // px at the sensor's corner, from p1
    VIEW_TANGENTIAL_2,
    VIEW_ROTATION_X,  // rad, about axes of the instrument
    VIEW_ROTATION_Y,
    VIEW_ROTATION_Z,
    VIEW_POSITION_X,  // mm, in the instrument's frame
    VIEW_POSITION_Y,
    VIEW_POSITION_Z,
    VIEW_TERMS
};

struct camera_view {
    struct lens lens;  // lens of the whole sensor; both focal lengths are equal
    double R_instrument_camera[9];
    double position_mm[3];  // position of the entrance pupil
};

/// `base` with a correction applied. `result` may be `base`.
void camera_view_correct(const struct camera_view *base, const double correction[VIEW_TERMS],
                         struct camera_view *result);

/// The correction that turns `from` into `to`, for small differences.
void camera_view_difference(const struct camera_view *to, const struct camera_view *from,
                            double correction[VIEW_TERMS]);

/// Direction of a pixel in the instrument's frame; false where the lens has none.
bool camera_view_ray(const struct camera_view *view, const double pixel_px[2], double direction[3]);

/// A point `origin + (x, y, 1) / w`: w is the reciprocal of its distance along z, 0 at infinity.
struct far_point {
    double origin_mm[3];
    double x, y, w;
};

/// Pixel of a point. Returns false behind the camera. `of_view` and `of_point` (x, y, w) receive
/// the derivatives; both may be NULL.
bool camera_view_project(const struct camera_view *view, const struct far_point *point,
                         double pixel_px[2], double (*of_view)[VIEW_TERMS], double (*of_point)[3]);

/// The pair's geometry: intrinsics, rotation and translation of `result`; its other fields stay.
void camera_view_pair(const struct camera_view *left, const struct camera_view *right,
                      struct calibration *result);

#ifdef __cplusplus
}
#endif

#endif
