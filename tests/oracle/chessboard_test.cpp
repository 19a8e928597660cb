// SPDX-License-Identifier: Apache-2.0
// The 13 recorded chessboard pairs: how well rows correspond after our rectification and after
// OpenCV's; and the measured board.
#include <doctest/doctest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "oracle/stereo_rig.hpp"
#include "stereo/geometry/triangulate.h"

namespace {

using namespace stereo_rig;

const rectify_options as_it_is = {0, 0, 1.0, 0, 0, 0, 0, 0, 0, false};

struct Board {
    std::vector<BoardPair> pairs;
    calibration rig;
    rectify_plan plan;
};

const Board &board() {
    static const Board made = [] {
        Board b;
        b.pairs = recorded_pairs();
        b.rig = calibrate(b.pairs);
        REQUIRE(rectify_plan_make(&b.rig, &as_it_is, &b.plan) == ERROR_OK);
        return b;
    }();
    return made;
}

// OpenCV's rectification of the same calibration.
struct Theirs {
    cv::Mat R[2], P[2], Q;
    cv::Size size;
};

Theirs their_rectification(const calibration &rig) {
    Theirs made;
    made.size = cv::Size(rig.left.width_px, rig.left.height_px);
    cv::Mat R;
    cv::Rodrigues(cv::Mat(3, 1, CV_64F, const_cast<double *>(rig.rotation_right_left_rad)), R);
    cv::stereoRectify(camera_matrix(rig.left), coefficients(rig.left), camera_matrix(rig.right),
                      coefficients(rig.right), made.size, R,
                      cv::Mat(3, 1, CV_64F, const_cast<double *>(rig.translation_right_left_mm)),
                      made.R[0], made.R[1], made.P[0], made.P[1], made.Q);
    return made;
}

void add_vertical(const std::vector<cv::Point2f> &left, const std::vector<cv::Point2f> &right,
                  double f_px, std::vector<double> *residuals) {
    for (size_t i = 0; i < left.size(); i++) {
        // In pixels of a focal length of 1000, so that both rectifications are measured alike.
        residuals->push_back(std::fabs(left[i].y - right[i].y) * 1000 / f_px);
    }
}

void check_not_worse(const std::string &what, const std::vector<double> &ours,
                     const std::vector<double> &theirs) {
    const double our_median = percentile(ours, 0.5), our_p95 = percentile(ours, 0.95);
    const double their_median = percentile(theirs, 0.5), their_p95 = percentile(theirs, 0.95);
    MESSAGE(what << ": |vertical disparity| median " << our_median << " (OpenCV " << their_median
                 << "), p95 " << our_p95 << " (OpenCV " << their_p95 << ") px at f = 1000, "
                 << ours.size() << " corners");
    CHECK(our_median <= their_median + 0.005);
    CHECK(our_p95 <= their_p95 + 0.005);
}

}  // namespace

TEST_CASE("corners of the raw images, mapped to the rectified ones") {
    const Board &b = board();
    CHECK(b.pairs.size() == 13);
    MESSAGE("calibration rms " << b.rig.rms_px << " px; plan " << b.plan.width_px << "x"
                               << b.plan.height_px << " f " << b.plan.f_px << ", disparities "
                               << b.plan.disparity_min << " + " << b.plan.disparity_count);
    const Theirs theirs = their_rectification(b.rig);
    std::vector<double> our_residuals, their_residuals;
    for (const BoardPair &pair : b.pairs) {
        std::vector<cv::Point2f> ours_at[2], theirs_at[2];
        for (int side = 0; side < 2; side++) {
            const lens &lens = side == 0 ? b.rig.left : b.rig.right;
            const rectify_side ours = side == 0 ? RECTIFY_LEFT : RECTIFY_RIGHT;
            cv::undistortPoints(pair.corners[side], ours_at[side], camera_matrix(lens),
                                coefficients(lens),
                                rotation(side == 0 ? b.plan.R_rect_left : b.plan.R_rect_right),
                                rectified_matrix(b.plan, ours));
            cv::undistortPoints(pair.corners[side], theirs_at[side], camera_matrix(lens),
                                coefficients(lens), theirs.R[side], theirs.P[side]);
        }
        add_vertical(ours_at[0], ours_at[1], b.plan.f_px, &our_residuals);
        add_vertical(theirs_at[0], theirs_at[1], theirs.P[0].at<double>(0, 0), &their_residuals);
    }
    check_not_worse("mapped corners", our_residuals, their_residuals);
}

TEST_CASE("the squares of the board are 30 mm") {
    const Board &b = board();
    triangulate_plan fixed;
    REQUIRE(triangulate_plan_make(&b.plan, nullptr, &fixed) == ERROR_OK);
    std::vector<double> errors_mm;
    for (const BoardPair &pair : b.pairs) {
        std::vector<cv::Point2f> at[2];
        for (int side = 0; side < 2; side++) {
            const lens &lens = side == 0 ? b.rig.left : b.rig.right;
            cv::undistortPoints(pair.corners[side], at[side], camera_matrix(lens),
                                coefficients(lens),
                                rotation(side == 0 ? b.plan.R_rect_left : b.plan.R_rect_right),
                                rectified_matrix(b.plan, side == 0 ? RECTIFY_LEFT : RECTIFY_RIGHT));
        }
        std::vector<cv::Point3d> points;
        for (size_t i = 0; i < at[0].size(); i++) {
            // Whole left pixels only: the corner's fraction is added to the principal point.
            rectify_plan moved = b.plan;
            const int x = static_cast<int>(std::floor(at[0][i].x));
            const int y = static_cast<int>(std::floor(at[0][i].y));
            moved.cx_left_px -= at[0][i].x - static_cast<float>(x);
            moved.cx_right_px -= at[0][i].x - static_cast<float>(x);
            moved.cy_px -= at[0][i].y - static_cast<float>(y);
            if (x < 0 || y < 0 || x >= b.plan.width_px || y >= b.plan.height_px) {
                points.emplace_back(NAN, NAN, NAN);
                continue;
            }
            REQUIRE(triangulate_plan_make(&moved, nullptr, &fixed) == ERROR_OK);
            triangulate_point point;
            const double disparity_px = at[0][i].x - at[1][i].x;
            REQUIRE(triangulate_match(
                &fixed, x, y, static_cast<int32_t>(std::lround(256 * disparity_px)), 0, &point));
            points.emplace_back(point.x_um * 1e-3, point.y_um * 1e-3, point.z_um * 1e-3);
        }
        for (int i = 0; i + 1 < board_size.area(); i++) {
            if (i % board_size.width != board_size.width - 1) {
                const size_t k = static_cast<size_t>(i);
                const double side_mm = cv::norm(points[k + 1] - points[k]);
                if (side_mm == side_mm) {
                    errors_mm.push_back(std::fabs(side_mm - 30));
                }
            }
        }
    }
    MESSAGE("side of a square: median error " << percentile(errors_mm, 0.5) << " mm, p95 "
                                              << percentile(errors_mm, 0.95) << " mm, "
                                              << errors_mm.size() << " sides");
    CHECK(percentile(errors_mm, 0.5) < 0.3);
    CHECK(percentile(errors_mm, 0.95) < 1.0);
}
