// SPDX-License-Identifier: Apache-2.0
// Formats without an available writer: files in the published form, with numbers checked by hand.
#include "tools/host/convert/import.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "import_files.hpp"
#include "stereo/geometry/geometry.h"

using namespace import_files;

TEST_CASE("Middlebury: the published sample") {
    const folder here;
    const loaded result = load(here.write("calib.txt", middlebury));
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    const calibration &value = result.value;
    CHECK(result.report.format == "Middlebury");
    CHECK(value.rectified);
    CHECK(value.left.width_px == 2964);
    CHECK(value.right.height_px == 1988);
    CHECK(value.left.fx_px == 3997.684);
    CHECK(value.right.fy_px == 3997.684);
    CHECK(value.left.cx_px == 1176.728);
    CHECK(value.right.cx_px == 1307.839);
    CHECK(value.right.cy_px == 1011.728);
    CHECK(value.translation_right_left_mm[0] == -193.001);
    // 3997.684 * 193.001 = 771557.00968; over 257 + 1 + 131.111 and over 31 - 1 + 131.111.
    CHECK(value.depth_near_mm == doctest::Approx(1982.871).epsilon(1e-6));
    CHECK(value.depth_far_mm == doctest::Approx(4788.979).epsilon(1e-6));
    // Also found by its directory, and with Windows line ends.
    CHECK(load(here.path).code == ERROR_OK);
    std::string windows;
    for (const char *c = middlebury; *c != '\0'; c++) {
        windows += *c == '\n' ? "\r\n" : std::string(1, *c);
    }
    CHECK(load(here.write("windows.txt", windows)).value.depth_far_mm == value.depth_far_mm);
}

TEST_CASE("Middlebury: depth range without vmin and vmax, and up to infinity") {
    const folder here;
    std::string text = replace(replace(middlebury, "vmin=31\n", ""), "vmax=257\n", "");
    loaded result = load(here.write("a.txt", text));
    REQUIRE(result.code == ERROR_OK);
    // 771557.00968 / (280 + 131.111) and / (131.111 - 1).
    CHECK(result.value.depth_near_mm == doctest::Approx(1876.761).epsilon(1e-6));
    CHECK(result.value.depth_far_mm == doctest::Approx(5929.99).epsilon(1e-6));
    text = replace(replace(text, "1307.839", "1176.728"), "doffs=131.111", "doffs=0");
    result = load(here.write("b.txt", text));
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.depth_far_mm == 1e9);
    text = replace(text, "ndisp=280\n", "");
    result = load(here.write("c.txt", text));
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.depth_near_mm == 0);
    CHECK(result.value.depth_far_mm == 0);
}

TEST_CASE("Middlebury: mistakes are named") {
    const folder here;
    const auto refused = [&](const std::string &from, const std::string &to, int code,
                             std::initializer_list<const char *> words) {
        check_refused(here.write("calib.txt", replace(middlebury, from, to)), {}, code, words);
    };
    refused("doffs=131.111", "doffs=100", ERROR_RANGE, {"line 3", "doffs"});
    refused("doffs=131.111\n", "", ERROR_MISSING, {"doffs"});
    refused("baseline=193.001", "baseline=0", ERROR_BASELINE, {"line 4", "baseline"});
    refused("baseline=193.001", "baseline=abc", ERROR_SYNTAX, {"line 4", "baseline"});
    refused("baseline=193.001", "baseline=nan", ERROR_SYNTAX, {"line 4", "baseline"});
    refused("baseline=193.001", "baseline=1 2", ERROR_SYNTAX, {"line 4", "baseline", "2"});
    refused("width=2964", "width=29.5", ERROR_RANGE, {"line 5", "width"});
    refused("width=2964", "width=1e99", ERROR_RANGE, {"line 5", "width"});
    refused("width=2964", "width=40000", ERROR_RANGE, {"left_size_px", "32768"});
    refused("width=2964", "height=1", ERROR_DUPLICATE, {"line 6", "height"});
    refused("[3997.684 0 1176", "[3997.684 0.5 1176", ERROR_RANGE, {"line 1", "cam0", "skew"});
    refused("[3997.684 0 1176", "[-3997.684 0 1176", ERROR_RANGE, {"line 1", "cam0"});
    refused("[3997.684 0 1307", "[3997.685 0 1307", ERROR_RANGE, {"cam0", "cam1"});
    refused("0 0 1]", "0 0]", ERROR_SYNTAX, {"line 1", "cam0", "8", "9"});
    refused("vmax=257", "vmax=-500", ERROR_DISPARITY_RANGE, {"vmin"});
    refused("isint=0", "isint", ERROR_SYNTAX, {"line 8"});
}

TEST_CASE("KITTI: rectified pair of a recording") {
    const folder here;
    loaded result = load(here.write("calib_cam_to_cam.txt", kitti_raw));
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.report.format == "KITTI");
    CHECK(std::string(result.value.date) == "2012-01-09");
    CHECK(result.value.rectified);
    CHECK(result.value.left.width_px == 1242);
    CHECK(result.value.right.height_px == 375);
    CHECK(result.value.left.fx_px == 721.5377);
    CHECK(result.value.right.cx_px == 609.5593);
    // x of the cameras: (44.85728 - 609.5593 * 0.002745884) / 721.5377 = 0.0598493 m and
    // (-339.5242 - 609.5593 * 0.002729905) / 721.5377 = -0.4728627 m.
    CHECK(result.value.translation_right_left_mm[0] == doctest::Approx(-532.7119).epsilon(1e-6));
    import_options options;
    options.width_px = 1242;
    options.height_px = 375;
    CHECK(load(here.path, options).value.rectified);
    options.first_camera = 0;  // its projections were left out above
    check_refused(here.path + "/calib_cam_to_cam.txt", options, ERROR_MISSING, {"P_rect_00"});
}

