// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibration_report/calibration_report_figures.hpp"

#include <algorithm>
#include <cmath>

#include "calib/base/rigid.hpp"
#include "calib/solve/uncertainty.hpp"
#include "core/error.h"
#include "core/math.h"
#include "stereo/geometry/geometry.h"

namespace {

calibration_pose pose_of(const calib::board &board, std::size_t capture,
                         const calib::rigid &T_camera_board) {
    const double middle_board_mm[3] = {0.5 * (board.columns - 1) * board.square_mm,
                                       0.5 * (board.rows - 1) * board.square_mm, 0};
    double middle_mm[3];
    calib::apply(T_camera_board, middle_board_mm, middle_mm);
    const double distance_mm = geometry_norm(middle_mm);
    const double normal[3] = {T_camera_board.R[2], T_camera_board.R[5], T_camera_board.R[8]};
    const double cosine = std::fabs(geometry_dot(normal, middle_mm)) / distance_mm;
    // The line of sight itself is inclined where the board is off the axis.
    const double across = std::atan2(normal[0], normal[2]) - std::atan2(middle_mm[0], middle_mm[2]);
    const double down = std::atan2(normal[1], normal[2]) - std::atan2(middle_mm[1], middle_mm[2]);
    return {capture, distance_mm, MATH_DEGREE_PER_RAD * std::acos(std::min(1.0, cosine)),
            MATH_DEGREE_PER_RAD * across, MATH_DEGREE_PER_RAD * down};
}

void count_corner(const calib::corner_residual_px &corner, calibration_camera_figures *figures) {
    const auto place = [](double at_px, int size_px, int areas) {
        return std::clamp(static_cast<int>((at_px + 0.5) / size_px * areas), 0, areas - 1);
    };
    figures->used++;
    figures->rms_px += corner.dx_px * corner.dx_px + corner.dy_px * corner.dy_px;
    figures->count[place(corner.y_px, figures->camera.height_px, CALIBRATION_AREAS_Y)]
                  [place(corner.x_px, figures->camera.width_px, CALIBRATION_AREAS_X)]++;
}

calibration_camera_figures collect_camera(const calib::observations &seen,
                                          const calib::solution &result, int camera) {
    calibration_camera_figures figures;
    figures.camera = result.camera[camera];
    for (const calib::corner_residual_px &corner : result.residuals) {
        if (corner.camera == camera) {
            figures.corners.push_back(&corner);
            if (corner.used) {
                count_corner(corner, &figures);
            }
        }
    }
    figures.rms_px = std::sqrt(figures.rms_px / std::max<double>(1, double(figures.used)));
    for (const auto &row : figures.count) {
        figures.empty_areas += static_cast<int>(std::count(std::begin(row), std::end(row), 0));
    }
    for (std::size_t i = 0; i < seen.captures.size(); i++) {
        if (result.board_known[i] && result.views[i][static_cast<std::size_t>(camera)].used) {
            const calib::rigid &T_left_board = result.T_left_board[i];
            figures.poses.push_back(pose_of(
                seen.target, i, camera == 0 ? T_left_board : result.T_right_left * T_left_board));
        }
    }
    return figures;
}

/// A corner that both cameras used.
struct shared_corner {
    std::size_t capture;
    int index;
    double ray[2][3];    // rays in each camera's frame
    double point_mm[3];  // point midway between the rays, left frame
};

/// Sorted by view and index, as the residuals are.
std::vector<shared_corner> share_corners(const calib::solution &result) {
    std::vector<shared_corner> shared;
    const auto &all = result.residuals;
    const auto key_less = [](const calib::corner_residual_px &a,
                             const calib::corner_residual_px &b) {
        return a.capture != b.capture ? a.capture < b.capture : a.index < b.index;
    };
    std::vector<calib::corner_residual_px> side[2];
    for (const calib::corner_residual_px &corner : all) {
        if (corner.used) {
            side[corner.camera].push_back(corner);
        }
    }
    std::sort(side[0].begin(), side[0].end(), key_less);
    std::sort(side[1].begin(), side[1].end(), key_less);
    const calib::rigid T_left_right = calib::inverse(result.T_right_left);
    for (const calib::corner_residual_px &left : side[0]) {
        const auto right = std::lower_bound(side[1].begin(), side[1].end(), left, key_less);
        if (right == side[1].end() || key_less(left, *right)) {
            continue;
        }
        shared_corner corner{left.capture, left.index, {}, {}};
        const double seen_px[2][2] = {{left.x_px, left.y_px}, {right->x_px, right->y_px}};
        const double origin_mm[3] = {0, 0, 0};
        double turned[3];
        geometry_midpoint middle;
        if (lens_ray(&result.camera[0], seen_px[0], corner.ray[0]) &&
            lens_ray(&result.camera[1], seen_px[1], corner.ray[1])) {
            geometry_rotate(T_left_right.R, corner.ray[1], turned);
            if (geometry_rays_midpoint(origin_mm, corner.ray[0], T_left_right.t_mm, turned,
                                       &middle)) {
                std::copy(middle.point_mm, middle.point_mm + 3, corner.point_mm);
                shared.push_back(corner);
            }
        }
    }
    return shared;
}

void collect_vertical(const calib::solution &result, const std::vector<shared_corner> &shared,
                      calibration_figures *figures) {
    figures->rectified_known = export_rectify(result.rig, &figures->rectified) == ERROR_OK;
    if (!figures->rectified_known) {
        return;
    }
    // In px of the raw images, regardless of the size of the rectified ones.
    const double f_px = 0.5 * (result.camera[0].fy_px + result.camera[1].fy_px);
    double sum = 0;
    for (const shared_corner &corner : shared) {
        double slope[2];
        for (int side = 0; side < 2; side++) {
            double rect[3];
            geometry_rotate(
                side == 0 ? figures->rectified.R_rect_left : figures->rectified.R_rect_right,
                corner.ray[side], rect);
            slope[side] = rect[1] / rect[2];
        }
        const double off_px = f_px * (slope[0] - slope[1]);
        figures->vertical_px.push_back(off_px);
        figures->vertical_max_px = std::max(figures->vertical_max_px, std::fabs(off_px));
        sum += off_px * off_px;
    }
    figures->vertical_rms_px =
        std::sqrt(sum / std::max<double>(1, double(figures->vertical_px.size())));
}

/// Sum of squares of the heights over the plane z = a x + b y + c of best fit; points in the frame
/// of a board near z = 0.
double off_plane_mm2(const std::vector<std::array<double, 3>> &points_mm) {
    double A[3][4] = {};
    for (const auto &p : points_mm) {
        const double row[4] = {p[0], p[1], 1, p[2]};
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 4; j++) {
                A[i][j] += row[i] * row[j];
            }
        }
    }
    for (int i = 0; i < 3; i++) {  // Gauss and Jordan; the matrix is positive definite
        if (!(A[i][i] > 0)) {
            return 0;
        }
        for (int j = 0; j < 3; j++) {
            const double factor = j == i ? 0 : A[j][i] / A[i][i];
            for (int k = i; k < 4; k++) {
                A[j][k] -= factor * A[i][k];
            }
        }
    }
    double sum = 0;
    for (const auto &p : points_mm) {
        const double off =
            p[2] - (A[0][3] / A[0][0] * p[0] + A[1][3] / A[1][1] * p[1] + A[2][3] / A[2][2]);
        sum += off * off;
    }
    return sum;
}

