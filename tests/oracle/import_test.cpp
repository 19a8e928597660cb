// SPDX-License-Identifier: Apache-2.0
// Importers tested with files written by OpenCV, and compared with OpenCV's own camera model.
#include "tools/host/convert/import.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <random>
#include <string>

#include "core/error.h"
#include "import_files.hpp"
#include "stereo/geometry/geometry.h"
#include "synthetic/seed.hpp"
#include "tools/host/convert/calibration_file.hpp"

using import_files::folder;

namespace {

struct rig {
    cv::Mat M1, D1, M2, D2, R, T, R1, R2, P1, P2, Q;
    cv::Size size;
};

rig make_rig(std::mt19937_64 &random, int coefficients, double unit) {
    const auto uniform = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    rig made;
    made.size = cv::Size(640, 480);
    for (cv::Mat *M : {&made.M1, &made.M2}) {
        *M = (cv::Mat_<double>(3, 3) << uniform(500, 900), 0, uniform(300, 340), 0,
              uniform(500, 900), uniform(220, 260), 0, 0, 1);
    }
    for (cv::Mat *D : {&made.D1, &made.D2}) {
        *D = cv::Mat::zeros(1, coefficients, CV_64F);
        D->at<double>(0) = uniform(-0.2, 0.05);
        D->at<double>(1) = uniform(0, 0.1);
        D->at<double>(2) = uniform(-0.002, 0.002);
        D->at<double>(3) = uniform(-0.002, 0.002);
        if (coefficients > 4) {
            D->at<double>(4) = uniform(0, 0.05);
        }
    }
    const cv::Vec3d turn(uniform(-0.05, 0.05), uniform(-0.1, 0.1), uniform(-0.05, 0.05));
    cv::Rodrigues(turn, made.R);
    made.T = (cv::Mat_<double>(3, 1) << uniform(-300, -50) * unit, uniform(-5, 5) * unit,
              uniform(-5, 5) * unit);
    cv::stereoRectify(made.M1, made.D1, made.M2, made.D2, made.size, made.R, made.T, made.R1,
                      made.R2, made.P1, made.P2, made.Q, cv::CALIB_ZERO_DISPARITY, -1);
    return made;
}

/// The two files with the names and the order of OpenCV's stereo_calib.
void write_pair(const rig &from, const std::string &folder, const std::string &extension) {
    cv::FileStorage intrinsics(folder + "/intrinsics" + extension, cv::FileStorage::WRITE);
    intrinsics << "M1" << from.M1 << "D1" << from.D1 << "M2" << from.M2 << "D2" << from.D2;
    cv::FileStorage extrinsics(folder + "/extrinsics" + extension, cv::FileStorage::WRITE);
    extrinsics << "R" << from.R << "T" << from.T << "R1" << from.R1 << "R2" << from.R2 << "P1"
               << from.P1 << "P2" << from.P2 << "Q" << from.Q;
}

import_options with_size(const cv::Size &size) {
    import_options options;
    options.width_px = size.width;
    options.height_px = size.height;
    return options;
}

void check_close(double ours, double theirs, double tolerance) {
    CHECK(std::abs(ours - theirs) <= tolerance);
}

/// The decimals of the text limit the accuracy of an import.
void check_lens(const lens &camera, const cv::Mat &M, const cv::Mat &D, const cv::Size &size) {
    CHECK(camera.width_px == size.width);
    CHECK(camera.height_px == size.height);
    check_close(camera.fx_px, M.at<double>(0, 0), 6e-10);
    check_close(camera.fy_px, M.at<double>(1, 1), 6e-10);
    check_close(camera.cx_px, M.at<double>(0, 2), 6e-10);
    check_close(camera.cy_px, M.at<double>(1, 2), 6e-10);
    check_close(camera.k1, D.at<double>(0), 6e-13);
    check_close(camera.k2, D.at<double>(1), 6e-11);
    check_close(camera.p1, D.at<double>(2), 6e-13);
    check_close(camera.p2, D.at<double>(3), 6e-13);
    check_close(camera.k3, D.total() > 4 ? D.at<double>(4) : 0, 6e-9);
}

void check_pose(const calibration &value, const cv::Mat &R, const cv::Mat &T, double unit_mm,
                double tolerance_rad, double tolerance_mm) {
    cv::Vec3d turn;
    cv::Rodrigues(R, turn);
    for (int i = 0; i < 3; i++) {
        check_close(value.rotation_right_left_rad[i], turn[i], tolerance_rad);
        check_close(value.translation_right_left_mm[i], T.at<double>(i) * unit_mm, tolerance_mm);
    }
}

calibration load(const std::string &path, const import_options &options) {
    calibration value{};
    std::string message;
    const int code = calibration_file_load(path, options, &value, nullptr, &message);
    INFO(message);
    REQUIRE(code == ERROR_OK);
    return value;
}

std::string rejection(const std::string &path, const import_options &options, int code) {
    calibration value{};
    std::string message;
    CHECK(calibration_file_load(path, options, &value, nullptr, &message) == code);
    CHECK(message.find('\n') == std::string::npos);
    return message;
}

bool holds(const std::string &text, const std::string &part) {
    INFO(text);
    return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("OpenCV: the pair of files that stereo_calib writes, in all its formats") {
    std::mt19937_64 random(synthetic::test_seed());
    for (const std::string extension : {".yml", ".yaml", ".xml", ".json"}) {
        for (const int coefficients : {4, 5, 8, 14}) {
            const folder here;
            const rig made = make_rig(random, coefficients, 1);
            write_pair(made, here.path, extension);
            for (const std::string &name : {here.path, here.path + "/intrinsics" + extension,
                                            here.path + "/extrinsics" + extension,
                                            here.path + "/intrinsics" + extension + "," +
                                                here.path + "/extrinsics" + extension}) {
                INFO("name ", name);
                const calibration value = load(name, with_size(made.size));
                CHECK_FALSE(value.rectified);
                check_lens(value.left, made.M1, made.D1, made.size);
                check_lens(value.right, made.M2, made.D2, made.size);
                check_pose(value, made.R, made.T, 1, 1e-11, 6e-10);
                CHECK(holds(value.note, "mm"));
            }
        }
    }
}

TEST_CASE("OpenCV: other names, one file, size stated, metres") {
    std::mt19937_64 random(synthetic::test_seed() + 1);
    const struct {
        const char *M1, *D1, *M2, *D2, *R, *T;
    } names[] = {
        {"M1", "D1", "M2", "D2", "R", "T"},
        {"K1", "D1", "K2", "D2", "R", "T"},
        {"cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2", "R", "T"},
        {"camera_matrix_left", "dist_coeffs_left", "camera_matrix_right", "dist_coeffs_right",
         "rotation", "translation"},
        {"left_camera_matrix", "left_distortion_coefficients", "right_camera_matrix",
         "right_distortion_coefficients", "rotation_matrix", "translation_vector"},
        {"K_l", "D_l", "K_r", "D_r", "R", "t"},
        {"mtxL", "distL", "mtxR", "distR", "R", "T"},
        {"K0", "D0", "K1", "D1", "R", "T"},
        {"cameraMatrix0", "distCoeffs0", "cameraMatrix1", "distCoeffs1", "Rot", "Trns"},
    };
    for (const auto &name : names) {
        INFO("name ", std::string(name.M1));
        const folder here;
        const rig made = make_rig(random, 5, 1e-3);
        const std::string path = here.path + "/stereo.yml";
        cv::FileStorage file(path, cv::FileStorage::WRITE);
        file << "image_width" << made.size.width << "image_height" << made.size.height << name.M1
             << made.M1 << name.D1 << made.D1.t() << name.M2 << made.M2 << name.D2 << made.D2
             << name.R << made.R << name.T << made.T.t() << "rms" << 0.25;
        file.release();
        import_options options;
        CHECK(holds(rejection(path, options, ERROR_BASELINE), "--unit"));
        options.unit = "m";
        const calibration value = load(path, options);
        check_lens(value.left, made.M1, made.D1, made.size);
        check_lens(value.right, made.M2, made.D2, made.size);
        check_pose(value, made.R, made.T, 1000, 1e-11, 6e-10);
        CHECK(value.rms_px == 0.25);
    }
}

TEST_CASE("OpenCV: rotation vectors, single precision, rectified projections") {
    std::mt19937_64 random(7);
    const folder here;
    const rig made = make_rig(random, 5, 1);
    cv::Mat turn, M1_single;
    cv::Rodrigues(made.R, turn);
    made.M1.convertTo(M1_single, CV_32F);
    const std::string path = here.path + "/stereo.xml";
    cv::FileStorage file(path, cv::FileStorage::WRITE);
    file << "M1" << M1_single << "D1" << made.D1 << "M2" << made.M2 << "D2" << made.D2 << "R"
         << turn << "T" << made.T << "P1" << made.P1 << "P2" << made.P2;
    file.release();
    import_options options = with_size(made.size);
    check_pose(load(path, options), made.R, made.T, 1, 1e-11, 6e-10);
    options.rectified = true;
    const calibration value = load(path, options);
    CHECK(value.rectified);
    check_close(value.left.fx_px, made.P1.at<double>(0, 0), 6e-10);
    check_close(value.left.cx_px, made.P1.at<double>(0, 2), 6e-10);
    check_close(value.right.cx_px, made.P2.at<double>(0, 2), 6e-10);
    check_close(value.translation_right_left_mm[0], -cv::norm(made.T), 1e-8);
}

TEST_CASE("OpenCV: the rational model is taken as it is") {
    const folder here;
    std::mt19937_64 random(11);
    rig made = make_rig(random, 14, 1);
    const double rational[14] = {-0.068, 0.09, 0.0011, -0.0007, 0, 0, 0, -1.2583};
    for (cv::Mat *D : {&made.D1, &made.D2}) {
        *D = cv::Mat(1, 14, CV_64F, const_cast<double *>(rational)).clone();
    }
    made.M1 = (cv::Mat_<double>(3, 3) << 944.5, 0, 318.7, 0, 945.7, 241.9, 0, 0, 1);
    made.M2 = made.M1;
    write_pair(made, here.path, ".yml");
    const calibration value = load(here.path, with_size(made.size));
    double worst_px = 0;
    for (int j = 0; j < 48; j++) {
        for (int i = 0; i < 64; i++) {
            const double pixel_px[2] = {10.0 * i, 10.0 * j};
            double ray[3];
            REQUIRE(lens_ray(&value.left, pixel_px, ray));
            std::vector<cv::Point2d> projected;
            cv::projectPoints(std::vector<cv::Point3d>{{ray[0], ray[1], 1}}, cv::Vec3d(),
                              cv::Vec3d(), made.M1, made.D1, projected);
            worst_px = std::max(
                worst_px, std::hypot(projected[0].x - pixel_px[0], projected[0].y - pixel_px[1]));
        }
    }
    CHECK(worst_px < 1e-6);
    CHECK(value.left.kind == LENS_RATIONAL);
}

TEST_CASE("OpenCV: an entry with that word makes a pair fisheye") {
    const folder here;
    std::mt19937_64 random(12);
    rig made = make_rig(random, 14, 1);
    made.D1 = (cv::Mat_<double>(4, 1) << 0.01, -0.02, 0.003, 0.0004);
    made.D2 = made.D1;
    write_pair(made, here.path, ".yml");
    const calibration plain = load(here.path, with_size(made.size));
    CHECK(plain.left.kind == LENS_BROWN_CONRADY);
    CHECK(plain.left.p1 == 0.003);
    CHECK(holds(plain.note, "fisheye_model"));
    std::ofstream(here.path + "/intrinsics.yml", std::ios::app) << "fisheye_model: 1\n";
    const calibration fish = load(here.path, with_size(made.size));
    CHECK(fish.left.kind == LENS_EQUIDISTANT);
    CHECK(fish.right.k3 == 0.003);
    CHECK(fish.right.k4 == 0.0004);
    CHECK(fish.left.p1 == 0);
}

TEST_CASE("OpenCV: what cannot be represented is refused by name") {
    std::mt19937_64 random(13);
    const rig good = make_rig(random, 14, 1);
    const import_options options = with_size(good.size);
    const auto message = [&](auto change, int code) {
        const folder here;
        rig made = good;
        made.D1 = good.D1.clone();
        made.M2 = good.M2.clone();
        made.R = good.R.clone();
        made.T = good.T.clone();
        change(made);
        write_pair(made, here.path, ".yml");
        return rejection(here.path, options, code);
    };
    const auto at = [](cv::Mat &matrix, int i) -> double & { return matrix.at<double>(i); };
    CHECK(holds(message([&](rig &r) { at(r.D1, 9) = 0.1; }, ERROR_DISTORTION), "thin prism"));
    CHECK(holds(message([&](rig &r) { at(r.D1, 13) = 0.1; }, ERROR_DISTORTION), "tilted"));
    CHECK(holds(message([&](rig &r) { at(r.M2, 1) = 0.1; }, ERROR_RANGE), "M2: skew"));
    CHECK(holds(message([&](rig &r) { at(r.M2, 0) = -1; }, ERROR_RANGE), "M2"));
    CHECK(holds(message([&](rig &r) { at(r.M2, 0) = std::nan(""); }, ERROR_RANGE), "M2"));
    CHECK(holds(message([&](rig &r) { at(r.R, 0) = 0; }, ERROR_ROTATION), "R is not a rotation"));
    CHECK(holds(message([&](rig &r) { r.T = cv::Mat::zeros(3, 1, CV_64F); }, ERROR_BASELINE),
                "baseline"));
    CHECK(holds(message([&](rig &r) { r.T = cv::Mat::ones(4, 1, CV_64F); }, ERROR_SYNTAX), "T"));
    CHECK(holds(message([&](rig &r) { r.M2 = cv::Mat::eye(2, 3, CV_64F); }, ERROR_SYNTAX), "M2"));
    CHECK(holds(message([&](rig &r) { r.D1 = cv::Mat::zeros(1, 6, CV_64F); }, ERROR_SYNTAX), "D1"));
    CHECK(
        holds(message([&](rig &r) { r.D1 = cv::Mat::zeros(1, 5, CV_64FC2); }, ERROR_SYNTAX), "D1"));
    CHECK(holds(message([&](rig &r) { at(r.D1, 0) = -5; }, ERROR_DISTORTION), "left"));
    const folder here;
    write_pair(good, here.path, ".yml");
    std::filesystem::remove(here.path + "/extrinsics.yml");
    CHECK(
        holds(rejection(here.path + "/intrinsics.yml", options, ERROR_MISSING), "extrinsics.yml"));
    write_pair(good, here.path, ".yml");
    CHECK(holds(rejection(here.path, {}, ERROR_MISSING), "size"));
}

TEST_CASE("OpenCV: counts of rows and columns are whole numbers that there can be") {
    struct {
        const char *counts, *data;
    } const bad[] = {{"\"rows\": 0, \"cols\": 66029382473034409", ""},
                     {"\"rows\": 0.5, \"cols\": 2", "1"},
                     {"\"rows\": -1, \"cols\": -1", "1"},
                     {"\"rows\": 1, \"cols\": 1e300", "1"}};
    for (const auto &one : bad) {
        const folder here;
        std::ofstream(here.path + "/pair.json")
            << "{\"M1\": {\"type_id\": \"opencv-matrix\", " << one.counts
            << ", \"dt\": \"d\", \"data\": [" << one.data << "]}}";
        INFO(std::string(one.counts));
        CHECK(holds(rejection(here.path + "/pair.json", {}, ERROR_SYNTAX), "rows times cols"));
    }
}

TEST_CASE("OpenCV: its sample files") {
    const std::string samples = VERGENCE_OPENCV_SAMPLES;
    REQUIRE_MESSAGE(std::filesystem::exists(samples + "/left_intrinsics.yml"),
                    "Debian's opencv-doc is needed");
    const std::string one = samples + "/left_intrinsics.yml";
    CHECK(holds(rejection(one, {}, ERROR_MISSING), "one camera"));
    const folder here;
    const cv::Mat R = cv::Mat::eye(3, 3, CV_64F);
    const cv::Mat T = (cv::Mat_<double>(3, 1) << -60, 1, 0.5);
    const std::string pose = here.path + "/extrinsics.yml";
    {
        cv::FileStorage file(pose, cv::FileStorage::WRITE);
        file << "R" << R << "T" << T;
    }
    // Two files with one camera each, and the pose: the first is the left one.
    const calibration value = load(one + "," + one + "," + pose, {});
    CHECK(value.left.width_px == 640);
    CHECK(value.left.fx_px == doctest::Approx(535.91573396163199).epsilon(1e-12));
    CHECK(value.right.k1 == doctest::Approx(-0.26637260909660682).epsilon(1e-10));
    CHECK(value.right.p2 == doctest::Approx(-0.00028122100441115472).epsilon(1e-8));
    // The package's stereo intrinsics with that pose. Its left distortion folds over in the
    // corners, which must not be rejected.
    const auto text_of = [](const std::string &path) {
        std::ifstream stream(path, std::ios::binary);
        return std::string((std::istreambuf_iterator<char>(stream)),
                           std::istreambuf_iterator<char>());
    };
    const std::string both = samples + "/intrinsics.yml";
    const import_pair pair =
        import_opencv({{both, text_of(both)}, {pose, text_of(pose)}}, with_size({640, 480}));
    CHECK(pair.value.left.fx_px == 534.80326845051309);
    CHECK(pair.value.right.k2 == -0.11214173641213163);
    CHECK(pair.value.translation_right_left_mm[0] == -60);
    CHECK(lens_validate(&pair.value.left) == ERROR_OK);
}

TEST_CASE("ROS: raw pose recovered from what stereoRectify gives a camera_info pair") {
    std::mt19937_64 random(synthetic::test_seed() + 2);
    const auto list = [](const cv::Mat &matrix) {
        std::string text;
        char number[32];
        for (auto value = matrix.begin<double>(); value != matrix.end<double>(); ++value) {
            std::snprintf(number, sizeof number, "%.17g", *value);
            text += (text.empty() ? "" : ", ") + std::string(number);
        }
        return "[" + text + "]";
    };
    for (int i = 0; i < 50; i++) {
        const folder here;
        const rig made = make_rig(random, 5, 1e-3);  // camera_info is in metres
        const auto write = [&](const std::string &name, const cv::Mat &M, const cv::Mat &D,
                               const cv::Mat &R, const cv::Mat &P) {
            std::ofstream(here.path + "/" + name + ".yaml")
                << "image_width: 640\nimage_height: 480\ncamera_name: " << name
                << "\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: " << list(M)
                << "\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n"
                << "  data: " << list(D)
                << "\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: " << list(R)
                << "\nprojection_matrix:\n  rows: 3\n  cols: 4\n  data: " << list(P) << "\n";
        };
        write("left", made.M1, made.D1, made.R1, made.P1);
        write("right", made.M2, made.D2, made.R2, made.P2);
        const calibration value = load(here.path, {});
        check_lens(value.left, made.M1, made.D1, made.size);
        check_lens(value.right, made.M2, made.D2, made.size);
        check_pose(value, made.R, made.T, 1000, 1e-11, 1e-8);
    }
}
