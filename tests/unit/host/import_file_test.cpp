// SPDX-License-Identifier: Apache-2.0
// ROS camera_info, our own text, and files that are damaged or not calibrations.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "import_files.hpp"
#include "synthetic/seed.hpp"
#include "tools/host/convert/import.hpp"

using namespace import_files;

namespace {

std::string camera_info(const std::string &name, const std::string &R, const std::string &P) {
    return "image_width: 640\nimage_height: 480\ncamera_name: " + name +
           "\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [530, 0, 320, 0, 531, 240, 0, 0, 1]\n"
           "distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n"
           "  data: [-0.28, 0.08, 0.001, -0.0002, 0]\nrectification_matrix:\n  rows: 3\n  cols: 3\n"
           "  data: [" +
           R + "]\nprojection_matrix:\n  rows: 3\n  cols: 4\n  data: [" + P + "]\n";
}

const char *const identity = "1, 0, 0, 0, 1, 0, 0, 0, 1";
const char *const P_left = "500, 0, 325, 0, 0, 500, 244, 0, 0, 0, 1, 0";
const char *const P_right = "500, 0, 325, -60, 0, 500, 244, 0, 0, 0, 1, 0";

const char *const kalibr =
    "cam0:\n  cam_overlaps: [1]\n  camera_model: pinhole\n"
    "  distortion_coeffs: [-0.28, 0.08, 0.001, -0.0002]\n  distortion_model: radtan\n"
    "  intrinsics: [530, 531, 320, 240]\n  resolution: [640, 480]\n  rostopic: /cam0/image_raw\n"
    "cam1:\n  T_cn_cnm1:\n  - [0.8, 0, -0.6, -0.096]\n  - [0, 1, 0, 0]\n"
    "  - [0.6, 0, 0.8, -0.072]\n  - [0.0, 0.0, 0.0, 1.0]\n  cam_overlaps: [0]\n"
    "  camera_model: pinhole\n  distortion_coeffs: []\n  distortion_model: none\n"
    "  intrinsics: [530, 531, 322, 240]\n  resolution: [640, 480]\n";

std::string mrcal(const std::string &extrinsics) {
    return "# a note\n{\n    'lensmodel':  'LENSMODEL_OPENCV4',\n\n"
           "    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....\n"
           "    'intrinsics': [ 530, 531, 320, 240, -0.28, 0.08, 0.001, -0.0002,],\n\n"
           "    'valid_intrinsics_region': [\n    [ 0, 0 ],\n    [ 0, 479 ],\n],\n\n"
           "    # extrinsics are rt_fromref\n    'extrinsics': [" +
           extrinsics +
           "],\n\n    'imagersize': [ 640, 480,],\n\n    'icam_intrinsics': 0,\n\n"
           "    'optimization_inputs': b'P)h>@6aWA{}[2mjc#%,:0}',\n\n}\n";
}

const char *const mrcal_left = " 0, 0.1, 0, 0.05, 0, 0,";
const char *const mrcal_right = " 0, 0.1, 0, -0.07, 0, 0,";

}  // namespace

