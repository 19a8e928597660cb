// SPDX-License-Identifier: Apache-2.0
// Exported files read back through the importers, and reports of what a format cannot hold.
#include "tools/host/convert/export.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <filesystem>

#include "import_files.hpp"
#include "random_rig.hpp"
#include "stereo/geometry/geometry.h"
#include "stereo/geometry/rectify.h"
#include "synthetic/seed.hpp"

using namespace import_files;

namespace {

std::string exported(const calibration &value, const std::string &format, const folder &here) {
    std::vector<std::string> paths;
    std::string loss, message;
    const int code = export_write(value, format, here / format, &paths, &loss, &message);
    INFO(message);
    REQUIRE(code == ERROR_OK);
    for (const std::string &path : paths) {
        CHECK(std::filesystem::exists(path));
    }
    return here / format;
}

void check_same(const calibration &a, const calibration &b, double tolerance) {
    const double *first[] = {&a.left.fx_px, &a.right.fx_px};
    const double *second[] = {&b.left.fx_px, &b.right.fx_px};
    for (int side = 0; side < 2; side++) {
        for (int i = 0; i < 12; i++) {  // fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6
            CHECK(first[side][i] == second[side][i]);
        }
    }
    CHECK(a.left.kind == b.left.kind);
    CHECK(a.right.kind == b.right.kind);
    for (int i = 0; i < 3; i++) {
        CHECK(std::fabs(a.rotation_right_left_rad[i] - b.rotation_right_left_rad[i]) <= tolerance);
        CHECK(std::fabs(a.translation_right_left_mm[i] - b.translation_right_left_mm[i]) <=
              1e3 * tolerance);
    }
}

calibration random_calibration(random_rig::Random &random) {
    calibration rig = random_rig::make(random);
    std::strcpy(rig.id, "random");
    REQUIRE(calibration_round(&rig) == ERROR_OK);
    REQUIRE(calibration_validate(&rig, nullptr) == ERROR_OK);
    return rig;
}

lens without_k3(lens one) {
    one.k3 = 0;
    return one;
}

/// Distance between the image points of two lenses, over the image of the first.
double largest_difference_px(const lens &one, const lens &other) {
    double largest_px = 0;
    for (int row = 0; row < 40; row++) {
        for (int column = 0; column < 40; column++) {
            const double pixel_px[2] = {(one.width_px - 1) * column / 39.0,
                                        (one.height_px - 1) * row / 39.0};
            double ray[3], seen_px[2];
            if (lens_ray(&one, pixel_px, ray) &&
                std::hypot(ray[0], ray[1]) < lens_view_radius(&one) &&
                lens_project(&other, ray, seen_px)) {
                largest_px = std::max(
                    largest_px, std::hypot(seen_px[0] - pixel_px[0], seen_px[1] - pixel_px[1]));
            }
        }
    }
    return largest_px;
}

}  // namespace

TEST_CASE("a lens with k3 is approximated for Kalibr, and the reported error is true") {
    random_rig::Random random(synthetic::test_seed());
    for (int i = 0; i < 30; i++) {
        const folder here;
        const calibration rig = random_calibration(random);
        std::vector<export_file> files;
        std::string message;
        REQUIRE(export_files(rig, "kalibr", &files, &message) == ERROR_OK);
        INFO(files[0].loss);
        CHECK(files[0].text.find("# cam0: k3") == 0);
        CHECK(files[0].text.find("\n# cam1: k3") != std::string::npos);
        double rms_px = 0, max_px = 0;
        const size_t numbers = files[0].loss.find("off by ");
        REQUIRE(numbers != std::string::npos);
        REQUIRE(std::sscanf(files[0].loss.c_str() + numbers, "off by %lg px rms, at most %lg px",
                            &rms_px, &max_px) == 2);
        const loaded kalibr = load(exported(rig, "kalibr", here));
        REQUIRE(kalibr.code == ERROR_OK);
        CHECK(kalibr.value.left.fx_px == rig.left.fx_px);
        const double off_px = largest_difference_px(rig.left, kalibr.value.left);
        CHECK(off_px <= 1.01 * max_px);
        CHECK(off_px >= 0.8 * max_px);
        CHECK(rms_px < max_px);
        CHECK(max_px < 0.25 * largest_difference_px(rig.left, without_k3(rig.left)));
    }
}

