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

namespace {

std::string euroc(const std::string &x_m, const std::string &z_m) {
    return "# General sensor definitions.\nsensor_type: camera\ncomment: one of two\nT_BS:\n"
           "  cols: 4\n  rows: 4\n  data: [0.0, -1.0, 0.0, 0.5,\n         1.0, 0.0, 0.0, " +
           x_m + ",\n         0.0, 0.0, 1.0, " + z_m +
           ",\n         0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\nresolution: [752, 480]\n"
           "camera_model: pinhole\nintrinsics: [458.6, 457.2, 367.2, 248.3] #fu, fv, cu, cv\n"
           "distortion_model: radial-tangential\n"
           "distortion_coefficients: [-0.28, 0.07, 0.0002, 0.00002]\n";
}

}  // namespace

TEST_CASE("EuRoC: the sensors' poses in the body's frame, by either file's name") {
    const folder here;
    // The body is turned by 90 degrees about z: its y is the cameras' x.
    const std::string left = here.write("rig_cam0.yaml", euroc("0.01", "0.02"));
    const std::string right = here.write("rig_cam1.yaml", euroc("0.12", "0.03"));
    for (const std::string &path : {left, right, left + "," + right}) {
        const loaded result = load(path);
        INFO(result.message);
        REQUIRE(result.code == ERROR_OK);
        CHECK(result.report.format == "EuRoC");
        CHECK(result.report.files[0] == left);
        CHECK(result.value.left.fy_px == 457.2);
        CHECK(result.value.right.p1 == 0.0002);
        CHECK(result.value.translation_right_left_mm[0] == doctest::Approx(-110));
        CHECK(result.value.translation_right_left_mm[1] == 0);
        CHECK(result.value.translation_right_left_mm[2] == doctest::Approx(-10));
        CHECK(result.value.rotation_right_left_rad[2] == 0);
    }
    const loaded wide = load(here.write(
        "rig_cam0.yaml", replace(euroc("0.01", "0.02"), "radial-tangential", "equidistant")));
    CHECK(wide.value.left.kind == LENS_EQUIDISTANT);
    CHECK(wide.value.left.k4 == 0.00002);
    CHECK(wide.value.right.kind == LENS_BROWN_CONRADY);
    const auto refused = [&](const std::string &from, const std::string &to, int code,
                             std::initializer_list<const char *> words) {
        check_refused(here.write("rig_cam1.yaml", replace(euroc("0.12", "0"), from, to)), {}, code,
                      words);
    };
    refused("0.0, -1.0, 0.0", "0.0, -1.1, 0.0", ERROR_ROTATION, {"T_BS"});
    refused("0.0, 0.0, 0.0, 1.0]", "0.0, 0.0, 0.0]", ERROR_SYNTAX, {"T_BS", "15", "16"});
    refused("radial-tangential", "omni", ERROR_DISTORTION, {"omni", "radial-tangential"});
    refused("sensor_type: camera", "sensor_type: imu", ERROR_SYNTAX, {"imu", "camera"});
    refused("distortion_model: radial-tangential\n", "", ERROR_MISSING, {"distortion_model"});
    refused("resolution: [752, 480]\n", "", ERROR_MISSING, {"resolution"});
    check_refused(here.write("front.yaml", euroc("0", "0")), {}, ERROR_MISSING, {"pair", "cam0"});
}

TEST_CASE("K.txt: a camera matrix and the baseline in m") {
    const folder here;
    import_options options;
    const std::string text = "750.0 0.0 480.0 0.0 750.0 270.0 0.0 0.0 1.0\n0.065\n";
    const std::string path = here.write("K.txt", text);
    check_refused(path, options, ERROR_MISSING, {"--size"});
    options.width_px = 960;
    options.height_px = 540;
    for (const std::string &name : {path, here.path}) {
        const loaded result = load(name, options);
        INFO(result.message);
        REQUIRE(result.code == ERROR_OK);
        CHECK(result.value.rectified);
        CHECK(result.value.left.width_px == 960);
        CHECK(result.value.right.cy_px == 270);
        CHECK(result.value.translation_right_left_mm[0] == -65);
    }
    const auto refused = [&](const std::string &from, const std::string &to, int code,
                             std::initializer_list<const char *> words) {
        check_refused(here.write("K.txt", replace(text, from, to)), options, code, words);
    };
    refused("0.065\n", "", ERROR_SYNTAX, {"baseline", "9", "10"});
    refused("0.065", "0", ERROR_BASELINE, {"baseline"});
    refused("0.065", "0.065 1", ERROR_SYNTAX, {"11", "10"});
    refused("0.065", "65", ERROR_BASELINE, {"65000 mm", "above", "--unit mm"});
    refused("750.0 0.0 480", "750.0 1.0 480", ERROR_RANGE, {"skew"});
}

