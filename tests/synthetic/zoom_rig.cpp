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

constexpr double kPi = 3.14159265358979323846;
constexpr double kPixelMm = 0.0032;
constexpr int kColumns = 2048, kRows = 1536;
constexpr double kCornerPx = 1280;

double blend(double wide, double tele, double z) {
    return wide + (tele - wide) * z;
}

void multiply(const double a[9], const double b[9], double result[9]) {
    for (int i = 0; i < 9; i++) {
        result[i] = a[i / 3 * 3] * b[i % 3] + a[i / 3 * 3 + 1] * b[3 + i % 3] +
                    a[i / 3 * 3 + 2] * b[6 + i % 3];
    }
}

// Rotation about a unit axis.
void rotation(const double axis[3], double angle_rad, double result[9]) {
    const double c = std::cos(angle_rad), s = std::sin(angle_rad), d = 1 - c;
    const double x = axis[0], y = axis[1], z = axis[2];
    const double matrix[9] = {c + x * x * d,     x * y * d - z * s, x * z * d + y * s,
                              y * x * d + z * s, c + y * y * d,     y * z * d - x * s,
                              z * x * d - y * s, z * y * d + x * s, c + z * z * d};
    std::copy(matrix, matrix + 9, result);
}

void turn_of(const double turn_deg[3], double result[9]) {
    static const double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    double x[9], y[9], z[9], zy[9];
    rotation(axes[0], turn_deg[0] * kPi / 180, x);
    rotation(axes[1], turn_deg[1] * kPi / 180, y);
    rotation(axes[2], turn_deg[2] * kPi / 180, z);
    multiply(z, y, zy);
    multiply(zy, x, result);
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
        (truth_at(side, middle, 300, 0, false).f_px < f_px ? low : high) = middle;
    }
    return low;
}

void set_lens(int side, zoom_camera &camera) {
    const auto at_zoom = [&](double zoom) { return truth_at(side, zoom, 300, 0, false); };
    camera.zoom = camera.focus = {300, 850};
    camera.log_focal = {std::log(at_zoom(300).f_px), std::log(at_zoom(850).f_px)};
    const auto zoom_at = [&](double u) {
        const double middle = (camera.log_focal.min + camera.log_focal.max) / 2;
        return zoom_of(side, std::exp(middle + u * (camera.log_focal.max - middle)));
    };
    fit(camera.function[ZOOM_FOCAL], 4, [&](double u) { return at_zoom(575 + 275 * u).f_px; });
    const struct {
        zoom_function_name name;
        std::function<double(const camera_truth &)> value;
    } others[] = {
        {ZOOM_CENTRE_X, [](const camera_truth &t) { return t.centre_px[0]; }},
        {ZOOM_CENTRE_Y, [](const camera_truth &t) { return t.centre_px[1]; }},
        {ZOOM_RADIAL_2,
         [](const camera_truth &t) {
             return t.k[0] * std::pow(kCornerPx, 3) / std::pow(t.image_distance_px, 2);
         }},
        {ZOOM_RADIAL_4,
         [](const camera_truth &t) {
             return t.k[1] * std::pow(kCornerPx, 5) / std::pow(t.image_distance_px, 4);
         }},
        {ZOOM_RADIAL_6,
         [](const camera_truth &t) {
             return t.k[2] * std::pow(kCornerPx, 7) / std::pow(t.image_distance_px, 6);
         }},
        {ZOOM_TANGENTIAL_1,
         [](const camera_truth &t) {
             return t.p[0] * kCornerPx * kCornerPx / t.image_distance_px;
         }},
        {ZOOM_TANGENTIAL_2,
         [](const camera_truth &t) {
             return t.p[1] * kCornerPx * kCornerPx / t.image_distance_px;
         }},
        {ZOOM_PUPIL, [](const camera_truth &t) { return t.pupil_mm; }},
    };
    for (const auto &other : others) {
        fit(camera.function[other.name], ZOOM_TERMS_MAX,
            [&](double u) { return other.value(at_zoom(zoom_at(u))); });
    }
    // Linear in the focus position: 1 / nearest over its range.
    const double per_m = 1000 / lens[side].nearest_focus_mm;
    fit(camera.function[ZOOM_FOCUS_DIOPTRE], 6, [&](double u) {
        return per_m / 2 + lens[side].focus_drift_per_m * (zoom_at(u) - 300) / 550;
    });
    camera.focus_dioptre_by_count[0] = per_m / 2;
    camera.focus_dioptre_by_count[1] = 0;
}