TEST_CASE("wide lenses keep their model in every format that has it") {
    random_rig::Random random(synthetic::test_seed());
    for (const lens_kind kind : {LENS_EQUIDISTANT, LENS_RATIONAL}) {
        calibration rig = random_calibration(random);
        for (lens *one : {&rig.left, &rig.right}) {
            one->kind = kind;
            one->fx_px = one->fy_px = 300;
            one->k1 = 0.02, one->k2 = 0.01, one->k3 = 0.003, one->k4 = 0.004;
            one->k5 = one->k6 = kind == LENS_RATIONAL ? 0.001 : 0;
            one->p1 = one->p2 = kind == LENS_RATIONAL ? 1e-4 : 0;
        }
        REQUIRE(calibration_validate(&rig, nullptr) == ERROR_OK);
        const folder here;
        for (const char *format : {"opencv", "ros", "kalibr", "mrcal"}) {
            CAPTURE(format);
            const bool has = std::string(format) != "kalibr"
                                 ? kind == LENS_RATIONAL || std::string(format) != "mrcal"
                                 : kind == LENS_EQUIDISTANT;
            if (has) {
                const loaded again = load(exported(rig, format, here));
                INFO(again.message);
                REQUIRE(again.code == ERROR_OK);
                check_same(rig, again.value, 1e-9);
            } else if (kind == LENS_EQUIDISTANT) {
                std::vector<export_file> files;
                std::string message;
                CHECK(export_files(rig, format, &files, &message) == ERROR_DISTORTION);
                CHECK(message.find("rational") != std::string::npos);
            }
        }
    }
}

TEST_CASE("a rectified pair stays one") {
    const folder here;
    calibration rig = random_rig::plain_rig();
    std::strcpy(rig.id, "rectified");
    rig.rectified = true;
    rig.right.cx_px += 12.5;
    rig.left.fy_px = rig.right.fy_px = 602.5;
    REQUIRE(calibration_validate(&rig, nullptr) == ERROR_OK);
    const loaded ros = load(exported(rig, "ros", here));
    INFO(ros.message);
    REQUIRE(ros.code == ERROR_OK);
    CHECK(ros.value.rectified);
    check_same(ros.value, rig, 1e-12);
    import_options options;
    options.rectified = true;
    const loaded opencv = load(exported(rig, "opencv", here), options);
    REQUIRE(opencv.code == ERROR_OK);
    check_same(opencv.value, rig, 1e-12);
}

TEST_CASE(
    "rectified cameras keep the size, and disparity 0 is infinity if it is in the depth range") {
    calibration rig = random_rig::plain_rig(0.001);
    export_rectified parallel;
    REQUIRE(export_rectify(rig, &parallel) == ERROR_OK);
    CHECK(parallel.cx_left_px == parallel.cx_right_px);
    CHECK(std::fabs(parallel.cx_left_px - 319.5) < 2);
    rig = random_rig::plain_rig(0.2);
    rig.depth_near_mm = 400;
    rig.depth_far_mm = 600;
    export_rectified verged;
    REQUIRE(export_rectify(rig, &verged) == ERROR_OK);
    CHECK(verged.cx_left_px - verged.cx_right_px < -50);
    // A point where the axes meet is near the middle of both images.
    const double verged_mm = calibration_vergence_depth_mm(&rig), point_mm[3] = {0, 0, verged_mm};
    double rect_mm[3];
    geometry_rotate(verged.R_rect_left, point_mm, rect_mm);
    const double x_left = verged.cx_left_px + verged.f_px * rect_mm[0] / rect_mm[2];
    const double x_right =
        verged.cx_right_px + verged.f_px * (rect_mm[0] - verged.baseline_mm) / rect_mm[2];
    CHECK(std::fabs(x_left - 319.5) < 100);
    CHECK(std::fabs(x_right - 319.5) < 100);
}

TEST_CASE("images that are too large for matching can be exported") {
    calibration rig = random_rig::plain_rig(0.01);
    for (lens *one : {&rig.left, &rig.right}) {
        one->width_px = 9000;
        one->height_px = 6000;
        one->fx_px = one->fy_px = 8000;
        one->cx_px = 4499.5;
        one->cy_px = 2999.5;
    }
    export_rectified found;
    REQUIRE(export_rectify(rig, &found) == ERROR_OK);
    CHECK(std::fabs(found.f_px / 8000 - 1) < 0.05);
    CHECK(std::fabs(found.cy_px - 2999.5) < 10);
}

TEST_CASE("numbers are numbers for every reader of YAML") {
    CHECK(export_numbers({0, -1, 0.5, 1e20, -5e-324, 0.1}) ==
          "0, -1, 0.5, 1.0e+20, -4.9406564584124654e-324, 0.10000000000000001");
}

TEST_CASE("what a format cannot hold is reported in one line") {
    random_rig::Random random(5);
    calibration rig = random_calibration(random);
    std::vector<export_file> files;
    std::string message;
    rig.left.k3 = rig.right.k3 = 0;
    CHECK(export_files(rig, "kalibr", &files, &message) == ERROR_OK);
    CHECK(files.size() == 1);
    CHECK(files[0].loss.empty());
    rig.right.width_px += 2;
    CHECK(export_files(rig, "opencv", &files, &message) == ERROR_RANGE);
    CHECK(export_files(rig, "mrcal", &files, &message) == ERROR_OK);
    CHECK(files[0].text.find("LENSMODEL_OPENCV4") != std::string::npos);
    CHECK(export_files(rig, "matlab", &files, &message) == ERROR_ARGUMENT);
    // A pair whose cameras look away from each other.
    rig = random_rig::plain_rig(3.0);
    CHECK(export_files(rig, "ros", &files, &message) != ERROR_OK);
    CHECK(message.find('\n') == std::string::npos);
}
