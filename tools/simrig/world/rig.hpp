// SPDX-License-Identifier: Apache-2.0
/// Two cameras on pan axes: every number that a rig file holds. Angles in rad, lengths in mm.
#ifndef VERGENCE_SIMRIG_WORLD_RIG_HPP
#define VERGENCE_SIMRIG_WORLD_RIG_HPP

#include <array>
#include <cstdint>
#include <string>

#include "tools/simrig/world/vec.hpp"

namespace world {

constexpr int kArrayColumns = 2048;
constexpr int kArrayRows = 1536;

/// A motorized zoom lens over motor positions 300..850. "Zoom z" runs from 0 at 300 to 1 at 850.
struct Lens {
    /// Focal length: a straight line between the ends, of which `exponential` is the share that is
    /// wide * (tele / wide)^z instead, plus bow * 4 z (1 - z), plus
    /// ripple * sin(2 pi periods z + phase).
    double focal_length_wide_mm = 8.5;
    double focal_length_tele_mm = 85;
    double exponential = 0;
    double bow_mm = 0;
    double ripple_mm = 0;
    double ripple_periods = 6.3;
    double ripple_phase_rad = 0;
    /// Image centre from the array's centre: offset + wander * (sin and cos of a slow turn over z),
    /// + irregular * three sines whose periods have no common multiple, which is never beyond
    /// `irregular`.
    Vec2 centre_offset_px;
    Vec2 centre_wander_px;
    Vec2 centre_irregular_px;
    /// How far the entrance pupil moves along the axis (positive: towards the scene) from z = 0
    /// to 1.
    double pupil_travel_mm = 0;
    /// Radial distortion at the image's corner (4.096 mm from the centre) as a part of the radius:
    /// x_distorted = x (1 + sum). Terms of degree 2, 4, 6 at z = 0 and z = 1, linear between.
    std::array<double, 3> distortion_wide{};
    std::array<double, 3> distortion_tele{};
    /// Decentring p1, p2: displacement in pixels at the corner, at z = 0 and z = 1.
    Vec2 decentring_wide_px;
    Vec2 decentring_tele_px;
    /// Focus position 300 is infinity; 850 is the nearest distance; linear in 1 / distance between.
    double nearest_focus_mm = 800;
    /// How far the sharp plane moves over the zoom, as change of 1 / distance from z = 0 to 1.
    double focus_drift_per_m = 0;
    /// Share of the thin lens's change of image distance with focus: 1 thin lens, 0 none.
    double breathing = 0;
    /// f-number with the iris open at z = 0 and 1; the iris closes to `f_number_closed`, linear in
    /// log f-number, as its position goes from 850 (open) to 300.
    double f_number_wide = 1.6;
    double f_number_tele = 2.0;
    double f_number_closed = 16;
    double transmission = 0.88;
    /// Part of the natural cos^4 falloff that is there, and what mounts cut off at the corner with
    /// the iris open (it goes with the square of the pupil's diameter).
    double natural_falloff = 1;
    double mount_falloff = 0;
    /// Spot of the lens in focus: rms radius a dimension, on the sensor.
    double spot_rms_um = 0;
    /// By how much it grows over the field: rms radius at the corner, less with the square of the
    /// distance from the image centre, added in squares.
    double spot_corner_um = 0;
    /// Lateral colour: how far red and blue lie farther out than green at the corner; less in
    /// proportion to the radius.
    Vec2 lateral_colour_px;
    /// How much of diffraction at the pupil is there: 1 physical, 0 none.
    double diffraction = 0;
};

struct Sensor {
    double pixel_um = 3.2;
    double full_well_e = 8500;
    double read_noise_e = 8;
    double black_level_dn = 42;
    /// Electrons a pixel and lux second of white light on the sensor, times each filter's part.
    double electrons_per_lux_s = 17000;
    std::array<double, 3> filter_part{0.62, 1.0, 0.55};
    double photon_noise = 1;  ///< 1 physical, 0 none
    double prnu = 0;          ///< rms part by which pixels differ in response
    double row_noise_e = 0;
    std::uint64_t serial = 0;
};

struct Mount {
    /// Camera at pan zero in the world's frame: place of the entrance pupil at z = 0.
    Vec3 pupil_mm;
    /// Turns about x, y, z of the camera, in this order, from looking along the world's z.
    Vec3 turn_rad;
    /// The servo's axis: a point in the world's frame, and its direction (down, so that a positive
    /// pan turns towards positive x).
    Vec3 axis_point_mm;
    Vec3 axis_direction{0, 1, 0};
};

/// What a camera that has warmed up differs by from a cold one; in proportion between.
struct Drift {
    double focal_part = 0;  ///< relative change of the image distance
    Vec2 centre_px;         ///< shift of the image centre
    Vec3 turn_rad;          ///< added to the mount's turn
};

struct RigCamera {
    Lens lens;
    Sensor sensor;
    Mount mount;
    Drift drift;
    /// The servo angle that `simrig-render` and tests use by default.
    double pan_rad = 0;
};

struct Mains {
    /// Light = mean * (1 - modulation * cos(2 pi frequency t + phase)); 100 or 120 Hz.
    double frequency_hz = 100;
    double modulation = 0;
    double phase_rad = 0;
};

enum class Side { kLeft = 0, kRight = 1 };

struct Rig {
    RigCamera camera[2];
    Mains mains;
    /// Share of the contrast that textures and ornaments of every scene have: 1 as in its file.
    double texture = 1;

    const RigCamera &of(Side side) const { return camera[static_cast<int>(side)]; }
};

/// Reads a rig file. Throws BadFile (document.hpp).
Rig load_rig(const std::string &path);

}  // namespace world

#endif
