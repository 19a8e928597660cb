// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate/calibrate_result.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "core/crc.h"
#include "core/error.h"
#include "stereo/geometry/geometry.h"
#include "stereo/geometry/lens.h"
#include "tools/host/calibrate/calibrate_views.hpp"
#include "tools/host/convert/calibration_file.hpp"
#include "tools/host/formats/report_text.hpp"

namespace {

const size_t corners_listed = 12;

/// The axes of both rectified cameras, in the left frame: x along the baseline, z the mean view.
struct rectified_axes {
    double x[3], y[3], z[3];
};

rectified_axes axes_of(const calib::rigid &T_right_left) {
    const double *R = T_right_left.R, *t = T_right_left.t_mm;
    rectified_axes axes;
    double mean_view[3];
    for (int i = 0; i < 3; i++) {
        // Direction to the right camera.
        axes.x[i] = -(R[i] * t[0] + R[3 + i] * t[1] + R[6 + i] * t[2]);
        mean_view[i] = R[6 + i] + (i == 2 ? 1 : 0);
    }
    geometry_cross(mean_view, axes.x, axes.y);
    const double x = geometry_norm(axes.x), y = geometry_norm(axes.y);
    for (int i = 0; i < 3; i++) {
        axes.x[i] /= x;
        axes.y[i] /= y;
    }
    geometry_cross(axes.x, axes.y, axes.z);
    return axes;
}

/// Row of a pixel in the rectified camera of focal length 1; false where it has no ray.
bool rectified_row(const calib::solution &solution, const rectified_axes &axes, int camera,
                   const calib::corner_residual_px &seen, double *row) {
    const double pixel[2] = {seen.x_px, seen.y_px};
    double ray[3];
    if (!lens_ray(&solution.camera[camera], pixel, ray)) {
        return false;
    }
    if (camera == 1) {
        const double *R = solution.T_right_left.R;
        const double right[3] = {ray[0], ray[1], ray[2]};
        for (int i = 0; i < 3; i++) {
            ray[i] = R[i] * right[0] + R[3 + i] * right[1] + R[6 + i] * right[2];
        }
    }
    *row = geometry_dot(axes.y, ray) / geometry_dot(axes.z, ray);
    return true;
}

uint32_t crc_of_corners(const calib::observations &seen) {
    uint32_t crc = 0;
    const double square[2] = {seen.target.square_mm, seen.target.marker_mm};
    crc = crc_update(crc, square, sizeof square);
    for (const calib::capture &capture : seen.captures) {
        for (const calib::board_view &view : capture.view) {
            for (const calib::corner &corner : view.corners) {
                const double numbers[3] = {double(corner.index), corner.x_px, corner.y_px};
                crc = crc_update(crc, numbers, sizeof numbers);
            }
        }
    }
    return crc;
}

std::string lens_text(const calib::solution &solution, int camera) {
    const lens &lens = solution.camera[camera];
    const auto place = static_cast<size_t>(camera);
    return "f " + number_text_with_sigma(lens.fx_px, solution.sigma.focal_px[place]) +
           " px, centre " + number_text_with_sigma(lens.cx_px, solution.sigma.centre_x_px[place]) +
           ", " + number_text_with_sigma(lens.cy_px, solution.sigma.centre_y_px[place]) + " px";
}

std::string board_text(const calib::solution &solution) {
    return solution.target.count() == 0
               ? std::string()
               : std::string(", board ") + calib::board_model_name(solution.target);
}

const std::string &name_of(const calibrate_result &result, size_t shot, int camera) {
    return result.views->seen.captures[shot].name[static_cast<size_t>(camera)];
}

/// Pictures with the same reason on one line.
std::vector<std::string> grouped(const calibrate_result &result,
                                 const std::vector<calibrate_rejection> &rejections) {
    std::vector<std::pair<std::string, std::vector<std::string>>> groups;
    for (const calibrate_rejection &one : rejections) {
        const auto same = std::find_if(groups.begin(), groups.end(), [&](const auto &group) {
            return group.first == one.reason;
        });
        auto &group = same == groups.end() ? groups.emplace_back(one.reason, 0) : *same;
        group.second.push_back(name_of(result, one.shot, one.camera));
    }
    std::vector<std::string> lines;
    for (const auto &[reason, names] : groups) {
        std::string text;
        const size_t shown = std::min<size_t>(names.size(), 3);
        for (size_t i = 0; i < shown; i++) {
            text += (i > 0 ? ", " : "") + names[i];
        }
        if (names.size() > shown) {
            text += report_text_format(" and %zu more", names.size() - shown);
        }
        lines.push_back(text + ": " + reason);
    }
    return lines;
}

}  // namespace

