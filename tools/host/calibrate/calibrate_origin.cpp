// SPDX-License-Identifier: Apache-2.0
// What the pairs of a calibration were taken with, and the uncertainty they leave.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "calib/solve/uncertainty.hpp"
#include "stereo/geometry/geometry.h"
#include "tools/host/calibrate/calibrate_result.hpp"
#include "tools/host/calibrate/calibrate_views.hpp"
#include "tools/host/formats/report_text.hpp"

namespace {

/// The pairs whose corners count.
std::vector<const calibrate_shot *> used(const std::vector<calibrate_shot> &shots,
                                         const calib::solution &solution) {
    std::vector<const calibrate_shot *> list;
    for (size_t i = 0; i < shots.size() && i < solution.views.size(); i++) {
        if (solution.views[i][0].used || solution.views[i][1].used) {
            list.push_back(&shots[i]);
        }
    }
    return list;
}

std::string differ_text(const std::string &what, const calibrate_shot &a, const std::string &at_a,
                        const calibrate_shot &b, const std::string &at_b) {
    return what + " differs between the pairs: " + at_a + " in " + a.path[0] + ", " + at_b +
           " in " + b.path[0] + ": take all pairs of a calibration at one position";
}

std::string value_text(double value, int axis) {
    return report_text_format(axis == CALIBRATION_PAN ? "%.3f %s" : "%.1f %s", value,
                              calibration_reply_axis_unit(axis));
}

/// Mean and spread of one axis over all pairs.
bool join_axis(const std::vector<const calibrate_shot *> &shots, size_t side, int axis,
               calibration_axis *joined, std::string *error) {
    const auto axis_of = [&](const calibrate_shot *shot) -> const calibration_axis & {
        return shot->state->origin.side[side].axis[axis];
    };
    const auto kind = axis_of(shots[0]).kind;
    const bool alike = std::all_of(shots.begin(), shots.end(),
                                   [&](const auto *shot) { return axis_of(shot).kind == kind; });
    *joined = {alike ? kind : CALIBRATION_AXIS_UNKNOWN, 0, 0};
    if (joined->kind != CALIBRATION_AXIS_KNOWN) {
        return true;
    }
    const auto less = [&](const auto *a, const auto *b) {
        return axis_of(a).mean < axis_of(b).mean;
    };
    const auto [low, high] = std::minmax_element(shots.begin(), shots.end(), less);
    if (calibration_match_is_apart(&shots[0]->state->instrument, axis, axis_of(*high).mean,
                                   axis_of(*low).mean)) {
        *error = differ_text(std::string(side_name[side]) + " " + calibration_reply_axis_name(axis),
                             **low, value_text(axis_of(*low).mean, axis), **high,
                             value_text(axis_of(*high).mean, axis));
        return false;
    }
    double sum = 0;
    for (const auto *shot : shots) {
        sum += axis_of(shot).mean;
    }
    joined->mean = sum / static_cast<double>(shots.size());
    for (const auto *shot : shots) {
        joined->spread = std::max(joined->spread, std::fabs(axis_of(shot).mean - joined->mean));
    }
    return true;
}

std::string window_text(const calibration_window &window) {
    return report_text_format("column %d, row %d, skip %d", window.column_px, window.row_px,
                              window.skip);
}

/// Names and windows must match the first pair's.
bool same_cameras(const calibrate_shot &first, const calibrate_shot &other, std::string *error) {
    const calibration_origin &a = first.state->origin, &b = other.state->origin;
    if (std::strcmp(a.instrument, b.instrument) != 0) {
        *error = differ_text("the instrument", first, a.instrument, other, b.instrument);
        return false;
    }
    for (size_t side = 0; side < 2; side++) {
        const calibration_side_origin &one = a.side[side], &two = b.side[side];
        const std::string name = side_name[side];
        if (std::strcmp(one.camera, two.camera) != 0) {
            *error = differ_text("the " + name + " camera", first, one.camera, other, two.camera);
            return false;
        }
        if (std::memcmp(&one.window, &two.window, sizeof one.window) != 0) {
            *error = differ_text("the " + name + " window", first, window_text(one.window), other,
                                 window_text(two.window));
            return false;
        }
    }
    return true;
}

}  // namespace