void set_mount(int side, zoom_camera &camera) {
    const mount_truth &truth = mount[side];
    camera.mount[ZOOM_AXIS_DIRECTION_X] = truth.axis_direction[0];
    camera.mount[ZOOM_AXIS_DIRECTION_Z] = truth.axis_direction[2];
    camera.mount[ZOOM_AXIS_POINT_X] = truth.axis_point_mm[0];
    camera.mount[ZOOM_AXIS_POINT_Z] = truth.axis_point_mm[2];
    // The rotation vector of a small turn, from its matrix.
    double R[9];
    turn_of(truth.turn_deg, R);
    const double sine[3] = {(R[7] - R[5]) / 2, (R[2] - R[6]) / 2, (R[3] - R[1]) / 2};
    const double length = std::hypot(sine[0], sine[1], sine[2]);
    for (int i = 0; i < 3; i++) {
        camera.mount[ZOOM_ROTATION_X + i] = length > 0 ? sine[i] * std::asin(length) / length : 0;
        camera.mount[ZOOM_POSITION_X + i] = truth.pupil_mm[i];
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

const lens_truth lens[2] = {
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
const mount_truth mount[2] = {
    {{0, 0, 0}, {0, 0, 0}, {3.5, 0, -38}, {0.004, 1, -0.003}},
    {{250, 0.8, -0.5}, {0.15, -0.2, 0.25}, {247.1, 0, -39.5}, {-0.003, 1, 0.005}},
};

camera_truth truth_at(int side, double zoom, double focus, double pan_rad, bool ripple) {
    const lens_truth &from = lens[side];
    const double z = (zoom - 300) / 550;
    camera_truth result{};
    double f_mm = blend(from.wide_mm, from.tele_mm, z) + from.bow_mm * 4 * z * (1 - z);
    if (ripple) {
        f_mm += from.ripple_mm *
                std::sin(2 * kPi * from.ripple_periods * z + from.ripple_phase_deg * kPi / 180);
    }
    const double per_mm =
        (focus - 300) / 550 / from.nearest_focus_mm + from.focus_drift_per_m * z / 1000;
    const double image_mm = f_mm / (1 - f_mm * per_mm);
    result.f_px = f_mm / kPixelMm;
    result.image_distance_px = image_mm / kPixelMm;
    const double turn = 1.5 * kPi * z;
    result.centre_px[0] =
        (kColumns - 1) / 2.0 + from.centre_offset_px[0] + from.centre_wander_px[0] * std::sin(turn);
    result.centre_px[1] = (kRows - 1) / 2.0 + from.centre_offset_px[1] +
                          from.centre_wander_px[1] * (1 - std::cos(turn));
    const double slope = kCornerPx / result.image_distance_px;
    for (int i = 0; i < 3; i++) {
        result.k[i] =
            blend(from.distortion_wide[i], from.distortion_tele[i], z) / std::pow(slope, 2 * i + 2);
    }
    for (int i = 0; i < 2; i++) {
        result.p[i] = blend(from.decentring_wide_px[i], from.decentring_tele_px[i], z) /
                      (result.image_distance_px * slope * slope);
    }
    result.pupil_mm = from.pupil_travel_mm * z;
    const mount_truth &at = mount[side];
    double turned[9], pan[9], axis[3];
    turn_of(at.turn_deg, turned);
    const double length =
        std::hypot(at.axis_direction[0], at.axis_direction[1], at.axis_direction[2]);
    for (int i = 0; i < 3; i++) {
        axis[i] = at.axis_direction[i] / length;
    }
    rotation(axis, pan_rad, pan);
    multiply(pan, turned, result.R_world_camera);
    for (int i = 0; i < 3; i++) {
        result.position_mm[i] = at.axis_point_mm[i];
        for (int j = 0; j < 3; j++) {
            result.position_mm[i] +=
                pan[3 * i + j] *
                (at.pupil_mm[j] + turned[3 * j + 2] * result.pupil_mm - at.axis_point_mm[j]);
        }
    }
    return result;
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
        camera.function[ZOOM_FOCAL].irregularity = lens[side].ripple_mm / kPixelMm / std::sqrt(2.0);
    }
    set_covariance(*result);
    INVARIANT(zoom_calibration_validate(result.get(), nullptr) == ERROR_OK);
    return result;
}

zoom_state state(double zoom, double distance_mm) {
    zoom_state result{};
    const double pan_rad = std::atan2(125, distance_mm);
    for (int side = 0; side < 2; side++) {
        const double z = (zoom - 300) / 550;
        result.side[side].zoom_counts = zoom;
        result.side[side].focus_counts =
            300 + 550 * lens[side].nearest_focus_mm *
                      (1 / distance_mm - lens[side].focus_drift_per_m * z / 1000);
        result.side[side].pan_rad = side == 0 ? pan_rad : -pan_rad;
    }
    return result;
}

}  // namespace zoom_rig
