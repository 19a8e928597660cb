// SPDX-License-Identifier: Apache-2.0
#include "synthetic/zoom_rig.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>

#include "core/error.h"
#include "core/invariant.h"

namespace zoom_rig {
namespace {

using synthetic::Camera;
using synthetic::Matrix;
using synthetic::operator*;
using synthetic::rotation_from_vector;
using synthetic::transpose;
using synthetic::Vector;

constexpr double kPi = 3.14159265358979323846;
constexpr double kPixelMm = 0.0032;
constexpr int kColumns = 2048, kRows = 1536;
constexpr double kCornerPx = 1280;

struct Lens {
    double wide_mm, tele_mm, bow_mm, ripple_mm, ripple_periods, ripple_phase_deg;
    double centre_offset_px[2], centre_wander_px[2], pupil_travel_mm;
    double distortion_wide[3], distortion_tele[3], decentring_wide_px[2], decentring_tele_px[2];
    double nearest_focus_mm, focus_drift_per_m;
};
struct Mount {
    Vector pupil_mm, turn_deg, axis_point_mm, axis_direction;
};

const Lens lenses[2] = {
    {8.5,
     85,
     -0.45,
     0.012,
     6.3,
     40,
     {6.5, -4.2},
     {9.0, 6.0},
     25,
     {-0.072, 0.013, -0.001},
     {0.0115, -0.002, 0.0005},
     {0.9, -0.6},
     {0.3, 0.2},
     800,
     0.004},
    {8.56,
     84.7,
     -0.51,
     0.014,
     6.1,
     155,
     {-8.1, 3.7},
     {-7.0, 8.0},
     24.4,
     {-0.070, 0.012, -0.001},
     {0.0108, -0.002, 0.0005},
     {-0.5, 0.8},
     {0.2, -0.4},
     800,
     -0.003},
};
const Mount mounts[2] = {
    {{0, 0, 0}, {0, 0, 0}, {3.5, 0, -38}, {0.004, 1, -0.003}},
    {{250, 0.8, -0.5}, {0.15, -0.2, 0.25}, {247.1, 0, -39.5}, {-0.003, 1, 0.005}},
};

double share(double counts) {
    return (counts - 300) / 550;
}

double blend(double wide, double tele, double z) {
    return wide + (tele - wide) * z;
}

double focal_mm(int side, double zoom, bool ripple) {
    const Lens &from = lenses[side];
    const double z = share(zoom),
                 smooth = blend(from.wide_mm, from.tele_mm, z) + from.bow_mm * 4 * z * (1 - z);
    return ripple ? smooth + from.ripple_mm * std::sin(2 * kPi * from.ripple_periods * z +
                                                       from.ripple_phase_deg * kPi / 180)
                  : smooth;
}

double focal_px(int side, double zoom) {
    return focal_mm(side, zoom, false) / kPixelMm;
}

Matrix turn_of(const Vector &turn_deg) {
    const Vector rad = kPi / 180 * turn_deg;
    return rotation_from_vector({0, 0, rad.z}) * rotation_from_vector({0, rad.y, 0}) *
           rotation_from_vector({rad.x, 0, 0});
}

// Terms of Chebyshev's sum that equals `value` at the nodes of u in [-1, 1].
void fit(zoom_function &function, int terms, const std::function<double(double)> &value) {
    constexpr int kNodes = 64;
    function = {};
    function.terms = terms;
    for (int n = 0; n < kNodes; n++) {
        const double angle = kPi * (n + 0.5) / kNodes, at = value(std::cos(angle));
        for (int i = 0; i < terms; i++) {
            function.term[i] += at * std::cos(i * angle) * (i == 0 ? 1.0 : 2.0) / kNodes;
        }
    }
}

// The zoom position with this focal length, by bisection.
double zoom_of(int side, double f_px) {
    double low = 300, high = 850;
    for (int i = 0; i < 60; i++) {
        const double middle = (low + high) / 2;
        (focal_px(side, middle) < f_px ? low : high) = middle;
    }
    return low;
}

void set_lens(int side, zoom_camera &camera) {
    const auto at_zoom = [&](double zoom) { return camera_at(side, zoom, 300, 0, false); };
    camera.zoom = camera.focus = {300, 850};
    camera.log_focal = {std::log(focal_px(side, 300)), std::log(focal_px(side, 850))};
    const auto zoom_at = [&](double u) {
        const double middle = (camera.log_focal.min + camera.log_focal.max) / 2;
        return zoom_of(side, std::exp(middle + u * (camera.log_focal.max - middle)));
    };
    fit(camera.function[ZOOM_FOCAL], 4, [&](double u) { return focal_px(side, 575 + 275 * u); });
    const struct {
        zoom_function_name name;
        std::function<double(const Camera &)> value;
    } others[] = {
        {ZOOM_CENTRE_X, [](const Camera &c) { return c.cx; }},
        {ZOOM_CENTRE_Y, [](const Camera &c) { return c.cy; }},
        {ZOOM_RADIAL_2,
         [](const Camera &c) { return c.k1 * std::pow(kCornerPx, 3) / std::pow(c.fx, 2); }},
        {ZOOM_RADIAL_4,
         [](const Camera &c) { return c.k2 * std::pow(kCornerPx, 5) / std::pow(c.fx, 4); }},
        {ZOOM_RADIAL_6,
         [](const Camera &c) { return c.k3 * std::pow(kCornerPx, 7) / std::pow(c.fx, 6); }},
        {ZOOM_TANGENTIAL_1, [](const Camera &c) { return c.p1 * kCornerPx * kCornerPx / c.fx; }},
        {ZOOM_TANGENTIAL_2, [](const Camera &c) { return c.p2 * kCornerPx * kCornerPx / c.fx; }},
    };
    for (const auto &other : others) {
        fit(camera.function[other.name], ZOOM_TERMS_MAX,
            [&](double u) { return other.value(at_zoom(zoom_at(u))); });
    }
    fit(camera.function[ZOOM_PUPIL], ZOOM_TERMS_MAX,
        [&](double u) { return lenses[side].pupil_travel_mm * share(zoom_at(u)); });
    // Linear in the focus position: 1 / nearest over its range.
    const double per_m = 1000 / lenses[side].nearest_focus_mm;
    fit(camera.function[ZOOM_FOCUS_DIOPTRE], 6,
        [&](double u) { return per_m / 2 + lenses[side].focus_drift_per_m * share(zoom_at(u)); });
    camera.focus_dioptre_by_count[0] = per_m / 2;
    camera.focus_dioptre_by_count[1] = 0;
}

void set_mount(int side, zoom_camera &camera) {
    const Mount &truth = mounts[side];
    camera.mount[ZOOM_AXIS_DIRECTION_X] = truth.axis_direction.x;
    camera.mount[ZOOM_AXIS_DIRECTION_Z] = truth.axis_direction.z;
    camera.mount[ZOOM_AXIS_POINT_X] = truth.axis_point_mm.x;
    camera.mount[ZOOM_AXIS_POINT_Z] = truth.axis_point_mm.z;
    // The rotation vector of a small turn, from its matrix.
    const Matrix R = turn_of(truth.turn_deg);
    const double sine[3] = {(R[7] - R[5]) / 2, (R[2] - R[6]) / 2, (R[3] - R[1]) / 2};
    const double length = std::hypot(sine[0], sine[1], sine[2]);
    const double pupil_mm[3] = {truth.pupil_mm.x, truth.pupil_mm.y, truth.pupil_mm.z};
    for (int i = 0; i < 3; i++) {
        camera.mount[ZOOM_ROTATION_X + i] = length > 0 ? sine[i] * std::asin(length) / length : 0;
        camera.mount[ZOOM_POSITION_X + i] = pupil_mm[i];
    }
}

// Standard deviations such as a good capture leaves: 0.02 % of f, 0.5 px, 0.1 mm, 0.01 mrad.
void set_covariance(zoom_calibration &result) {
    double *parameter[ZOOM_PARAMETERS_MAX];
    result.parameters = zoom_parameter_list(result.camera, parameter);
    for (int i = 0; i < result.parameters; i++) {
        double sigma = 1e-5;
        for (const zoom_camera &camera : result.camera) {
            const zoom_function *functions = camera.function;
            const auto *address = reinterpret_cast<const char *>(parameter[i]);
            const auto *first = reinterpret_cast<const char *>(functions);
            if (address >= first && address < first + sizeof camera.function) {
                static const double sigmas[ZOOM_FUNCTIONS] = {0.5,  1e-4, 0.2,  0.2,  0.05,
                                                              0.05, 0.05, 0.05, 0.05, 0.1};
                sigma = sigmas[static_cast<size_t>(address - first) / sizeof(zoom_function)];
            }
            for (const int at : {ZOOM_AXIS_POINT_X, ZOOM_AXIS_POINT_Z, ZOOM_POSITION_X,
                                 ZOOM_POSITION_Y, ZOOM_POSITION_Z}) {
                sigma = parameter[i] == &camera.mount[at] ? 0.1 : sigma;
            }
        }
        result.covariance[i * (i + 1) / 2 + i] = sigma * sigma;
    }
}

}  // namespace

Camera camera_at(int side, double zoom, double focus, double pan_rad, bool ripple) {
    const Lens &from = lenses[side];
    const Mount &at = mounts[side];
    const double z = share(zoom), f_mm = focal_mm(side, zoom, ripple);
    const double per_mm = share(focus) / from.nearest_focus_mm + from.focus_drift_per_m * z / 1000;
    Camera camera;
    camera.width = kColumns;
    camera.height = kRows;
    camera.fx = camera.fy = f_mm / (1 - f_mm * per_mm) / kPixelMm;
    const double turn = 1.5 * kPi * z;
    camera.cx =
        (kColumns - 1) / 2.0 + from.centre_offset_px[0] + from.centre_wander_px[0] * std::sin(turn);
    camera.cy = (kRows - 1) / 2.0 + from.centre_offset_px[1] +
                from.centre_wander_px[1] * (1 - std::cos(turn));
    const double slope2 = std::pow(kCornerPx / camera.fx, 2);
    const auto radial = [&](int i) {
        return blend(from.distortion_wide[i], from.distortion_tele[i], z);
    };
    camera.k1 = radial(0) / slope2;
    camera.k2 = radial(1) / std::pow(slope2, 2);
    camera.k3 = radial(2) / std::pow(slope2, 3);
    const auto tangential = [&](int i) {
        return blend(from.decentring_wide_px[i], from.decentring_tele_px[i], z) /
               (camera.fx * slope2);
    };
    camera.p1 = tangential(0);
    camera.p2 = tangential(1);
    const Matrix pan =
        rotation_from_vector((pan_rad / norm(at.axis_direction)) * at.axis_direction);
    const Matrix turned = turn_of(at.turn_deg);
    camera.R_camera_world = transpose(pan * turned);
    const Vector pupil_mm = at.pupil_mm + turned * Vector{0, 0, from.pupil_travel_mm * z};
    camera.centre_mm = at.axis_point_mm + pan * (pupil_mm - at.axis_point_mm);
    return camera;
}

std::unique_ptr<zoom_calibration> calibration() {
    auto result = std::make_unique<zoom_calibration>();
    std::strcpy(result->id, "default-rig");
    std::strcpy(result->instrument, "rig");
    result->scale_sigma = 2e-4;
    result->validation = {13, 156, 15600, 0, 0.15, 0.05, 3e-4, 0};
    for (int side = 0; side < 2; side++) {
        zoom_camera &camera = result->camera[side];
        camera.width_px = kColumns;
        camera.height_px = kRows;
        camera.radius_px = kCornerPx;
        camera.pixel_mm = kPixelMm;
        camera.pan_rad = {-20 * kPi / 180, 20 * kPi / 180};
        camera.reading_sigma_counts = 0.25;
        camera.drift_sigma_counts = 1;
        camera.pan_sigma_rad = 0.3 * kPi / 180;
        camera.creep_sigma_rad = 1e-6;
        set_lens(side, camera);
        set_mount(side, camera);
        camera.function[ZOOM_FOCAL].irregularity =
            lenses[side].ripple_mm / kPixelMm / std::sqrt(2.0);
    }
    set_covariance(*result);
    INVARIANT(zoom_calibration_validate(result.get(), nullptr) == ERROR_OK);
    return result;
}

zoom_state state(double zoom, double distance_mm) {
    zoom_state result{};
    const double pan_rad = std::atan2(125, distance_mm);
    for (int side = 0; side < 2; side++) {
        result.side[side].zoom_counts = zoom;
        result.side[side].focus_counts =
            300 + 550 * lenses[side].nearest_focus_mm *
                      (1 / distance_mm - lenses[side].focus_drift_per_m * share(zoom) / 1000);
        result.side[side].pan_rad = side == 0 ? pan_rad : -pan_rad;
    }
    return result;
}

}  // namespace zoom_rig