calibration_measured measure(const calib::board &board, const calib::solution &result,
                             const std::vector<shared_corner> &shared) {
    calibration_measured measured;
    double length_sum_mm = 0, error_sum_mm2 = 0, plane_sum_mm2 = 0;
    std::size_t begin = 0;
    while (begin < shared.size()) {
        const std::size_t capture = shared[begin].capture;
        const calib::rigid T_board_left = calib::inverse(result.T_left_board[capture]);
        std::vector<std::array<double, 3>> points_mm;
        std::vector<const double *> by_index(static_cast<std::size_t>(board.corner_count()));
        std::size_t end = begin;
        for (; end < shared.size() && shared[end].capture == capture; end++) {
            std::array<double, 3> in_board_mm;
            calib::apply(T_board_left, shared[end].point_mm, in_board_mm.data());
            points_mm.push_back(in_board_mm);
            by_index[static_cast<std::size_t>(shared[end].index)] = shared[end].point_mm;
        }
        const auto add_length = [&](const double *a, const double *b) {
            if (a != nullptr && b != nullptr) {
                const double length_mm = std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
                length_sum_mm += length_mm;
                error_sum_mm2 += (length_mm - board.square_mm) * (length_mm - board.square_mm);
                measured.lengths++;
            }
        };
        const std::size_t columns = static_cast<std::size_t>(board.columns);
        for (std::size_t i = 0; i < by_index.size(); i++) {
            add_length(by_index[i], (i + 1) % columns != 0 ? by_index[i + 1] : nullptr);
            add_length(by_index[i],
                       i + columns < by_index.size() ? by_index[i + columns] : nullptr);
        }
        if (points_mm.size() >= 6) {
            plane_sum_mm2 += off_plane_mm2(points_mm);
            measured.points += points_mm.size();
        }
        begin = end;
    }
    const double lengths = std::max<double>(1, double(measured.lengths));
    measured.square_mean_mm = length_sum_mm / lengths;
    measured.square_rms_mm = std::sqrt(error_sum_mm2 / lengths);
    measured.plane_rms_mm = std::sqrt(plane_sum_mm2 / std::max<double>(1, double(measured.points)));
    return measured;
}

}  // namespace

calibration_figures calibration_figures_collect(const calib::observations &seen,
                                                const calib::solution &result) {
    calibration_figures figures;
    figures.cameras = seen.cameras;
    for (int camera = 0; camera < seen.cameras; camera++) {
        figures.camera.push_back(collect_camera(seen, result, camera));
    }
    std::vector<double> distances_mm;
    for (const calibration_pose &pose : figures.camera[0].poses) {
        distances_mm.push_back(pose.distance_mm);
    }
    std::sort(distances_mm.begin(), distances_mm.end());
    figures.median_distance_mm = distances_mm.empty() ? 0 : distances_mm[distances_mm.size() / 2];
    if (seen.cameras == 2) {
        const std::vector<shared_corner> shared = share_corners(result);
        collect_vertical(result, shared, &figures);
        figures.measured = measure(seen.target, result, shared);
    }
    figures.hints = calibration_figures_hints(seen, result, figures);
    return figures;
}

double calibration_figures_sigma_px(const calib::solution &result, int camera, double x_px,
                                    double y_px, double distance_mm) {
    const double pixel_px[2] = {x_px, y_px};
    double c[3];
    if (result.errors == nullptr ||
        !result.errors->projection_covariance(camera, pixel_px, distance_mm, c)) {
        return -1;
    }
    const double middle = 0.5 * (c[0] + c[2]), half = 0.5 * (c[0] - c[2]);
    return std::sqrt(std::max(0.0, middle + std::sqrt(half * half + c[1] * c[1])));
}
