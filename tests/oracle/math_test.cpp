// SPDX-License-Identifier: Apache-2.0
// Rotations and lenses compared with OpenCV's Rodrigues, projectPoints and undistortPoints.
#include <doctest/doctest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>

#include "oracle/stereo_rig.hpp"
#include "random_rig.hpp"
#include "synthetic/seed.hpp"

using random_rig::uniform;

TEST_CASE("rotations against cv::Rodrigues") {
    random_rig::Random random(synthetic::test_seed());
    for (int i = 0; i < 2000; i++) {
        double r_rad[3], R[9];
        for (double &r : r_rad) {
            r = uniform(random, -1.8, 1.8) * (i % 4 == 0 ? 1e-6 : 1);
        }
        geometry_rotation_from_vector(r_rad, R);
        cv::Mat theirs, back;
        cv::Rodrigues(cv::Mat(3, 1, CV_64F, r_rad), theirs);
        REQUIRE(cv::norm(theirs, stereo_rig::rotation(R), cv::NORM_INF) < 1e-14);
        double again_rad[3];
        REQUIRE(geometry_vector_from_rotation(R, again_rad) == ERROR_OK);
        cv::Rodrigues(stereo_rig::rotation(R), back);
        // OpenCV computes the angle with an arc cosine, which is accurate to 1e-5 near pi.
        if (geometry_norm(r_rad) < 3.1) {  // the vector differs beyond pi
            REQUIRE(cv::norm(back, cv::Mat(3, 1, CV_64F, again_rad), cv::NORM_INF) < 1e-5);
        }
    }
}

TEST_CASE("projection and its inverse against OpenCV") {
    random_rig::Random random(synthetic::test_seed());
    double max_px = 0, max_back = 0;
    for (int i = 0; i < 200; i++) {
        const double f_px = 500 * std::pow(54.0, uniform(random, 0, 1));
        const lens bent = random_rig::make_lens(random, 2048, 1536, f_px);
        const cv::Mat K = stereo_rig::camera_matrix(bent), D = stereo_rig::coefficients(bent);
        for (int k = 0; k < 20; k++) {
            const double pixel_px[2] = {uniform(random, 0, 2047), uniform(random, 0, 1535)};
            double ray[3], ours_px[2];
            REQUIRE(lens_ray(&bent, pixel_px, ray));
            const double point_mm[3] = {1700 * ray[0], 1700 * ray[1], 1700};
            REQUIRE(lens_project(&bent, point_mm, ours_px));
            std::vector<cv::Point2d> projected;
            cv::projectPoints(std::vector<cv::Point3d>{{point_mm[0], point_mm[1], point_mm[2]}},
                              cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), K, D, projected);
            max_px = std::max(max_px,
                              std::hypot(projected[0].x - ours_px[0], projected[0].y - ours_px[1]));
            std::vector<cv::Point2d> undistorted;
            cv::undistortPoints(
                std::vector<cv::Point2d>{{pixel_px[0], pixel_px[1]}}, undistorted, K, D,
                cv::noArray(), cv::noArray(),
                cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-12));
            max_back = std::max(
                max_back, f_px * std::hypot(undistorted[0].x - ray[0], undistorted[0].y - ray[1]));
        }
    }
    MESSAGE("projection differs by " << max_px << " px, its inverse by " << max_back << " px");
    CHECK(max_px < 1e-7);
    CHECK(max_back < 1e-4);
}
