// SPDX-License-Identifier: Apache-2.0
// The detector compared with OpenCV: on the recorded pairs of opencv-doc, and on coded boards drawn
// by OpenCV.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/base/marker.hpp"
#include "calib/detect/detect.hpp"

namespace {

const cv::Size pattern(9, 6);
constexpr double square_mm = 30;

image_u8 view_of(cv::Mat &image) {
    return {image.data, image.cols, image.rows, static_cast<ptrdiff_t>(image.step)};
}

std::vector<cv::Point2f> points_of(const calib::board_view &view) {
    std::vector<cv::Point2f> points;
    for (const calib::corner &c : view.corners) {
        points.emplace_back(static_cast<float>(c.x_px), static_cast<float>(c.y_px));
    }
    return points;
}

std::vector<cv::Mat> recorded(const char *side) {
    std::vector<cv::Mat> images;
    for (const int number : {1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13, 14}) {
        char name[32];
        std::snprintf(name, sizeof name, "/%s%02d.jpg", side, number);
        images.push_back(
            cv::imread(std::string(VERGENCE_OPENCV_SAMPLES) + name, cv::IMREAD_GRAYSCALE));
        REQUIRE_FALSE(images.back().empty());
    }
    return images;
}

using corner_lists = std::vector<std::vector<cv::Point2f>>;

corner_lists ours(std::vector<cv::Mat> images) {
    calib::board board;
    board.columns = pattern.width;
    board.rows = pattern.height;
    board.square_mm = square_mm;
    corner_lists found;
    for (cv::Mat &image : images) {
        const calib::board_view view = calib::detect_board(board, view_of(image), {});
        CHECK(view.rejection == "");
        REQUIRE(view.corners.size() == 54);
        found.push_back(points_of(view));
    }
    return found;
}

// OpenCV's refinement, starting from our corners: with the window that worked best with its own
// finder.
corner_lists refined_by_opencv(const std::vector<cv::Mat> &images, corner_lists corners) {
    for (size_t i = 0; i < images.size(); i++) {
        cv::cornerSubPix(
            images[i], corners[i], cv::Size(5, 5), cv::Size(-1, -1),
            cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-4));
    }
    return corners;
}

// Root mean square over the points of all views, as OpenCV's stereo calibration counts it.
double stereo_rms_px(const corner_lists &left, const corner_lists &right) {
    std::vector<cv::Point3f> board;
    for (int i = 0; i < pattern.area(); i++) {
        board.emplace_back(static_cast<float>(i % pattern.width * square_mm),
                           static_cast<float>(i / pattern.width * square_mm), 0.0F);
    }
    const std::vector<std::vector<cv::Point3f>> boards(left.size(), board);
    const cv::Size size(640, 480);
    cv::Mat K[2], d[2], R, T, E, F;
    std::vector<cv::Mat> turns, places;
    cv::calibrateCamera(boards, left, size, K[0], d[0], turns, places, cv::CALIB_FIX_K3);
    cv::calibrateCamera(boards, right, size, K[1], d[1], turns, places, cv::CALIB_FIX_K3);
    return cv::stereoCalibrate(boards, left, right, K[0], d[0], K[1], d[1], size, R, T, E, F,
                               cv::CALIB_FIX_K3 | cv::CALIB_USE_INTRINSIC_GUESS);
}

}  // namespace

TEST_CASE("all 26 recorded views are found, numbered alike, and fit better than OpenCV's corners") {
    const std::vector<cv::Mat> left = recorded("left"), right = recorded("right");
    const corner_lists our_left = ours(left), our_right = ours(right);
    const corner_lists their_left = refined_by_opencv(left, our_left);
    const corner_lists their_right = refined_by_opencv(right, our_right);
    double square_sum = 0;
    for (size_t i = 0; i < left.size(); i++) {
        CAPTURE(i);
        for (const auto &[a, b] :
             {std::pair{&our_left[i], &their_left[i]}, std::pair{&our_right[i], &their_right[i]}}) {
            double sum = 0;
            for (size_t k = 0; k < a->size(); k++) {
                const cv::Point2f difference = (*a)[k] - (*b)[k];
                sum += static_cast<double>(difference.dot(difference)) / 2;
            }
            square_sum += sum;
            CHECK(std::sqrt(sum / 54) < 0.2);
        }
        // Both cameras have the same orientation: the first row runs the same way in both images.
        const cv::Point2f l = our_left[i][8] - our_left[i][0];
        CHECK(l.dot(our_right[i][8] - our_right[i][0]) > 0);
    }
    const double our_rms = stereo_rms_px(our_left, our_right);
    const double their_rms = stereo_rms_px(their_left, their_right);
    MESSAGE("apart by " << std::sqrt(square_sum / (26 * 54)) << " px rms; stereo RMS per point "
                        << our_rms << " px, with OpenCV's refinement " << their_rms << " px");
    CHECK(our_rms < 0.21);
    CHECK(our_rms < their_rms);
}

TEST_CASE("coded boards as OpenCV draws them") {
    for (const auto &size : {std::pair{9, 6}, {8, 5}, {6, 7}, {5, 4}}) {
        const int columns = size.first, rows = size.second;
        CAPTURE(columns);
        CAPTURE(rows);
        const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_100);
        const auto theirs =
            cv::aruco::CharucoBoard::create(columns + 1, rows + 1, 30.0F, 21.0F, dictionary);
        cv::Mat drawn, seen;
        theirs->draw(cv::Size(60 * (columns + 1) + 80, 60 * (rows + 1) + 80), drawn, 40);
        const cv::Mat turn = cv::getRotationMatrix2D(
            cv::Point2f(static_cast<float>(drawn.cols) / 2, static_cast<float>(drawn.rows) / 2),
            162, 0.8);
        cv::warpAffine(drawn, seen, turn, drawn.size(), cv::INTER_AREA, cv::BORDER_CONSTANT,
                       cv::Scalar(255));
        cv::GaussianBlur(seen, seen, cv::Size(0, 0), 0.8);

        calib::board board;
        board.columns = columns;
        board.rows = rows;
        board.square_mm = 30;
        board.dictionary = "5x5_100";
        board.marker_mm = 21;
        const calib::board_view view = calib::detect_board(board, view_of(seen), {});
        REQUIRE(view.rejection == "");
        REQUIRE(static_cast<int>(view.corners.size()) == board.corner_count());

        std::vector<std::vector<cv::Point2f>> markers;
        std::vector<int> ids;
        cv::aruco::detectMarkers(seen, cv::makePtr<cv::aruco::Dictionary>(*dictionary), markers,
                                 ids);
        cv::Mat corners, corner_ids;
        cv::aruco::interpolateCornersCharuco(markers, ids, seen, theirs, corners, corner_ids);
        REQUIRE(corner_ids.rows > 0);
        // Only the numbers are compared with OpenCV's: its positions are half a pixel off. Those of
        // cornerSubPix are not.
        for (int i = 0; i < corner_ids.rows; i++) {
            const calib::corner &c = view.corners[static_cast<size_t>(corner_ids.at<int>(i))];
            const cv::Point2f there = corners.at<cv::Point2f>(i);
            CHECK(std::hypot(c.x_px - static_cast<double>(there.x),
                             c.y_px - static_cast<double>(there.y)) < 1.5);
        }
        const std::vector<cv::Point2f> own = points_of(view);
        const std::vector<cv::Point2f> refined = refined_by_opencv({seen}, {own})[0];
        for (size_t i = 0; i < own.size(); i++) {
            CHECK(cv::norm(own[i] - refined[i]) < 0.1);
        }
    }
}