TEST_CASE("Kalibr: a chain") {
    const folder here;
    const std::string path = here.write("bag-camchain.yaml", kalibr);
    const loaded result = load(path);
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.report.format == "Kalibr");
    CHECK(result.value.left.fy_px == 531);
    CHECK(result.value.left.p2 == -0.0002);
    CHECK(result.value.right.k1 == 0);
    CHECK(result.value.right.cx_px == 322);
    CHECK(result.value.rotation_right_left_rad[1] == doctest::Approx(-std::asin(0.6)));
    CHECK(result.value.translation_right_left_mm[0] == doctest::Approx(-96));
    CHECK(result.value.translation_right_left_mm[2] == doctest::Approx(-72));
    import_options options;
    options.rectified = true;
    check_refused(path, options, ERROR_ARGUMENT, {"--rectified"});
    const auto refused = [&](const std::string &from, const std::string &to, int code,
                             std::initializer_list<const char *> words) {
        check_refused(here.write("camchain.yaml", replace(kalibr, from, to)), {}, code, words);
    };
    refused("model: radtan", "model: fov", ERROR_DISTORTION, {"cam0", "fov", "pinhole-equi"});
    refused("camera_model: pinhole", "camera_model: omni", ERROR_DISTORTION, {"cam0", "omni"});
    refused("cam1:", "cam2:", ERROR_MISSING, {"cam1"});
    refused("T_cn_cnm1:", "T_cam_imu:", ERROR_MISSING, {"cam1", "T_cn_cnm1"});
    refused("[0.8, 0, -0.6", "[0.9, 0, -0.6", ERROR_ROTATION, {"T_cn_cnm1"});
    refused("[0.8, 0, -0.6, -0.096]", "[0.8, 0, -0.6]", ERROR_SYNTAX, {"T_cn_cnm1"});
    refused("[530, 531, 320, 240]", "[530, 531, 320]", ERROR_SYNTAX, {"intrinsics", "4"});
    refused("[640, 480]", "[640.5, 480]", ERROR_RANGE, {"cam0", "size"});
    refused("[640, 480]", "{640: 480}", ERROR_SYNTAX, {"resolution"});
    refused("pinhole", "[pinhole", ERROR_SYNTAX, {"line"});
}

TEST_CASE("Kalibr: poses against an inertial unit, as Kalibr and OpenVINS write them") {
    const folder here;
    const auto imu = [](const std::string &name, const std::string &x_left,
                        const std::string &x_right) {
        const auto pose = [&](const std::string &x) {
            return "  " + name + ":\n    - [0, 0, 1, " + x +
                   "]\n    - [0, 1, 0, 0]\n    - [-1, 0, 0, 0]\n    - [0, 0, 0, 1]\n";
        };
        std::string text = kalibr;
        const size_t begin = text.find("  T_cn_cnm1:"), end = text.find("  cam_overlaps: [0]");
        text.replace(begin, end - begin, pose(x_right));
        return "%YAML:1.0\n" + replace(text, "cam0:\n", "cam0:\n" + pose(x_left));
    };
    loaded result = load(here.write("camchain-imucam.yaml", imu("T_cam_imu", "0.05", "-0.07")));
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.translation_right_left_mm[0] == doctest::Approx(-120));
    CHECK(result.value.rotation_right_left_rad[1] == 0);
    result = load(here.write("kalibr_imucam_chain.yaml", imu("T_imu_cam", "0.05", "-0.07")));
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    // The unit's x is the cameras' z; -(R^T t_right) + R^T t_left.
    CHECK(result.value.translation_right_left_mm[2] == doctest::Approx(120));
}

TEST_CASE("wide lenses: Kalibr's equi, ROS's equidistant and rational_polynomial") {
    const folder here;
    const loaded chain = load(here.write("camchain.yaml", replace(kalibr, "radtan", "equi")));
    INFO(chain.message);
    REQUIRE(chain.code == ERROR_OK);
    CHECK(chain.value.left.kind == LENS_EQUIDISTANT);
    const std::string coefficients = "-0.28, 0.08, 0.001, -0.0002, 0";
    for (const bool equidistant : {true, false}) {
        const auto wide = [&](const char *name, const char *P) {
            return replace(replace(camera_info(name, identity, P), "plumb_bob",
                                   equidistant ? "equidistant" : "rational_polynomial"),
                           coefficients,
                           equidistant ? "-0.28, 0.08, 0.001, -0.0002"
                                       : "-0.28, 0.08, 0.001, -0.0002, 0, 0.1, 0.2, 0.3");
        };
        here.write("left.yaml", replace(wide("left", P_left), "cols: 5", "cols: 4"));
        const loaded result = load(here.write("right.yaml", wide("right", P_right)));
        INFO(result.message);
        REQUIRE(result.code == ERROR_OK);
        const lens &left = result.value.left;
        CHECK(left.kind == (equidistant ? LENS_EQUIDISTANT : LENS_RATIONAL));
        CHECK(left.k1 == -0.28);
        CHECK((equidistant ? left.k3 : left.p1) == 0.001);
        CHECK((equidistant ? left.k4 : left.p2) == -0.0002);
        CHECK(left.k6 == (equidistant ? 0 : 0.3));
    }
}