namespace {

/// A camera as eepromToJsonFile writes it.
std::string oak_camera(const std::string &to, const std::string &x_cm) {
    return R"({"cameraType": 0, "distortionCoeff": [0.1, -0.2, 0.001, -0.0005, 0.05, 0.0, 0.0, 0.0,
               0.0, 0.0, 0.0, 0.0, 0.0, 0.0], "extrinsics": {"rotationMatrix": [[0.8, 0.0, -0.6],
               [0.0, 1.0, 0.0], [0.6, 0.0, 0.8]], "specTranslation": {"x": -7.5, "y": 0.0, "z": 0.0},
               "toCameraSocket": )" +
           to + R"(, "translation": {"x": )" + x_cm + R"(, "y": 0.25, "z": 0.0}}, "height": 800,
               "intrinsicMatrix": [[799.75, 0.0, 662.5], [0.0, 799.25, 382.25], [0.0, 0.0, 1.0]],
               "lensPosition": 0, "specHfovDeg": 71.8, "width": 1280})";
}

std::string oak(const std::string &cameras, const std::string &sockets = "1 2") {
    return R"({"batchName": "", "boardName": "OAK-D", "cameraData": [)" + cameras +
           R"(], "stereoRectificationData": {"leftCameraSocket": )" + sockets.substr(0, 2) +
           R"(, "rectifiedRotationLeft": [], "rightCameraSocket": )" + sockets.substr(2) +
           R"(}, "version": 7})";
}

}  // namespace

TEST_CASE("DepthAI: the pair of an EEPROM, whichever camera refers to whichever") {
    const folder here;
    const std::string none = oak_camera("-1", "0");
    const std::string direct = "[1, " + oak_camera("2", "-7.5") + "], [2, " + none + "]";
    loaded result = load(here.write("oak.json", oak(direct)));
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.report.format == "DepthAI");
    CHECK_FALSE(result.value.rectified);
    CHECK(result.value.left.width_px == 1280);
    CHECK(result.value.left.fx_px == 799.75);
    CHECK(result.value.right.k3 == 0.05);
    CHECK(result.value.translation_right_left_mm[0] == doctest::Approx(-75));
    CHECK(result.value.translation_right_left_mm[1] == doctest::Approx(2.5));
    CHECK(result.value.rotation_right_left_rad[1] == doctest::Approx(-std::asin(0.6)));
    // The same pose by the inverse reference: p_left = R p_right + t.
    const std::string inverse = "[1, " + none + "], [2, " + oak_camera("1", "7.5") + "]";
    result = load(here.write("inverse.json", oak(inverse, "-1-1")));
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.rotation_right_left_rad[1] == doctest::Approx(std::asin(0.6)));
    CHECK(result.value.translation_right_left_mm[0] == doctest::Approx(-75 * 0.8));
    CHECK(result.value.translation_right_left_mm[2] == doctest::Approx(75 * 0.6));
    // Both by a third camera: equal rotations cancel, and 3 - 10.5 cm are left, turned back.
    const std::string third = "[0, " + none + "], [1, " + oak_camera("0", "3") + "], [2, " +
                              oak_camera("0", "10.5") + "]";
    result = load(here.write("third.json", oak(third)));
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.rotation_right_left_rad[1] == doctest::Approx(0));
    CHECK(calibration_baseline_mm(&result.value) == doctest::Approx(75));
    const auto refused = [&](const std::string &from, const std::string &to, int code,
                             std::initializer_list<const char *> words) {
        check_refused(here.write("oak.json", replace(oak(direct), from, to)), {}, code, words);
    };
    result = load(here.write(
        "oak.json",
        replace(replace(oak(direct), "\"cameraType\": 0", "\"cameraType\": 1"), "-0.2", "0.02")));
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.left.kind == LENS_EQUIDISTANT);
    CHECK(result.value.left.k4 == -0.0005);
    CHECK(result.value.right.kind == LENS_BROWN_CONRADY);
    refused("\"cameraType\": 0", "\"cameraType\": 2", ERROR_DISTORTION, {"cameraType", "socket 1"});
    refused("[2, {", "[3, {", ERROR_MISSING, {"socket 2"});
    refused("\"toCameraSocket\": 2", "\"toCameraSocket\": -1", ERROR_MISSING, {"connect"});
    refused("\"toCameraSocket\": 2", "\"toCameraSocket\": 1", ERROR_MISSING, {"connect"});
    refused("\"x\": -7.5, \"y\": 0.25", "\"x\": -7.5", ERROR_MISSING, {"translation", "y"});
    refused("[799.75, 0.0,", "[799.75,", ERROR_SYNTAX, {"intrinsicMatrix", "8", "9"});
    refused("\"version\": 7}", "", ERROR_SYNTAX, {"JSON"});
    refused("\"width\": 1280", "\"width\": 0", ERROR_RANGE, {"width"});
}

