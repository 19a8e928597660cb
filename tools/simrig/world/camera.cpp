// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/world/camera.hpp"

#include <algorithm>

namespace world {
namespace {

// Half of the diagonal of 2048 x 1536 pixels of 3.2 um: where distortion and falloff are given.
constexpr double kCornerMm = 4.096;

double blend(double wide, double tele, double z) {
    return wide + (tele - wide) * z;
}

double zoom_part(double position) {
    return (position - 300) / 550;
}

double sharp_per_mm(const Lens &lens, double zoom, double focus) {
    return (focus - 300) / 550 / lens.nearest_focus_mm +
           lens.focus_drift_per_m * zoom_part(zoom) / 1000;
}

// The spot of a point at a round pupil is Airy's disk, (2 J1(x) / x)^2 with x = pi r / (wavelength
// N). The Gaussian with the same peak and the same light has 2 pi rms^2 = 4 (wavelength N)^2 / pi;
// its curvature at the peak is Airy's, too. The rms of Airy's disk itself is infinite.
double diffraction_rms_um(double f_number) {
    constexpr double kGreenUm = 0.55;
    return std::sqrt(2.0) / kPi * kGreenUm * f_number;
}

double f_number_of(const Lens &lens, double z, double iris) {
    const double open = blend(lens.f_number_wide, lens.f_number_tele, z);
    const double part_closed = std::clamp((850 - iris) / 550, 0.0, 1.0);
    return open * std::pow(lens.f_number_closed / open, part_closed);
}

// Parts of the irregular image centre over the zoom: shares of 1, periods over the travel, phases.
struct Wave {
    double share, periods, phase_x, phase_y;
};
constexpr Wave kIrregular[] = {
    {0.55, 1.618, 0.7, 2.9}, {0.28, 4.236, 4.1, 0.4}, {0.17, 7.391, 1.9, 5.2}};

Vec2 irregular(double z) {
    Vec2 sum;
    for (const Wave &wave : kIrregular) {
        const double turn = 2 * kPi * wave.periods * z;
        sum.x += wave.share * std::sin(turn + wave.phase_x);
        sum.y += wave.share * std::sin(turn + wave.phase_y);
    }
    return sum;
}

double focal_length(const Lens &lens, double z) {
    const double line = blend(lens.focal_length_wide_mm, lens.focal_length_tele_mm, z);
    const double power = lens.focal_length_wide_mm *
                         std::pow(lens.focal_length_tele_mm / lens.focal_length_wide_mm, z);
    return (lens.exponential == 0 ? line : blend(line, power, lens.exponential)) +
           lens.bow_mm * 4 * z * (1 - z) +
           lens.ripple_mm * std::sin(2 * kPi * lens.ripple_periods * z + lens.ripple_phase_rad);
}

// Derivatives of the distorted slopes along x and y.
struct Jacobian {
    double xx, xy, yx, yy;
};

Vec2 distorted_with(const Optics &o, Vec2 s, Jacobian &j) {
    const auto &k = o.radial;
    const double p1 = o.decentring.x;
    const double p2 = o.decentring.y;
    const double r2 = s.x * s.x + s.y * s.y;
    const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[2]));
    const double change = 2 * (k[0] + r2 * (2 * k[1] + r2 * 3 * k[2]));
    j.xx = radial + change * s.x * s.x + 2 * p1 * s.y + 6 * p2 * s.x;
    j.xy = change * s.x * s.y + 2 * p1 * s.x + 2 * p2 * s.y;
    j.yx = j.xy;
    j.yy = radial + change * s.y * s.y + 6 * p1 * s.y + 2 * p2 * s.x;
    return {s.x * radial + 2 * p1 * s.x * s.y + p2 * (r2 + 2 * s.x * s.x),
            s.y * radial + p1 * (r2 + 2 * s.y * s.y) + 2 * p2 * s.x * s.y};
}

Mat3 mount_turn(const Vec3 &turn_rad) {
    return rotation_about({0, 0, 1}, turn_rad.z) * rotation_about({0, 1, 0}, turn_rad.y) *
           rotation_about({1, 0, 0}, turn_rad.x);
}

}  // namespace

bool operator==(const Mechanics &a, const Mechanics &b) {
    return a.pan_rad == b.pan_rad && a.zoom == b.zoom && a.focus == b.focus && a.iris == b.iris &&
           a.warm == b.warm;
}

