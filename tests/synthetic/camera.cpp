// SPDX-License-Identifier: Apache-2.0
#include "synthetic/camera.hpp"

#include <cmath>
#include <cstring>

namespace synthetic {

Matrix rotation_from_vector(const Vector &rotation_rad) {
    const double angle = norm(rotation_rad);
    if (angle == 0) {
        return {1, 0, 0, 0, 1, 0, 0, 0, 1};
    }
    const Vector k = (1 / angle) * rotation_rad;
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    const double v = 1 - c;
    return {c + k.x * k.x * v,       k.x * k.y * v - k.z * s, k.x * k.z * v + k.y * s,
            k.y * k.x * v + k.z * s, c + k.y * k.y * v,       k.y * k.z * v - k.x * s,
            k.z * k.x * v - k.y * s, k.z * k.y * v + k.x * s, c + k.z * k.z * v};
}

Vector operator*(const Matrix &m, const Vector &a) {
    return {m[0] * a.x + m[1] * a.y + m[2] * a.z, m[3] * a.x + m[4] * a.y + m[5] * a.z,
            m[6] * a.x + m[7] * a.y + m[8] * a.z};
}

Matrix operator*(const Matrix &a, const Matrix &b) {
    Matrix result{};
    for (size_t i = 0; i < 9; i++) {
        result[i] = a[i / 3 * 3] * b[i % 3] + a[i / 3 * 3 + 1] * b[3 + i % 3] +
                    a[i / 3 * 3 + 2] * b[6 + i % 3];
    }
    return result;
}

Matrix transpose(const Matrix &m) {
    return {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]};
}

Pixel distort(const Camera &camera, const Pixel &ideal) {
    const double x = ideal.x;
    const double y = ideal.y;
    const double r2 = x * x + y * y;
    const double radial = (1 + camera.k1 * r2 + camera.k2 * r2 * r2 + camera.k3 * r2 * r2 * r2) /
                          (1 + camera.k4 * r2 + camera.k5 * r2 * r2 + camera.k6 * r2 * r2 * r2);
    return {x * radial + 2 * camera.p1 * x * y + camera.p2 * (r2 + 2 * x * x),
            y * radial + camera.p1 * (r2 + 2 * y * y) + 2 * camera.p2 * x * y};
}

namespace {

// The argument below `high` at which a function that grows from 0 has a value.
template <typename Function>
double solve(const Function &growing, double value, double high) {
    double low = 0;
    for (int i = 0; i < 60; i++) {
        const double middle = (low + high) / 2;
        (growing(middle) < value ? low : high) = middle;
    }
    return (low + high) / 2;
}

double radius_of_angle(const Camera &camera, double angle) {
    return angle + camera.k1 * std::pow(angle, 3) + camera.k2 * std::pow(angle, 5) +
           camera.k3 * std::pow(angle, 7) + camera.k4 * std::pow(angle, 9);
}

// Rational lenses are strong: the radius is bracketed. The tangential terms are small.
Pixel undistort_rational(const Camera &camera, const Pixel &distorted) {
    Camera radial = camera;
    radial.p1 = radial.p2 = 0;
    Pixel ideal = distorted;
    for (int i = 0; i < 12; i++) {
        const Pixel all = distort(camera, ideal), own = distort(radial, ideal);
        const Pixel wanted{distorted.x - (all.x - own.x), distorted.y - (all.y - own.y)};
        const double size = std::hypot(wanted.x, wanted.y);
        const double r = solve(
            [&](double radius) {
                return distort(radial, {radius, 0}).x;
            },
            size, 60);
        ideal = {wanted.x / size * r, wanted.y / size * r};
    }
    return ideal;
}

}  // namespace

Pixel undistort(const Camera &camera, const Pixel &distorted) {
    if (camera.k4 != 0 || camera.k5 != 0 || camera.k6 != 0) {
        return undistort_rational(camera, distorted);
    }
    // Fixed-point iteration: contracts for the mild lenses used here; the generator's self-test
    // checks that it did.
    Pixel ideal = distorted;
    for (int i = 0; i < 60; i++) {
        const Pixel there = distort(camera, ideal);
        const Pixel error{there.x - distorted.x, there.y - distorted.y};
        ideal = {ideal.x - error.x, ideal.y - error.y};
        if (std::abs(error.x) + std::abs(error.y) < 1e-14) {
            break;
        }
    }
    return ideal;
}