bool calibrate_origin_of(const std::vector<calibrate_shot> &shots, const calib::solution &solution,
                         calibration_origin *origin, std::string *error) {
    const std::vector<const calibrate_shot *> list = used(shots, solution);
    *origin = calibration_origin{};
    const auto is_bare = [](const auto *shot) { return shot->state == nullptr; };
    if (list.empty() || std::any_of(list.begin(), list.end(), is_bare)) {
        return true;
    }
    *origin = list[0]->state->origin;
    for (const calibrate_shot *shot : list) {
        if (!same_cameras(*list[0], *shot, error)) {
            return false;
        }
    }
    for (size_t side = 0; side < 2; side++) {
        for (int axis = 0; axis < CALIBRATION_AXES; axis++) {
            if (!join_axis(list, side, axis, &origin->side[side].axis[axis], error)) {
                return false;
            }
        }
    }
    return true;
}

std::vector<std::string> calibrate_origin_notes(const std::vector<calibrate_shot> &shots,
                                                const calibration_origin &origin) {
    std::vector<std::string> notes;
    for (size_t side = 0; side < 2; side++) {
        const auto has_servo = [&](const calibrate_shot &shot) {
            return shot.state != nullptr && shot.state->instrument.servo_q4_per_rad[side] > 0;
        };
        if (origin.side[side].axis[CALIBRATION_PAN].kind == CALIBRATION_AXIS_UNKNOWN &&
            std::any_of(shots.begin(), shots.end(), has_servo)) {
            notes.push_back(std::string(side_name[side]) +
                            " pan was not set when these pairs were taken, so a later pair cannot "
                            "be compared with it: \"pan\" first, then take them again");
        }
    }
    return notes;
}

void calibrate_sigmas_of(const calib::solution &solution, calibration *rig) {
    std::vector<double> depths_mm;
    for (size_t i = 0; i < solution.T_left_board.size(); i++) {
        if (solution.board_known[i] && solution.T_left_board[i].t_mm[2] > 0) {
            depths_mm.push_back(solution.T_left_board[i].t_mm[2]);
        }
    }
    rig->scale_sigma = rig->yaw_sigma_rad = 0;
    if (depths_mm.empty() || solution.errors == nullptr) {
        return;
    }
    const auto middle = depths_mm.begin() + static_cast<std::ptrdiff_t>(depths_mm.size() / 2);
    std::nth_element(depths_mm.begin(), middle, depths_mm.end());
    const double near_mm = *middle, far_mm = 2 * near_mm;
    const lens &left = solution.camera[0];
    const double pixel_px[2] = {(left.width_px - 1) / 2.0, (left.height_px - 1) / 2.0};
    double near_sigma_mm = 0, far_sigma_mm = 0;
    if (!solution.errors->depth_sigma(pixel_px, near_mm, &near_sigma_mm)) {
        return;
    }
    // sigma^2 = (scale z)^2 + (yaw z^2 / baseline)^2 at z and 2 z. Where the right camera does not
    // see the farther point, everything is attributed to the angle.
    const double n2 = near_sigma_mm * near_sigma_mm;
    const bool both = solution.errors->depth_sigma(pixel_px, far_mm, &far_sigma_mm);
    const double f2 = both ? far_sigma_mm * far_sigma_mm : 16 * n2;
    const double near2_mm2 = near_mm * near_mm;
    const double scale2 = (16 * n2 - f2) / (12 * near2_mm2);
    const double square2 = (f2 - 4 * n2) / (12 * near2_mm2 * near2_mm2);
    const double baseline_mm = geometry_norm(solution.T_right_left.t_mm);
    // Shares beyond 1 are useless and out of the text's range.
    rig->scale_sigma = std::min(1.0, std::sqrt(std::max(0.0, scale2)));
    rig->yaw_sigma_rad = std::min(1.0, std::sqrt(std::max(0.0, square2)) * baseline_mm);
}