TEST_CASE("mrcal: a pair, as mrcal writes it") {
    const folder here;
    const std::string left = here.write("left.cameramodel", mrcal(mrcal_left));
    const std::string right = here.write("right.cameramodel", mrcal(mrcal_right));
    for (const std::string &path : {left, right, here.path, left + "," + right}) {
        const loaded result = load(path);
        INFO(result.message);
        REQUIRE(result.code == ERROR_OK);
        CHECK(result.report.format == "mrcal");
        CHECK(result.value.left.k2 == 0.08);
        CHECK(result.value.rotation_right_left_rad[1] == 0);
        CHECK(result.value.translation_right_left_mm[0] == doctest::Approx(-120));
    }
    const auto refused = [&](const std::string &from, const std::string &to, int code,
                             std::initializer_list<const char *> words) {
        check_refused(here.write("right.cameramodel", replace(mrcal(mrcal_right), from, to)), {},
                      code, words);
    };
    refused("OPENCV4", "CAHVOR", ERROR_DISTORTION, {"CAHVOR", "mrcal-convert-lensmodel"});
    refused(" 530, 531, 320, 240,", " 530,", ERROR_SYNTAX, {"intrinsics"});
    refused(" 640, 480,", " 640, 480, 3,", ERROR_SYNTAX, {"imagersize", "3"});
    refused(mrcal_right, " 0,", ERROR_SYNTAX, {"extrinsics"});
    refused("'imagersize'", "[", ERROR_SYNTAX, {"not a camera of mrcal"});
    const std::string alone = here.write("front.cameramodel", mrcal(mrcal_left));
    check_refused(alone, {}, ERROR_MISSING, {"pair"});
}

TEST_CASE("ROS: a raw pair") {
    const folder here;
    const std::string left = here.write("left.yaml", camera_info("left", identity, P_left));
    // The right camera is turned by asin(0.6) about y against the rectified frame.
    const std::string right = here.write(
        "right.yaml", camera_info("right", "0.8, 0, 0.6, 0, 1, 0, -0.6, 0, 0.8", P_right));
    for (const std::string &path : {left, right, here.path, left + "," + right}) {
        const loaded result = load(path);
        INFO(result.message);
        REQUIRE(result.code == ERROR_OK);
        const calibration &value = result.value;
        CHECK(result.report.format == "ROS camera_info");
        CHECK(result.report.files[0] == left);
        CHECK_FALSE(value.rectified);
        CHECK(value.left.fx_px == 530);
        CHECK(value.right.fy_px == 531);
        CHECK(value.left.k1 == -0.28);
        CHECK(value.left.p2 == -0.0002);
        // R_right_left = R_right^T, the rotation by -asin(0.6) about y;
        // t = R_right^T (-60 / 500 m, 0, 0) = (0.8, 0, 0.6) * -120 mm.
        CHECK(value.rotation_right_left_rad[1] == doctest::Approx(-std::asin(0.6)));
        CHECK(value.rotation_right_left_rad[0] == 0);
        CHECK(value.translation_right_left_mm[0] == doctest::Approx(-96));
        CHECK(value.translation_right_left_mm[1] == 0);
        CHECK(value.translation_right_left_mm[2] == doctest::Approx(-72));
    }
    import_options options;
    options.rectified = true;
    const loaded result = load(left, options);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.rectified);
    CHECK(result.value.left.fx_px == 500);
    CHECK(result.value.right.cy_px == 244);
    CHECK(result.value.translation_right_left_mm[0] == -120);
}

