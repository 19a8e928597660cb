// SPDX-License-Identifier: Apache-2.0
/// Camera models: Brown-Conrady and rational distortion of a pinhole camera, and the equidistant
/// model for wide lenses, with the names, the order and the signs of OpenCV.
/// Sources: D. C. Brown, "Decentering distortion of lenses", 1966; J. Kannala and S. Brandt, "A
/// generic camera model and calibration method for conventional, wide-angle, and fish-eye lenses",
/// 2006; OpenCV calib3d manual.
#ifndef VERGENCE_STEREO_GEOMETRY_LENS_H
#define VERGENCE_STEREO_GEOMETRY_LENS_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

// Legal values, see `lens_validate`. For long focal lengths k2 and k3 are large numbers: they
// multiply the fourth and sixth power of a small radius.
#define LENS_SIDE_MAX_PX 32768  // above the limit of image.h, larger images are scaled down
#define LENS_FOCAL_MIN_PX 1.0
#define LENS_FOCAL_MAX_PX 1e6
#define LENS_CENTRE_MAX_PX 1e6
#define LENS_COEFFICIENT_MAX 1e9

enum lens_kind {
    /// r (1 + k1 r^2 + k2 r^4 + k3 r^6), r the tangent of the angle off the axis, and tangential
    /// terms p1, p2.
    LENS_BROWN_CONRADY,
    /// The same with the radial part divided by 1 + k4 r^2 + k5 r^4 + k6 r^6.
    LENS_RATIONAL,
    /// t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8), t the angle off the axis in rad. OpenCV's
    /// "fisheye", Kalibr's "equi", ROS's "equidistant". Sees more than 180 degrees if need be.
    LENS_EQUIDISTANT,
    LENS_KINDS,
};

/// Coefficients that a kind does not have are 0.
struct lens {
    int width_px, height_px;
    double fx_px, fy_px;  // focal lengths
    double cx_px, cy_px;  // principal point; (0,0) is the centre of the top-left pixel
    double k1, k2, p1, p2, k3;
    double k4, k5, k6;
    enum lens_kind kind;
};

/// "brown-conrady", "rational" or "equidistant".
const char *lens_kind_name(enum lens_kind kind);

/// Whether the image is that of a pinhole: not equidistant, all coefficients exactly 0.
bool lens_is_ideal(const struct lens *lens);

/// Distorted normalised coordinates of the ideal ones (x/z, y/z).
void lens_distort(const struct lens *lens, const double ideal[2], double distorted[2]);

/// Partial derivatives of `lens_distort`: {dx/dx, dx/dy, dy/dx, dy/dy}; dx/dy equals dy/dx.
void lens_distort_slope(const struct lens *lens, const double ideal[2], double slope[4]);

/// Inverse of `lens_distort` by Newton's method. Returns false (output unchanged) if no solution
/// within 1e-12 is found, e.g. outside the region where the model is one to one, or 89.9 degrees or
/// more off the axis.
bool lens_undistort(const struct lens *lens, const double distorted[2], double ideal[2]);

/// Radius sqrt(x^2 + y^2) of ideal coordinates at which the radial distortion stops growing and
/// folds back, or has a pole; INFINITY if it never does within 89.9 degrees of the axis. Beyond it
/// `lens_distort` is meaningless.
double lens_fold_radius(const struct lens *lens);

/// Radius of ideal coordinates that limits the camera's view: 0.98 of the largest disc on which
/// `lens_distort` is certainly one to one (its Jacobian is symmetric and positive definite there;
/// tangential terms included); INFINITY if that holds everywhere. The rim is excluded because a raw
/// pixel is stretched without limit there. Real calibrations often fold over at or just outside the
/// image corners, where no calibration pattern was seen.
double lens_view_radius(const struct lens *lens);

/// Angle in rad at which an equidistant lens folds back; pi if it never does.
double lens_fold_angle(const struct lens *lens);

/// Whether a direction, of any length, lies within `view_radius` (see `lens_view_radius`).
bool lens_sees(double view_radius, const double direction[3]);

/// Pixel of a point in the camera's frame. Returns false if z <= 0, unless the lens is equidistant:
/// that one projects every point except those on its axis behind it.
bool lens_project(const struct lens *lens, const double point_mm[3], double pixel_px[2]);

/// Direction (x, y, 1) of a pixel in the camera's frame; of length 1 if an equidistant lens sees it
/// 89.9 degrees or more off the axis. Returns false where the model has no such direction.
bool lens_ray(const struct lens *lens, const double pixel_px[2], double direction[3]);

/// Checks ranges (sizes 1..LENS_SIDE_MAX_PX, the limits above, everything finite, no coefficient
/// that the kind does not have) and that all of
/// the image's central half (half its width by half its height, so out to half of the
/// half-diagonal) lies within `lens_view_radius`. Pixels beyond that radius are not used, and a
/// camera that loses more than its margins is calibrated wrongly. Errors: ERROR_RANGE,
/// ERROR_TOO_LARGE or ERROR_DISTORTION.
int lens_validate(const struct lens *lens);

#ifdef __cplusplus
}
#endif

#endif
