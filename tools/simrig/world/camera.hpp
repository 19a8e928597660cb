// SPDX-License-Identifier: Apache-2.0
/// A camera at one instant, computed from motor and servo positions.
#ifndef VERGENCE_SIMRIG_WORLD_CAMERA_HPP
#define VERGENCE_SIMRIG_WORLD_CAMERA_HPP

#include <algorithm>
#include <array>

#include "tools/simrig/world/rig.hpp"
#include "tools/simrig/world/vec.hpp"

namespace world {

/// Positions of motors and servo. Lens positions 300..850, fractions allowed.
struct Mechanics {
    double pan_rad = 0;
    double zoom = 300;
    double focus = 300;
    double iris = 850;
    double warm = 0;  ///< share of the rig's warming up: see Drift
};

bool operator==(const Mechanics &a, const Mechanics &b);

/// Optics of the lens at its positions. Pixels are those of the full array.
struct Optics {
    double focal_length_mm = 0;  ///< thin lens, focused at infinity
    double focal_px = 0;         ///< image distance in pixels: what K holds
    Vec2 centre_px;
    std::array<double, 3> radial{};  ///< k1 k2 k3 of Brown and Conrady
    Vec2 decentring;                 ///< p1 p2
    double pupil_shift_mm = 0;       ///< shift along the axis from the pupil's place at zoom 300
    double pupil_diameter_mm = 0;
    double focus_distance_mm = 0;  ///< distance from the pupil to the sharp plane
    double f_number = 0;
    double corner_slope = 0;  ///< (4.096 mm / image distance), where falloff is given
    double natural_falloff = 0;
    double mount_falloff = 0;  ///< falloff at the corner, at this iris
    double transmission = 0;
    double spot_rms_px = 0;     ///< radius on the axis
    double spot_corner_px = 0;  ///< added in squares at the corner, less with the radius squared
    double colour_scale[3] = {1, 1, 1};  ///< scale of the image in red, green and blue
    double corner_px = 1280;             ///< radius at which distortion, falloff and spot are given

    /// Radius of a pixel's place, squared, as a part of the corner's.
    double corner_part2(Vec2 pixel) const {
        const Vec2 off = pixel - centre_px;
        return dot(off, off) / (corner_px * corner_px);
    }
    /// From a pixel to the one where green shows what this colour shows at the pixel.
    Vec2 colour_shift(Vec2 pixel, int channel) const {
        return (1 / colour_scale[channel] - 1) * (pixel - centre_px);
    }
    /// The longest of these.
    double colour_shift_px(Vec2 pixel) const {
        return std::max(length(colour_shift(pixel, 0)), length(colour_shift(pixel, 2)));
    }
};

/// Distances to the sharp plane at and beyond this count as infinity.
constexpr double kInfinityMm = 1e7;

Optics optics_of(const Lens &lens, double pixel_um, const Mechanics &mechanics);

/// The focus position at which the plane at this distance from the pupil is sharp.
double focus_position_for(const Lens &lens, double zoom, double distance_mm);

struct Camera {
    Optics optics;
    Pose world_camera;  ///< T_world_camera: origin at the entrance pupil, z along the axis
    double pixel_um = 3.2;

    /// Pixel of a point that lies in this camera's frame, z > 0.
    Vec2 project(const Vec3 &point_camera_mm) const;
    Vec2 project_world(const Vec3 &point_world_mm) const;

    /// Slopes (x / z, y / z) of the pinhole ray through a pixel: the inverse of the distortion to
    /// 1e-12. `start` is a guess of the slopes.
    Vec2 slopes_of(Vec2 pixel, Vec2 start) const;
    Vec2 slopes_of(Vec2 pixel) const;
    /// The same from a good guess, with the change of slopes with the pixel (x/x, x/y, y/x, y/y).
    Vec2 slopes_of(Vec2 pixel, Vec2 start, double (&step)[4]) const;

    /// The same camera for light of this colour (0 red, 1 green, 2 blue), if the lens has lateral
    /// colour; this one and truth are those of green.
    Camera of_colour(int channel) const;

    /// Part of the axis's light that reaches a pixel with these slopes.
    double falloff(Vec2 slopes) const;
};

/// Adds the distortion to slopes.
Vec2 distorted(const Optics &optics, Vec2 slopes);

Camera camera_at(const RigCamera &rig_camera, const Mechanics &mechanics);

}  // namespace world

#endif