TEST_CASE("ROS: the names of camera_info in matrices of OpenCV, and lengths in mm") {
    const folder here;
    const auto tagged = [](std::string text) {
        for (const char *name : {"camera_matrix:", "distortion_coefficients:",
                                 "rectification_matrix:", "projection_matrix:"}) {
            text = replace(text, name, std::string(name) + " !!opencv-matrix");
        }
        return "%YAML:1.0\n---\n" + text;
    };
    const std::string left = camera_info("left", identity, P_left);
    const std::string right = camera_info("right", identity, P_right);
    here.write("left.yaml", tagged(left));
    loaded result = load(here.write("right.yaml", tagged(right)));
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.report.format == "ROS camera_info");
    CHECK(result.value.translation_right_left_mm[0] == -120);
    here.write("right.yaml", replace(right, "-60", "-60000"));
    const std::string long_path = here.write("left.yaml", left);
    check_refused(long_path, {}, ERROR_BASELINE, {"120000 mm", "--unit mm"});
    import_options options;
    options.unit = "mm";
    result = load(long_path, options);
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.translation_right_left_mm[0] == -120);
    // A unit that makes it implausible is meant for the results; the format's own confirms it.
    here.write("right.yaml", right);
    result = load(long_path, options);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.translation_right_left_mm[0] == -120);
    here.write("right.yaml", replace(right, "-60", "-2"));
    check_refused(long_path, options, ERROR_BASELINE, {"4 mm", "--unit m"});
    options.unit = "m";
    result = load(long_path, options);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.translation_right_left_mm[0] == -4);
}

TEST_CASE("ROS: an echoed message and an ideal pair") {
    const folder here;
    const auto message = [](const std::string &tx) {
        return "header:\n  frame_id: camera\nheight: 400\nwidth: 600\ndistortion_model: plumb_bob\n"
               "d: [0, 0, 0, 0, 0]\nk: [450, 0, 300, 0, 450, 200, 0, 0, 1]\n"
               "r: [1, 0, 0, 0, 1, 0, 0, 0, 1]\np: [450, 0, 300, " +
               tx +
               ", 0, 450, 200, 0, 0, 0, 1, 0]\nbinning_x: 0\nbinning_y: 0\nroi:\n  x_offset: 0\n"
               "  y_offset: 0\n  height: 0\n  width: 0\n  do_rectify: false\n---\n";
    };
    const std::string left = here.write("left.yaml", message("0.0"));
    here.write("right.yaml", message("-31.5"));
    const loaded result = load(left);
    INFO(result.message);
    REQUIRE(result.code == ERROR_OK);
    CHECK(result.value.rectified);
    CHECK(result.value.left.height_px == 400);
    CHECK(result.value.translation_right_left_mm[0] == -70);
}

TEST_CASE("ROS: mistakes are named") {
    const folder here;
    const std::string good_left = camera_info("left", identity, P_left);
    const std::string good_right = camera_info("right", identity, P_right);
    const auto refused = [&](const std::string &from, const std::string &to, int code,
                             std::initializer_list<const char *> words) {
        here.write("left.yaml", good_left);
        check_refused(here.write("right.yaml", replace(good_right, from, to)), {}, code, words);
    };
    refused("plumb_bob", "omni", ERROR_DISTORTION, {"omni", "equidistant"});
    refused("plumb_bob", "equidistant", ERROR_SYNTAX, {"5", "k1 k2 k3 k4"});
    refused("-60", "60", ERROR_BASELINE, {"swapped"});
    refused("-60", "0", ERROR_BASELINE, {"baseline"});
    refused("-60", ".nan", ERROR_SYNTAX, {"projection_matrix"});
    refused("image_width: 640\n", "", ERROR_MISSING, {"image_width"});
    refused("image_width: 640", "image_width: wide", ERROR_SYNTAX, {"image_width"});
    refused("[530, 0,", "[530, 1,", ERROR_RANGE, {"camera_matrix", "skew"});
    refused("[1, 0, 0, 0, 1", "[1, 0, 1, 0, 1", ERROR_ROTATION, {"rectification_matrix"});
    refused("  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]", "  data: [1, 0", ERROR_SYNTAX, {"line"});
    refused("camera_name: right", "binning_x: 2", ERROR_RANGE, {"binning"});
    const std::string alone = here.write("front.yaml", good_left);
    check_refused(alone, {}, ERROR_MISSING, {"pair"});
    check_refused(alone + "," + alone + "," + alone, {}, ERROR_ARGUMENT, {"two"});
    here.write("left.yaml", good_right);
    check_refused(here.write("right.yaml", good_left), {}, ERROR_BASELINE, {"swapped"});
}

