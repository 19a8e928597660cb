// SPDX-License-Identifier: Apache-2.0
/// Conversion between OpenCV's calibration and ours, and the chessboard pairs of OpenCV's samples.
#ifndef VERGENCE_TESTS_ORACLE_STEREO_RIG_HPP
#define VERGENCE_TESTS_ORACLE_STEREO_RIG_HPP

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "core/error.h"
#include "lent_table.hpp"
#include "stereo/geometry/calibration.h"
#include "stereo/geometry/rectify.h"

namespace stereo_rig {

inline cv::Mat camera_matrix(const lens &lens) {
    return (cv::Mat_<double>(3, 3) << lens.fx_px, 0, lens.cx_px, 0, lens.fy_px, lens.cy_px, 0, 0,
            1);
}

inline cv::Mat coefficients(const lens &lens) {
    return (cv::Mat_<double>(1, 5) << lens.k1, lens.k2, lens.p1, lens.p2, lens.k3);
}

inline lens make_lens(const cv::Mat &K, const cv::Mat &D, cv::Size size) {
    lens made = {};
    made.width_px = size.width;
    made.height_px = size.height;
    made.fx_px = K.at<double>(0, 0);
    made.fy_px = K.at<double>(1, 1);
    made.cx_px = K.at<double>(0, 2);
    made.cy_px = K.at<double>(1, 2);
    const cv::Mat d = D.reshape(1, 1);
    double *fields[] = {&made.k1, &made.k2, &made.p1, &made.p2, &made.k3};
    for (int i = 0; i < d.cols && i < 5; i++) {
        *fields[i] = d.at<double>(i);
    }
    return made;
}

inline cv::Mat rotation(const double R[9]) {
    return cv::Mat(3, 3, CV_64F, const_cast<double *>(R)).clone();
}

/// The new camera matrix of a rectified image.
inline cv::Mat rectified_matrix(const rectify_plan &plan, rectify_side side) {
    const double cx_px = side == RECTIFY_LEFT ? plan.cx_left_px : plan.cx_right_px;
    return (cv::Mat_<double>(3, 3) << plan.f_px, 0, cx_px, 0, plan.fy_px, plan.cy_px, 0, 0, 1);
}

using Table = lent_table;

/// Our rectification of a grey image; `spans` (may be null) receives one span per row.
inline cv::Mat rectified(const rectify_table &table, const cv::Mat &raw,
                         std::vector<rectify_span> *spans = nullptr) {
    const image_u8 view = {raw.data, raw.cols, raw.rows, static_cast<ptrdiff_t>(raw.step)};
    cv::Mat result(table.height_px, table.width_px, CV_8U);
    for (int y = 0; y < table.height_px; y++) {
        const rectify_span span = rectified_row(table, view, {}, y, result.ptr(y), nullptr);
        if (spans != nullptr) {
            spans->push_back(span);
        }
    }
    return result;
}

/// One recorded pair of a chessboard of 9 x 6 inner corners, 30 mm apart.
struct BoardPair {
    cv::Mat image[2];
    std::vector<cv::Point2f> corners[2];
};

inline const cv::Size board_size(9, 6);

inline bool find_corners(const cv::Mat &image, std::vector<cv::Point2f> *corners) {
    if (!cv::findChessboardCorners(image, board_size, *corners)) {
        return false;
    }
    cv::cornerSubPix(image, *corners, cv::Size(5, 5), cv::Size(-1, -1),
                     cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-5));
    return true;
}

/// The 13 pairs of OpenCV's samples.
inline std::vector<BoardPair> recorded_pairs() {
    std::vector<BoardPair> pairs;
    for (int number = 1; number <= 14; number++) {
        if (number == 10) {
            continue;  // not part of the set
        }
        BoardPair pair;
        for (int side = 0; side < 2; side++) {
            char name[32];
            std::snprintf(name, sizeof name, "/%s%02d.jpg", side == 0 ? "left" : "right", number);
            const std::string path = std::string(VERGENCE_OPENCV_SAMPLES) + name;
            pair.image[side] = cv::imread(path, cv::IMREAD_GRAYSCALE);
            INFO(path);
            REQUIRE(!pair.image[side].empty());
            REQUIRE(find_corners(pair.image[side], &pair.corners[side]));
        }
        pairs.push_back(pair);
    }
    return pairs;
}

/// OpenCV's calibration of the recorded pairs.
inline calibration calibrate(const std::vector<BoardPair> &pairs) {
    std::vector<cv::Point3f> board;
    for (int i = 0; i < board_size.area(); i++) {
        board.emplace_back(30.F * static_cast<float>(i % board_size.width),
                           30.F * static_cast<float>(i / board_size.width), 0.F);
    }
    const std::vector<std::vector<cv::Point3f>> boards(pairs.size(), board);
    std::vector<std::vector<cv::Point2f>> seen[2];
    for (const BoardPair &pair : pairs) {
        seen[0].push_back(pair.corners[0]);
        seen[1].push_back(pair.corners[1]);
    }
    const cv::Size size = pairs[0].image[0].size();
    cv::Mat K[2], D[2], R, T, E, F;
    for (int side = 0; side < 2; side++) {
        std::vector<cv::Mat> r, t;
        cv::calibrateCamera(boards, seen[side], size, K[side], D[side], r, t);
    }
    calibration rig = {};
    std::strcpy(rig.id, "opencv-samples");
    rig.rms_px = cv::stereoCalibrate(boards, seen[0], seen[1], K[0], D[0], K[1], D[1], size, R, T,
                                     E, F, cv::CALIB_USE_INTRINSIC_GUESS);
    rig.left = make_lens(K[0], D[0], size);
    rig.right = make_lens(K[1], D[1], size);
    cv::Mat r_rad;
    cv::Rodrigues(R, r_rad);
    for (int i = 0; i < 3; i++) {
        rig.rotation_right_left_rad[i] = r_rad.at<double>(i);
        rig.translation_right_left_mm[i] = T.at<double>(i);
    }
    return rig;
}

/// Element at share p of a list, 0..1.
inline double percentile(std::vector<double> values, double p) {
    REQUIRE(!values.empty());
    std::sort(values.begin(), values.end());
    return values[static_cast<size_t>(p * static_cast<double>(values.size() - 1) + 0.5)];
}

}  // namespace stereo_rig

#endif
