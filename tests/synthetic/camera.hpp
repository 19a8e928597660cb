// SPDX-License-Identifier: Apache-2.0
/// Cameras of synthetic worlds, written from the published equations of the lens models and
/// Rodrigues' formula: no code of firmware/ is used, so that an error there cannot cancel here.
#ifndef VERGENCE_TESTS_SYNTHETIC_CAMERA_HPP
#define VERGENCE_TESTS_SYNTHETIC_CAMERA_HPP

#include <array>
#include <optional>

#include "stereo/geometry/calibration.h"
#include "synthetic/scene.hpp"

namespace synthetic {

using Matrix = std::array<double, 9>;  // row-major

Matrix rotation_from_vector(const Vector &rotation_rad);
Vector operator*(const Matrix &m, const Vector &a);
Matrix operator*(const Matrix &a, const Matrix &b);
Matrix transpose(const Matrix &m);

struct Pixel {
    double x, y;
};

/// Moves every image row of a camera: a ray that would hit (x, y) is seen at y + offset + slope_x
/// (x - width/2) + slope_y (y - height/2).
struct VerticalShift {
    double offset_px = 0, slope_x = 0, slope_y = 0;
};

struct Camera {
    int width = 0, height = 0;
    double fx = 0, fy = 0, cx = 0, cy = 0;
    double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
    double k4 = 0, k5 = 0, k6 = 0;  // used by a rational lens; k4 also by an equidistant one
    bool equidistant = false;       // the coefficients are those of powers of the angle
    Matrix R_camera_world{1, 0, 0, 0, 1, 0, 0, 0, 1};
    Vector centre_mm;  // centre of projection in the world
    VerticalShift vertical;

    // Direction in the camera's frame; length 1 if equidistant.
    Vector ray(const Pixel &pixel) const;
    Vector direction(const Pixel &pixel) const;  // direction in the world, of any length
    /// None behind the camera, unless it is equidistant.
    std::optional<Pixel> project(const Vector &point_mm) const;
};

/// Brown-Conrady or rational distortion and its inverse, for normalised coordinates.
Pixel distort(const Camera &camera, const Pixel &ideal);
Pixel undistort(const Camera &camera, const Pixel &distorted);

/// Two cameras. The world is the left camera's frame.
struct Rig {
    Camera left, right;
};

/// A rectified rig: x_left - x_right = disparity_at_infinity + f baseline / z.
Rig rectified_rig(int width, int height, double f_px, double baseline_mm,
                  double disparity_at_infinity_px = 0);

/// An unrectified rig: lenses as given, right camera rotated by a rotation vector, point_right = R
/// point_left + t.
Rig posed_rig(const Camera &left_lens, const Camera &right_lens, const Vector &rotation_rad,
              const Vector &translation_mm);

/// The calibration that a perfect calibrator would find. `rotation_rad` and `translation_mm` as in
/// `posed_rig`.
calibration calibration_of(const Rig &rig, const Vector &rotation_rad,
                           const Vector &translation_mm);

}  // namespace synthetic

#endif