namespace {

const char *const realsense_table =
    R"({"baseline": -50.0648, "intrinsic_left.x.x": 0.497, "rectified.0.fx": 957.25,
        "rectified.0.fy": 957.25, "rectified.0.height": 1080, "rectified.0.ppx": 971.75,
        "rectified.0.ppy": 527.75, "rectified.0.width": 1920, "rectified.1.fx": "638.125",
        "rectified.1.fy": "638.125", "rectified.1.height": "720", "rectified.1.ppx": "647.875",
        "rectified.1.ppy": "351.875", "rectified.1.width": "1280", "rectified.2.fx": 574.25,
        "rectified.2.fy": 574.25, "rectified.2.height": 0, "rectified.2.ppx": 367.0,
        "rectified.2.ppy": 352.5, "rectified.2.width": 0, "world2left_rot.x.x": 0.999999})";

std::string listed(const std::string &stream, const std::string &format, const std::string &ppx) {
    return " Intrinsic of \"" + stream + "\" / 848x480 / {" + format +
           "}\n  Width:      \t848\n  Height:     \t480\n  PPX:        \t" + ppx +
           "\n  PPY:        \t234.5\n  Fx:         \t422.75\n  Fy:         \t422.75\n"
           "  Distortion: \tBrown Conrady\n  Coeffs:     \t0  \t0  \t0  \t0  \t0  \n"
           "  FOV (deg):  \t90.17 x 59.17\n\n";
}

}  // namespace

TEST_CASE("RealSense: the table of the viewer and the listing of rs-enumerate-devices") {
    const folder here;
    import_options options;
    const std::string table = here.write("d435.json", realsense_table);
    check_refused(table, options, ERROR_MISSING, {"--size", "1920x1080, 1280x720"});
    options.width_px = 1280;
    options.height_px = 720;
    loaded result = load(table, options);
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.report.format == "RealSense");
    CHECK(result.value.rectified);
    CHECK(result.value.left.fx_px == 638.125);
    CHECK(result.value.right.cx_px == 647.875);
    CHECK(result.value.translation_right_left_mm[0] == -50.0648);
    options.height_px = 700;
    check_refused(table, options, ERROR_MISSING, {"1280x700", "1280x720"});
    const std::string text =
        "Device info: \n    Name : \tIntel RealSense D435\n\nIntrinsic Parameters:\n\n" +
        listed("Infrared 1", "Y8", "429.25") + listed("Infrared 1", "Y16", "400") +
        listed("Infrared 2", "Y8", "429.25") + listed("Color", "RGB8/BGR8", "420") +
        "\nExtrinsic Parameters:\nExtrinsic from \"Infrared 1\"\t  To\t  \"Infrared 1\" :\n"
        " Rotation Matrix:\n   1               0               0            \n\n"
        " Translation Vector: 0  0  0  \n\n\n"
        "Extrinsic from \"Infrared 1\"\t  To\t  \"Infrared 2\" :\n Rotation Matrix:\n"
        "   1               0               0            \n\n"
        " Translation Vector: -0.05006478  0  0  \n\n\n";
    options.width_px = 848;
    options.height_px = 480;
    result = load(here.write("d435.txt", text), options);
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.left.cx_px == 429.25);
    CHECK(result.value.translation_right_left_mm[0] == -50.06478);
    const std::string back = here.write("back.txt", replace(text, ": -0.0500", ": 0.0500"));
    CHECK(load(back, options).code < 0);
    const std::string cut = here.write("cut.txt", replace(text, "Translation Vector: -0.", ""));
    check_refused(cut, options, ERROR_MISSING, {"extrinsic"});
}