Vector Camera::ray(const Pixel &pixel) const {
    const double y = (pixel.y - vertical.offset_px - vertical.slope_x * (pixel.x - width / 2.0) +
                      vertical.slope_y * height / 2.0) /
                     (1 + vertical.slope_y);
    const Pixel distorted{(pixel.x - cx) / fx, (y - cy) / fy};
    if (equidistant) {
        const double radius = std::hypot(distorted.x, distorted.y);
        const double angle = solve([&](double a) { return radius_of_angle(*this, a); }, radius, 3);
        const double scale = radius > 0 ? std::sin(angle) / radius : 1;
        return {scale * distorted.x, scale * distorted.y, std::cos(angle)};
    }
    const Pixel ideal = undistort(*this, distorted);
    return {ideal.x, ideal.y, 1};
}

Vector Camera::direction(const Pixel &pixel) const {
    return transpose(R_camera_world) * ray(pixel);
}

std::optional<Pixel> Camera::project(const Vector &point_mm) const {
    const Vector in_camera = R_camera_world * (point_mm - centre_mm);
    Pixel there{};
    if (equidistant) {
        const double across = std::hypot(in_camera.x, in_camera.y);
        const double radius = radius_of_angle(*this, std::atan2(across, in_camera.z));
        there = across > 0 ? Pixel{in_camera.x / across * radius, in_camera.y / across * radius}
                           : Pixel{0, 0};
    } else if (in_camera.z > 0) {
        there = distort(*this, {in_camera.x / in_camera.z, in_camera.y / in_camera.z});
    } else {
        return std::nullopt;
    }
    const double x = cx + fx * there.x;
    const double y = cy + fy * there.y;
    return Pixel{x, y + vertical.offset_px + vertical.slope_x * (x - width / 2.0) +
                        vertical.slope_y * (y - height / 2.0)};
}

Rig rectified_rig(int width, int height, double f_px, double baseline_mm,
                  double disparity_at_infinity_px) {
    Rig rig;
    rig.left.width = width;
    rig.left.height = height;
    rig.left.fx = f_px;
    rig.left.fy = f_px;
    rig.left.cx = (width - 1) / 2.0;
    rig.left.cy = (height - 1) / 2.0;
    rig.right = rig.left;
    rig.right.cx = rig.left.cx - disparity_at_infinity_px;
    rig.right.centre_mm = {baseline_mm, 0, 0};
    return rig;
}

Rig posed_rig(const Camera &left_lens, const Camera &right_lens, const Vector &rotation_rad,
              const Vector &translation_mm) {
    Rig rig{left_lens, right_lens};
    rig.right.R_camera_world = rotation_from_vector(rotation_rad);
    rig.right.centre_mm = -1.0 * (transpose(rig.right.R_camera_world) * translation_mm);
    return rig;
}

calibration calibration_of(const Rig &rig, const Vector &rotation_rad,
                           const Vector &translation_mm) {
    calibration result{};
    std::strcpy(result.id, "synthetic");
    const auto lens_of = [](const Camera &camera) {
        const bool rational = camera.k4 != 0 || camera.k5 != 0 || camera.k6 != 0;
        return lens{camera.width,
                    camera.height,
                    camera.fx,
                    camera.fy,
                    camera.cx,
                    camera.cy,
                    camera.k1,
                    camera.k2,
                    camera.p1,
                    camera.p2,
                    camera.k3,
                    camera.k4,
                    camera.k5,
                    camera.k6,
                    camera.equidistant ? LENS_EQUIDISTANT
                    : rational         ? LENS_RATIONAL
                                       : LENS_BROWN_CONRADY};
    };
    result.left = lens_of(rig.left);
    result.right = lens_of(rig.right);
    const double rotation[3] = {rotation_rad.x, rotation_rad.y, rotation_rad.z};
    const double translation[3] = {translation_mm.x, translation_mm.y, translation_mm.z};
    std::memcpy(result.rotation_right_left_rad, rotation, sizeof rotation);
    std::memcpy(result.translation_right_left_mm, translation, sizeof translation);
    return result;
}

}  // namespace synthetic