TEST_CASE("our own text is loaded, and edits are accepted on request") {
    const folder here;
    calibration value = load(here.write("calib.txt", middlebury)).value;
    std::string message;
    const std::string path = here.path + "/rig.txt";
    REQUIRE(calibration_file_write(path, value, &message) == ERROR_OK);
    const loaded again = load(path);
    REQUIRE(again.code == ERROR_OK);
    CHECK(again.report.format == "vergence");
    CHECK(calibration_crc(&again.value) == calibration_crc(&value));
    std::ifstream stream(path);
    const std::string text((std::istreambuf_iterator<char>(stream)),
                           std::istreambuf_iterator<char>());
    const std::string edited = here.write("edited.txt", replace(text, "-193.001", "-194.001"));
    check_refused(edited, {}, ERROR_CRC, {"checksum", "--accept-edits"});
    import_options options;
    options.accept_edits = true;
    const loaded accepted = load(edited, options);
    REQUIRE(accepted.code == ERROR_OK);
    CHECK(accepted.value.translation_right_left_mm[0] == -194.001);
    check_refused(here.write("range.txt", replace(text, "rms_px 0.000000", "rms_px 1000.000001")),
                  {}, ERROR_RANGE, {"line 23", "rms_px", "0..1000 px"});
}

TEST_CASE("other files are rejected in one line") {
    const folder here;
    check_refused(here.path, {}, ERROR_ARGUMENT, {"calibration"});
    check_refused(here.path + "/none.txt", {}, ERROR_ARGUMENT, {"No such file"});
    check_refused(here.write("empty", ""), {}, ERROR_SYNTAX, {"empty"});
    check_refused(here.write("text", "hello\n"), {}, ERROR_SYNTAX, {"calibration"});
    check_refused(here.write("nul", std::string("cam0=\0", 6)), {}, ERROR_SYNTAX, {"not a text"});
    check_refused(here.write("large", std::string(20 << 20, ' ')), {}, ERROR_TOO_LARGE, {"16 MiB"});
    const std::string calib = here.write("calib.txt", middlebury);
    here.write("calibration.txt", "x");
    check_refused(here.path, {}, ERROR_ARGUMENT, {"more than one"});
    check_refused(calib + "," + calib, {}, ERROR_SYNTAX, {"calibration"});
    const loaded half = load(calib + ",/none");
    CHECK(half.code == ERROR_ARGUMENT);
    CHECK(half.message.find("/none: No such file") == 0);
}

TEST_CASE("writing leaves no partial file") {
    const folder here;
    const calibration value = load(here.write("calib.txt", middlebury)).value;
    std::string message;
    CHECK(calibration_file_write(here.path + "/no/rig.txt", value, &message) == ERROR_BUFFER);
    CHECK(message.find("/no/rig.txt: ") != std::string::npos);
    CHECK(calibration_file_write(here.path, value, &message) == ERROR_BUFFER);
    calibration wrong = value;
    wrong.left.fx_px = std::nan("");
    CHECK(calibration_file_write(here.path + "/rig.txt", wrong, &message) == ERROR_RANGE);
    size_t files = 0;
    for (const auto &entry : std::filesystem::directory_iterator(here.path)) {
        files += entry.path().filename() == "calib.txt" ? 0 : 1;
    }
    CHECK(files == 0);
}