TEST_CASE("KITTI: raw pair of a recording") {
    const folder here;
    import_options options;
    options.width_px = 1392;
    options.height_px = 512;
    options.first_camera = 0;
    const std::string path = here.write("calib_cam_to_cam.txt", kitti_raw);
    const loaded result = load(path, options);
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    CHECK_FALSE(result.value.rectified);
    CHECK(result.value.left.k1 == -0.3728755);
    CHECK(result.value.left.p1 == 0.002219027);
    CHECK(result.value.right.k3 == -0.05314062);
    CHECK(result.value.right.fy_px == 987.8386);
    // Camera 0 is the origin: the pose is R_01 and T_01 unchanged.
    CHECK(result.value.translation_right_left_mm[0] == doctest::Approx(-537));
    CHECK(result.value.translation_right_left_mm[1] == doctest::Approx(4.822061));
    CHECK(result.value.translation_right_left_mm[2] == doctest::Approx(-12.52488));
    double R[9];
    geometry_rotation_from_vector(result.value.rotation_right_left_rad, R);
    CHECK(std::abs(R[2] - -3.083487e-02) < 1e-6);
    CHECK(std::abs(R[6] - 3.067156e-02) < 1e-6);
    CHECK(std::abs(R[1] - 1.860866e-02) < 1e-6);
}

TEST_CASE("KITTI: raw cameras of which neither is the origin") {
    import_options options;
    options.width_px = 1392;
    options.height_px = 512;
    const import_pair pair = import_kitti({"kitti", kitti_raw}, options);
    CHECK_FALSE(pair.value.rectified);
    // The same two cameras are in the rectified projections: their distance is |(0.532712,
    // 0.002753, 0.000016)| m.
    CHECK(calibration_baseline_mm(&pair.value) == doctest::Approx(532.719).epsilon(1e-5));
    // R_rect of both sides rotate into one frame: R_right_left = R_rect_03^T R_rect_02.
    const double R_rect_02[9] = {9.998817e-01,  1.511453e-02, -2.841595e-03,
                                 -1.511724e-02, 9.998853e-01, -9.338510e-04,
                                 2.827154e-03,  9.766976e-04, 9.999955e-01};
    const double R_rect_03_T[9] = {9.998321e-01,  7.232804e-03,  -1.683901e-02,
                                   -7.193136e-03, 9.999712e-01,  2.415116e-03,
                                   1.685599e-02,  -2.293585e-03, 9.998553e-01};
    double R_right_left[9], r_rad[3];
    geometry_multiply(R_rect_03_T, R_rect_02, R_right_left);
    REQUIRE(geometry_vector_from_rotation(R_right_left, r_rad) == ERROR_OK);
    for (int i = 0; i < 3; i++) {
        CHECK(std::abs(pair.value.rotation_right_left_rad[i] - r_rad[i]) < 2e-6);
    }
    options.rectified = true;
    CHECK(import_kitti({"kitti", kitti_raw}, options).value.rectified);
}

TEST_CASE("KITTI: projections alone") {
    const folder here;
    const std::string path = here.write("calib.txt", kitti_odometry);
    import_options options;
    check_refused(path, options, ERROR_MISSING, {"size"});
    options.width_px = 1241;
    options.height_px = 376;
    loaded result = load(path, options);
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.left.width_px == 1241);
    CHECK(result.value.left.fx_px == 718.856);
    // (45.38225 - 607.1928 * 0.003779761 + 337.2877 + 607.1928 * 0.004915215) / 718.856
    CHECK(result.value.translation_right_left_mm[0] == doctest::Approx(-533.2910).epsilon(1e-6));
    options.first_camera = 0;
    result = load(path, options);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.translation_right_left_mm[0] == doctest::Approx(-537.1657).epsilon(1e-6));
    options.first_camera = 1;  // P1 and P2: the left one of these is on the right
    check_refused(path, options, ERROR_BASELINE, {"P1", "P2", "swapped"});
    options.first_camera = 7;
    check_refused(path, options, ERROR_MISSING, {"P7"});
}

TEST_CASE("KITTI: mistakes are named") {
    const folder here;
    import_options options;
    options.width_px = 1392;
    options.height_px = 512;
    const auto refused = [&](const std::string &from, const std::string &to, int code,
                             std::initializer_list<const char *> words) {
        check_refused(here.write("kitti.txt", replace(kitti_raw, from, to)), options, code, words);
    };
    refused("T_03: -4.7", "T_03: nan ", ERROR_SYNTAX, {"line", "T_03"});
    refused("R_03: 9.995599e-01", "R_03: 1.995599e-01", ERROR_ROTATION, {"R_02", "R_03"});
    refused("K_02: 9.597910e+02", "K_02: 0", ERROR_RANGE, {"K_02", "focal"});
    refused("T_02: ", "T_03: ", ERROR_DUPLICATE, {"T_03"});
    refused("D_02: ", "D_02: 1 ", ERROR_SYNTAX, {"D_02", "6", "5"});
    refused("corner_dist:", "corner_dist", ERROR_SYNTAX, {"line 2"});
}