calibrate_rows calibrate_rows_of(const calib::solution &solution) {
    const rectified_axes axes = axes_of(solution.T_right_left);
    std::map<std::pair<size_t, int>, double> left;
    calibrate_rows rows;
    double squares = 0;
    const double focal_px = (solution.camera[0].fy_px + solution.camera[1].fy_px) / 2;
    for (const calib::corner_residual_px &one : solution.residuals) {
        double row;
        if (!one.used || !rectified_row(solution, axes, one.camera, one, &row)) {
            continue;
        }
        const std::pair<size_t, int> key(one.capture, one.index);
        if (one.camera == 0) {
            left[key] = row;
        } else if (left.count(key) > 0) {
            const double off_px = focal_px * std::fabs(row - left[key]);
            squares += off_px * off_px;
            rows.max_px = std::max(rows.max_px, off_px);
            rows.corners++;
        }
    }
    rows.rms_px = rows.corners > 0 ? std::sqrt(squares / rows.corners) : 0;
    return rows;
}

std::string calibrate_not_good_note(const std::string &reason, const std::string &note) {
    std::string text = "NOT GOOD: " + reason + (note.empty() ? "" : "; " + note);
    if (text.size() >= CALIBRATION_NOTE_BYTES) {
        text.resize(CALIBRATION_NOTE_BYTES - 1);
        text.resize(text.find_last_not_of(' ') + 1);  // a note has no blanks at its ends
    }
    return text;
}

bool calibrate_rig_name(const std::string &id, const std::string &date, const std::string &note,
                        calibrate_result *result, std::string *error) {
    calibration &rig = result->rig;
    const calibration_origin origin = rig.origin;  // found before
    rig = result->solution->rig;
    rig.has_origin = true;
    rig.origin = origin;
    calibrate_sigmas_of(*result->solution, &rig);
    const std::string made = report_text_format(
        "calibration-%08x", static_cast<unsigned>(crc_of_corners(result->views->seen)));
    std::snprintf(rig.id, sizeof rig.id, "%s", id.empty() ? made.c_str() : id.c_str());
    std::snprintf(rig.date, sizeof rig.date, "%s", date.c_str());
    std::string text = note;
    if (!result->solution->verdict.good) {
        const std::string reason = result->solution->verdict.reasons.empty()
                                       ? "see calibration.json"
                                       : result->solution->verdict.reasons[0];
        text = calibrate_not_good_note(reason, note);
    }
    std::snprintf(rig.note, sizeof rig.note, "%s", text.c_str());
    calibration_fault fault{};
    const int code = calibration_file_settle(&rig, &fault);
    if (code != ERROR_OK) {
        *error = "the calibration found cannot be used: " + calibration_file_explain(code, fault);
        return false;
    }
    return true;
}