namespace {

std::string storage_matrix(const std::string &name, int rows, int columns,
                           const std::string &data) {
    return name + ": !!opencv-matrix\n   rows: " + std::to_string(rows) +
           "\n   cols: " + std::to_string(columns) + "\n   dt: d\n   data:[" + data + "]\n";
}

std::string orbslam_camera(const std::string &name, const std::string &terms) {
    return name + ".fx: 458.0\n" + name + ".fy: 457.0\n" + name + ".cx: 367.0\n" + name +
           ".cy: 248.0\n" + terms;
}

const char *const orbslam_size = "Camera.width: 752\nCamera.height: 480\nCamera.fps:20\n";

}  // namespace

TEST_CASE("ORB-SLAM: raw pairs, wide ones, and rectified ones") {
    const folder here;
    const auto settings = [&](const std::string &text) {
        return here.write("rig.yaml", "%YAML:1.0\n" + text + orbslam_size);
    };
    const std::string two = orbslam_camera("Camera1", "Camera1.k1: -0.28\nCamera1.p2: 0.001\n") +
                            orbslam_camera("Camera2", "Camera2.k1: -0.27\n");
    const std::string pose = storage_matrix("Stereo.T_c1_c2", 4, 4,
                                            "0.8, 0, 0.6, 0.1, 0, 1, 0, 0, -0.6, 0, 0.8, 0, 0, 0, "
                                            "0, 1");
    loaded result = load(settings(two + pose));
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.report.format == "ORB-SLAM");
    CHECK(result.value.left.width_px == 752);
    CHECK(result.value.left.p2 == 0.001);
    CHECK(result.value.right.k1 == -0.27);
    // The right camera is at x 100 mm and turned by -36.9 degrees.
    CHECK(result.value.translation_right_left_mm[0] == doctest::Approx(-80));
    CHECK(result.value.translation_right_left_mm[2] == doctest::Approx(-60));
    result = load(settings("Camera.type: \"KannalaBrandt8\"\n" + two + pose));
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.left.kind == LENS_EQUIDISTANT);
    check_refused(settings(two), {}, ERROR_MISSING, {"Stereo.T_c1_c2"});

    const std::string one = orbslam_camera("Camera", "Camera.k1: 0.0\nCamera.bf: 45.8\n");
    result = load(settings(one));
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.rectified);
    CHECK(result.value.translation_right_left_mm[0] == doctest::Approx(-100));
    check_refused(settings(replace(one, "k1: 0.0", "k1: -0.2")), {}, ERROR_DISTORTION, {"LEFT.K"});
    check_refused(settings(replace(one, "45.8", "0")), {}, ERROR_BASELINE, {"above 0"});
    check_refused(settings("Camera.type: \"Omni\"\n" + one), {}, ERROR_DISTORTION, {"Camera.type"});
    check_refused(settings(replace(one, "45.8", "[1]")), {}, ERROR_SYNTAX, {"Camera.bf"});

    const std::string K = "458, 0, 367, 0, 457, 248, 0, 0, 1", R = "1, 0, 0, 0, 1, 0, 0, 0, 1";
    const auto side = [&](const std::string &name, const std::string &x) {
        return name + ".height: 480\n" + name + ".width: 752\n" +
               storage_matrix(name + ".D", 1, 5, "-0.28, 0.07, 0.0002, 0, 0") +
               storage_matrix(name + ".K", 3, 3, K) + storage_matrix(name + ".R", 3, 3, R) +
               storage_matrix(name + ".P", 3, 4,
                              "435, 0, 367, " + x + ", 0, 435, 252, 0, 0, 0, 1, 0");
    };
    const std::string path = settings(one + side("LEFT", "0") + side("RIGHT", "-43.5"));
    result = load(path);
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.left.k1 == -0.28);
    CHECK(result.value.left.fx_px == 458);
    CHECK(result.value.translation_right_left_mm[0] == doctest::Approx(-100));
    import_options options;
    options.rectified = true;
    result = load(path, options);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.left.fx_px == 435);
    check_refused(settings(one + side("LEFT", "0")), {}, ERROR_MISSING, {"RIGHT.P"});
}