Optics optics_of(const Lens &lens, double pixel_um, const Mechanics &mechanics) {
    const double z = zoom_part(mechanics.zoom);
    Optics o;
    o.focal_length_mm = focal_length(lens, z);
    const double f = o.focal_length_mm;
    o.f_number = f_number_of(lens, z, mechanics.iris);
    o.pupil_diameter_mm = f / o.f_number;
    const double sharp = std::max(sharp_per_mm(lens, mechanics.zoom, mechanics.focus), 0.0);
    o.focus_distance_mm = sharp * kInfinityMm <= 1 ? kInfinityMm : 1 / sharp;
    // Thin lens: the image lies at f u / (u - f) behind the pupil.
    const double image_mm = f * o.focus_distance_mm / (o.focus_distance_mm - f);
    const double seen_mm = f + lens.breathing * (image_mm - f);
    o.focal_px = seen_mm * 1000 / pixel_um;
    const double turn = 1.5 * kPi * z;
    o.centre_px = {(kArrayColumns - 1) / 2.0 + lens.centre_offset_px.x +
                       lens.centre_wander_px.x * std::sin(turn),
                   (kArrayRows - 1) / 2.0 + lens.centre_offset_px.y +
                       lens.centre_wander_px.y * (1 - std::cos(turn))};
    const Vec2 aside = irregular(z);
    o.centre_px.x += lens.centre_irregular_px.x * aside.x;
    o.centre_px.y += lens.centre_irregular_px.y * aside.y;
    o.corner_slope = kCornerMm / seen_mm;
    double power = 1;
    for (std::size_t i = 0; i < 3; i++) {
        power *= o.corner_slope * o.corner_slope;
        o.radial[i] = blend(lens.distortion_wide[i], lens.distortion_tele[i], z) / power;
    }
    const double decentring_scale = 1 / (o.focal_px * o.corner_slope * o.corner_slope);
    o.decentring = {
        blend(lens.decentring_wide_px.x, lens.decentring_tele_px.x, z) * decentring_scale,
        blend(lens.decentring_wide_px.y, lens.decentring_tele_px.y, z) * decentring_scale};
    o.pupil_shift_mm = lens.pupil_travel_mm * z;
    const double open = blend(lens.f_number_wide, lens.f_number_tele, z) / o.f_number;
    o.natural_falloff = lens.natural_falloff;
    o.mount_falloff = lens.mount_falloff * open * open;
    o.transmission = lens.transmission;
    o.spot_rms_px =
        std::hypot(lens.spot_rms_um, lens.diffraction * diffraction_rms_um(o.f_number)) / pixel_um;
    o.spot_corner_px = lens.spot_corner_um / pixel_um;
    o.corner_px = kCornerMm * 1000 / pixel_um;
    o.colour_scale[0] += lens.lateral_colour_px.x / o.corner_px;
    o.colour_scale[2] += lens.lateral_colour_px.y / o.corner_px;
    return o;
}

double focus_position_for(const Lens &lens, double zoom, double distance_mm) {
    const double sharp = 1 / distance_mm - lens.focus_drift_per_m * zoom_part(zoom) / 1000;
    return 300 + 550 * sharp * lens.nearest_focus_mm;
}

Vec2 distorted(const Optics &optics, Vec2 slopes) {
    Jacobian j;
    return distorted_with(optics, slopes, j);
}

Vec2 Camera::project(const Vec3 &point_camera_mm) const {
    const Vec2 d = distorted(
        optics, {point_camera_mm.x / point_camera_mm.z, point_camera_mm.y / point_camera_mm.z});
    return optics.focal_px * d + optics.centre_px;
}

Vec2 Camera::project_world(const Vec3 &point_world_mm) const {
    return project(inverse(world_camera) * point_world_mm);
}

Vec2 Camera::slopes_of(Vec2 pixel, Vec2 start) const {
    double step[4];
    return slopes_of(pixel, start, step);
}

Vec2 Camera::slopes_of(Vec2 pixel, Vec2 start, double (&step)[4]) const {
    const double per_pixel = 1 / optics.focal_px;
    const Vec2 target = per_pixel * (pixel - optics.centre_px);
    Vec2 s = start;
    for (int i = 0; i < 20; i++) {
        Jacobian j;
        const Vec2 error = distorted_with(optics, s, j) - target;
        const double scale = 1 / (j.xx * j.yy - j.xy * j.yx);
        s = s - Vec2{scale * (j.yy * error.x - j.xy * error.y),
                     scale * (j.xx * error.y - j.yx * error.x)};
        step[0] = per_pixel * scale * j.yy;
        step[1] = -per_pixel * scale * j.xy;
        step[2] = -per_pixel * scale * j.yx;
        step[3] = per_pixel * scale * j.xx;
        // Newton squares the error: what is left is below 1e-12.
        if (std::fabs(error.x) + std::fabs(error.y) < 1e-7) {
            break;
        }
    }
    return s;
}

Vec2 Camera::slopes_of(Vec2 pixel) const {
    return slopes_of(pixel, (1 / optics.focal_px) * (pixel - optics.centre_px));
}

Camera Camera::of_colour(int channel) const {
    Camera camera = *this;
    camera.optics.focal_px *= optics.colour_scale[channel];
    return camera;
}

double Camera::falloff(Vec2 slopes) const {
    const double r2 = dot(slopes, slopes);
    const double cos2 = 1 / (1 + r2);
    const double natural = 1 - optics.natural_falloff * (1 - cos2 * cos2);
    const double q = r2 / (optics.corner_slope * optics.corner_slope);
    return natural * std::max(0.0, 1 - optics.mount_falloff * q * q);
}

Camera camera_at(const RigCamera &rig_camera, const Mechanics &mechanics) {
    Camera camera;
    camera.pixel_um = rig_camera.sensor.pixel_um;
    camera.optics = optics_of(rig_camera.lens, camera.pixel_um, mechanics);
    const Mount &mount = rig_camera.mount;
    const Drift &drift = rig_camera.drift;
    camera.optics.focal_px *= 1 + mechanics.warm * drift.focal_part;
    camera.optics.centre_px = camera.optics.centre_px + mechanics.warm * drift.centre_px;
    const Mat3 turn = mount_turn(mount.turn_rad + mechanics.warm * drift.turn_rad);
    const Vec3 pupil = mount.pupil_mm + turn * Vec3{0, 0, camera.optics.pupil_shift_mm};
    // The servo turns the whole camera about its axis.
    const Mat3 pan = rotation_about(mount.axis_direction, mechanics.pan_rad);
    camera.world_camera = {pan * turn, mount.axis_point_mm + pan * (pupil - mount.axis_point_mm)};
    return camera;
}

}  // namespace world
