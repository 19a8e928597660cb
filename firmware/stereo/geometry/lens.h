// SPDX-License-Identifier: Apache-2.0
/// Pinhole camera with Brown-Conrady distortion (OpenCV's order and signs: k1 k2 p1 p2 k3).
/// Source: D. C. Brown, "Decentering distortion of lenses", 1966; OpenCV calib3d manual.
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

struct lens {
    int width_px, height_px;
    double fx_px, fy_px;  // focal lengths
    double cx_px, cy_px;  // principal point; (0,0) is the centre of the top-left pixel
    double k1, k2, p1, p2, k3;
};

/// Whether all five distortion coefficients are exactly 0.
bool lens_is_ideal(const struct lens *lens);

/// Distorted normalised coordinates of the ideal ones (x/z, y/z).
void lens_distort(const struct lens *lens, const double ideal[2], double distorted[2]);

/// Partial derivatives of `lens_distort`: {dx/dx, dx/dy, dy/dx, dy/dy}; dx/dy equals dy/dx.
void lens_distort_slope(const struct lens *lens, const double ideal[2], double slope[4]);

/// Inverse of `lens_distort` by Newton's method. Returns false (output unchanged) if no solution
/// within 1e-12 is found, e.g. outside the region where the model is one to one.
bool lens_undistort(const struct lens *lens, const double distorted[2], double ideal[2]);

/// Radius sqrt(x^2 + y^2) of ideal coordinates at which the radial distortion stops growing and
/// folds back; INFINITY if it never does. Beyond it `lens_distort` is meaningless.
double lens_fold_radius(const struct lens *lens);

/// Radius of ideal coordinates that limits the camera's view: 0.98 of the largest disc on which
/// `lens_distort` is certainly one to one (its Jacobian is symmetric and positive definite there;
/// tangential terms included); INFINITY if that holds everywhere. The rim is excluded because a raw
/// pixel is stretched without limit there. Real calibrations often fold over at or just outside the
/// image corners, where no calibration pattern was seen.
double lens_view_radius(const struct lens *lens);

/// Pixel of a point in the camera's frame. Returns false if z <= 0.
bool lens_project(const struct lens *lens, const double point_mm[3], double pixel_px[2]);

/// Direction (x, y, 1) of a pixel in the camera's frame. Returns false where `lens_undistort` does.
bool lens_ray(const struct lens *lens, const double pixel_px[2], double direction[3]);

/// Checks ranges (sizes 1..LENS_SIDE_MAX_PX, the limits above, everything finite) and that all of
/// the image's central half (half its width by half its height, so out to half of the
/// half-diagonal) lies within `lens_view_radius`. Pixels beyond that radius are not used, and a
/// camera that loses more than its margins is calibrated wrongly. Errors: ERROR_RANGE,
/// ERROR_TOO_LARGE or ERROR_DISTORTION.
int lens_validate(const struct lens *lens);

#ifdef __cplusplus
}
#endif

#endif