std::string calibrate_result_text(const calibrate_result &result) {
    const calib::solution &solution = *result.solution;
    const calibrate_views &views = *result.views;
    const bool pair = views.seen.cameras == 2;
    std::string text =
        report_text_format("pictures    %d, a board in %d", views.pictures, views.boards);
    text += pair ? report_text_format(", %d pairs used\n", solution.pairs_used) : "\n";
    for (int camera = 0; camera < views.seen.cameras; camera++) {
        text += report_text_format("%-12s%s\n", pair ? side_name[camera] : "camera",
                                   lens_text(solution, camera).c_str());
    }
    text += report_text_format("lens model  %s%s\n", calib::lens_model_name(solution.model),
                               board_text(solution).c_str());
    if (pair) {
        text += "baseline    " +
                number_text_with_sigma(geometry_norm(solution.T_right_left.t_mm),
                                       solution.sigma.baseline_mm) +
                " mm\n";
    }
    if (solution.length.sigma_mm > 0) {
        text += report_text_format("length      %.0f mm at %.0f mm known to +- %.2g mm\n",
                                   solution.length.length_mm, solution.length.distance_mm,
                                   solution.length.sigma_mm);
    }
    text += report_text_format("fit         %.3f px rms per point", solution.rms_px);
    text += solution.held_out_rms_px > 0
                ? report_text_format(", %.3f px on boards held out\n", solution.held_out_rms_px)
                : "\n";
    if (pair) {
        text += report_text_format(
            "rows        %.3f px rms apart after rectification, %.2f px at most\n",
            result.rows.rms_px, result.rows.max_px);
    }
    return text;
}

std::vector<std::string> calibrate_result_overexposed(const calibrate_result &result) {
    std::vector<calibrate_rejection> overexposed;
    const auto &captures = result.views->seen.captures;
    for (size_t shot = 0; shot < captures.size(); shot++) {
        for (int camera = 0; camera < result.views->seen.cameras; camera++) {
            if (captures[shot].view[static_cast<size_t>(camera)].overexposed()) {
                overexposed.push_back({shot, camera,
                                       "most of the white of the board is overexposed, which moves "
                                       "corners: expose less"});
            }
        }
    }
    return grouped(result, overexposed);
}

std::string calibrate_result_layout(const calibrate_result &result) {
    int white_first = 0, boards = 0, open = 0;
    for (const calib::capture &capture : result.views->seen.captures) {
        for (const calib::board_view &view : capture.view) {
            white_first += view.white_first ? 1 : 0;
            boards += view.corners.empty() ? 0 : 1;
            open += view.layout_open ? 1 : 0;
        }
    }
    if (white_first > 0) {
        return report_text_format(
            "the coded board has the layout of OpenCV before 4.6: its top left square is white "
            "(%d pictures)",
            white_first);
    }
    return open == 0 || open < boards
               ? ""
               : "no picture shows whether the coded board has the layout of OpenCV before 4.6 or "
                 "the present one: corners are numbered by the present one, which does not change "
                 "the calibration (to decide it, take one picture of the whole board)";
}

std::vector<std::string> calibrate_result_rejections(const calibrate_result &result) {
    std::vector<std::string> lines = grouped(result, result.views->rejections);
    for (const calib::rejected_view &view : result.solution->rejected_views) {
        lines.push_back(name_of(result, view.capture, view.camera) + ": " + view.reason +
                        (view.repaired ? " (mended)" : " (left out)"));
    }
    std::vector<calib::rejected_corner> corners = result.solution->rejected_corners;
    std::stable_sort(corners.begin(), corners.end(),
                     [](const auto &a, const auto &b) { return a.off_px > b.off_px; });
    for (size_t i = 0; i < std::min(corners.size(), corners_listed); i++) {
        const calib::rejected_corner &corner = corners[i];
        lines.push_back(name_of(result, corner.capture, corner.camera) +
                        report_text_format(": corner %d ", corner.index) + corner.reason +
                        " (left out)");
    }
    if (corners.size() > corners_listed) {
        lines.push_back(
            report_text_format("%zu more corners are left out; calibration.json lists them",
                               corners.size() - corners_listed));
    }
    return lines;
}
