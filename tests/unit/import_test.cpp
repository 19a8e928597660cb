// SPDX-License-Identifier: Apache-2.0
// Formats without a writer at hand: files in the published form, numbers checked by hand.
#include "tools/host/import.hpp"

#include <doctest/doctest.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "core/error.h"
#include "core/geometry.h"
#include "synthetic/seed.hpp"
#include "tools/host/calibration_file.hpp"

namespace {

/// A directory of its own that goes away with the test.
struct folder {
    std::string path;
    folder() {
        char name[] = "/tmp/vergence-import-XXXXXX";
        REQUIRE(mkdtemp(name) != nullptr);
        path = name;
    }
    ~folder() { std::filesystem::remove_all(path); }
    folder(const folder &) = delete;
    folder &operator=(const folder &) = delete;
    std::string write(const std::string &name, const std::string &text) const {
        std::ofstream(path + "/" + name, std::ios::binary) << text;
        return path + "/" + name;
    }
};

struct loaded {
    int code;
    calibration value;
    calibration_file_report report;
    std::string message;
};

loaded load(const std::string &path, const import_options &options = {}) {
    loaded result{};
    result.code =
        calibration_file_load(path, options, &result.value, &result.report, &result.message);
    return result;
}

std::string replace(std::string text, const std::string &from, const std::string &to) {
    const size_t at = text.find(from);
    REQUIRE(at != std::string::npos);
    return text.replace(at, from.size(), to);
}

/// Refused with this code, in one line that names the file and all of `words`.
void check_refused(const std::string &path, const import_options &options, int code,
                   std::initializer_list<const char *> words) {
    const loaded result = load(path, options);
    INFO("message: ", result.message);
    CHECK(result.code == code);
    CHECK(result.message.find('\n') == std::string::npos);
    CHECK(result.message.find(path.substr(0, path.find(','))) == 0);
    for (const char *word : words) {
        INFO("word: ", std::string(word));
        CHECK(result.message.find(word) != std::string::npos);
    }
}

const char *const middlebury =
    "cam0=[3997.684 0 1176.728; 0 3997.684 1011.728; 0 0 1]\n"
    "cam1=[3997.684 0 1307.839; 0 3997.684 1011.728; 0 0 1]\n"
    "doffs=131.111\nbaseline=193.001\nwidth=2964\nheight=1988\nndisp=280\nisint=0\nvmin=31\n"
    "vmax=257\ndyavg=0.918\ndymax=1.516\n";

const char *const kitti_raw =
    "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.950000e-02\n"
    "S_00: 1.392000e+03 5.120000e+02\n"
    "K_00: 9.842439e+02 0.000000e+00 6.900000e+02 0.000000e+00 9.808141e+02 2.331966e+02 "
    "0.000000e+00 0.000000e+00 1.000000e+00\n"
    "D_00: -3.728755e-01 2.037299e-01 2.219027e-03 1.383707e-03 -7.233722e-02\n"
    "R_00: 1.000000e+00 0.000000e+00 0.000000e+00 0.000000e+00 1.000000e+00 0.000000e+00 "
    "0.000000e+00 0.000000e+00 1.000000e+00\n"
    "T_00: 2.573699e-16 -1.059758e-16 1.614870e-16\n"
    "S_01: 1.392000e+03 5.120000e+02\n"
    "K_01: 9.895267e+02 0.000000e+00 7.020000e+02 0.000000e+00 9.878386e+02 2.455590e+02 "
    "0.000000e+00 0.000000e+00 1.000000e+00\n"
    "D_01: -3.644661e-01 1.790019e-01 1.148107e-03 -6.298563e-04 -5.314062e-02\n"
    "R_01: 9.993513e-01 1.860866e-02 -3.083487e-02 -1.887662e-02 9.997863e-01 -8.421873e-03 "
    "3.067156e-02 8.998467e-03 9.994890e-01\n"
    "T_01: -5.370000e-01 4.822061e-03 -1.252488e-02\n"
    "S_02: 1.392000e+03 5.120000e+02\n"
    "K_02: 9.597910e+02 0.000000e+00 6.960217e+02 0.000000e+00 9.569251e+02 2.241806e+02 "
    "0.000000e+00 0.000000e+00 1.000000e+00\n"
    "D_02: -3.691481e-01 1.968681e-01 1.353473e-03 5.677587e-04 -6.770705e-02\n"
    "R_02: 9.999758e-01 -5.267463e-03 -4.552439e-03 5.251945e-03 9.999804e-01 -3.413835e-03 "
    "4.570332e-03 3.389843e-03 9.999838e-01\n"
    "T_02: 5.956621e-02 2.900141e-04 2.577209e-03\n"
    "S_rect_02: 1.242000e+03 3.750000e+02\n"
    "R_rect_02: 9.998817e-01 1.511453e-02 -2.841595e-03 -1.511724e-02 9.998853e-01 -9.338510e-04 "
    "2.827154e-03 9.766976e-04 9.999955e-01\n"
    "P_rect_02: 7.215377e+02 0.000000e+00 6.095593e+02 4.485728e+01 0.000000e+00 7.215377e+02 "
    "1.728540e+02 2.163791e-01 0.000000e+00 0.000000e+00 1.000000e+00 2.745884e-03\n"
    "S_03: 1.392000e+03 5.120000e+02\n"
    "K_03: 9.037596e+02 0.000000e+00 6.957519e+02 0.000000e+00 9.019653e+02 2.242509e+02 "
    "0.000000e+00 0.000000e+00 1.000000e+00\n"
    "D_03: -3.639558e-01 1.788651e-01 6.029694e-04 -3.922424e-04 -5.382460e-02\n"
    "R_03: 9.995599e-01 1.699522e-02 -2.431313e-02 -1.704422e-02 9.998531e-01 -1.809756e-03 "
    "2.427880e-02 2.223358e-03 9.997028e-01\n"
    "T_03: -4.731050e-01 5.551470e-03 -5.250882e-03\n"
    "S_rect_03: 1.242000e+03 3.750000e+02\n"
    "R_rect_03: 9.998321e-01 -7.193136e-03 1.685599e-02 7.232804e-03 9.999712e-01 -2.293585e-03 "
    "-1.683901e-02 2.415116e-03 9.998553e-01\n"
    "P_rect_03: 7.215377e+02 0.000000e+00 6.095593e+02 -3.395242e+02 0.000000e+00 7.215377e+02 "
    "1.728540e+02 2.199936e+00 0.000000e+00 0.000000e+00 1.000000e+00 2.729905e-03\n";

const char *const kitti_odometry =
    "P0: 7.188560e+02 0.000000e+00 6.071928e+02 0.000000e+00 0.000000e+00 7.188560e+02 "
    "1.852157e+02 0.000000e+00 0.000000e+00 0.000000e+00 1.000000e+00 0.000000e+00\n"
    "P1: 7.188560e+02 0.000000e+00 6.071928e+02 -3.861448e+02 0.000000e+00 7.188560e+02 "
    "1.852157e+02 0.000000e+00 0.000000e+00 0.000000e+00 1.000000e+00 0.000000e+00\n"
    "P2: 7.188560e+02 0.000000e+00 6.071928e+02 4.538225e+01 0.000000e+00 7.188560e+02 "
    "1.852157e+02 -1.130887e-01 0.000000e+00 0.000000e+00 1.000000e+00 3.779761e-03\n"
    "P3: 7.188560e+02 0.000000e+00 6.071928e+02 -3.372877e+02 0.000000e+00 7.188560e+02 "
    "1.852157e+02 2.369057e+00 0.000000e+00 0.000000e+00 1.000000e+00 4.915215e-03\n";

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

}  // namespace

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
    // Found by its directory as well, and with the line ends of Windows.
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
    refused("width=2964", "width=5000", ERROR_RANGE, {"left_size_px", "4096"});
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
    // Camera 0 is the origin: the pose is R_01 and T_01 as they stand.
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
    // The same two cameras stand in the rectified projections: their distance is
    // |(0.532712, 0.002753, 0.000016)| m.
    CHECK(calibration_baseline_mm(&pair.value) == doctest::Approx(532.719).epsilon(1e-5));
    // R_rect of both sides turn into one frame: R_right_left = R_rect_03^T R_rect_02.
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
    options.first_camera = 1;  // P1 and P2: the left one of these stands to the right
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
    refused("plumb_bob", "equidistant", ERROR_DISTORTION, {"equidistant", "plumb_bob"});
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

TEST_CASE("our own text is loaded, and edits are taken when told so") {
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

TEST_CASE("what is no calibration is refused in one line") {
    const folder here;
    check_refused(here.path, {}, ERROR_ARGUMENT, {"calibration"});
    check_refused(here.path + "/none.txt", {}, ERROR_ARGUMENT, {"cannot be opened"});
    check_refused(here.write("empty", ""), {}, ERROR_SYNTAX, {"empty"});
    check_refused(here.write("text", "hello\n"), {}, ERROR_SYNTAX, {"no calibration"});
    check_refused(here.write("nul", std::string("cam0=\0", 6)), {}, ERROR_SYNTAX, {"no text"});
    check_refused(here.write("large", std::string(20 << 20, ' ')), {}, ERROR_TOO_LARGE, {"16 MiB"});
    const std::string calib = here.write("calib.txt", middlebury);
    here.write("calibration.txt", "x");
    check_refused(here.path, {}, ERROR_ARGUMENT, {"more than one"});
    check_refused(calib + "," + calib, {}, ERROR_SYNTAX, {"no calibration"});
    const loaded half = load(calib + ",/none");
    CHECK(half.code == ERROR_ARGUMENT);
    CHECK(half.message.find("/none: cannot be opened") == 0);
}

TEST_CASE("writing leaves no partial file") {
    const folder here;
    const calibration value = load(here.write("calib.txt", middlebury)).value;
    std::string message;
    CHECK(calibration_file_write(here.path + "/no/rig.txt", value, &message) == ERROR_BUFFER);
    CHECK(message.find("/no/rig.txt: cannot be written") != std::string::npos);
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

TEST_CASE("mutated files never pass as something invalid") {
    const uint64_t seed = synthetic::test_seed();
    INFO("VERGENCE_SEED=", seed);
    std::mt19937_64 random(seed);
    const auto whole = [&](size_t low, size_t high) {
        return std::uniform_int_distribution<size_t>(low, high)(random);
    };
    import_options options;
    options.width_px = 1241;
    options.height_px = 376;
    const std::string starts[] = {middlebury, kitti_raw, kitti_odometry,
                                  camera_info("left", identity, P_left)};
    int taken = 0;
    for (int i = 0; i < 20000; i++) {
        import_file file{"file", starts[i % 4]};
        for (size_t n = whole(1, 3); n > 0 && !file.text.empty(); n--) {
            const size_t at = whole(0, file.text.size() - 1);
            switch (whole(0, 3)) {
                case 0:
                    file.text[at] = static_cast<char>(whole(0, 255));
                    break;
                case 1:
                    file.text.erase(at, whole(1, 30));
                    break;
                case 2:
                    file.text.insert(at, file.text.substr(at / 2, whole(1, 60)));
                    break;
                default:
                    file.text[at] = static_cast<char>(whole('-', '9'));
            }
        }
        const import_file other{"other", camera_info("right", identity, P_right)};
        try {
            import_pair pair = i % 4 == 0   ? import_middlebury(file, options)
                               : i % 4 == 3 ? import_ros({file, other}, options)
                                            : import_kitti(file, options);
            taken++;
            std::strcpy(pair.value.id, "x");
            char text[CALIBRATION_TEXT_MAX_BYTES];
            const int length = calibration_print(&pair.value, text, sizeof text);
            const bool good = length < 0 || calibration_parse(text, static_cast<size_t>(length),
                                                              &pair.value, nullptr) == ERROR_OK;
            if (!good) {
                CHECK(good);
            }
        } catch (const import_failure &failure) {
            if (failure.code >= 0 || failure.message.empty()) {
                INFO("text ", file.text);
                CHECK(failure.code < 0);
                CHECK_FALSE(failure.message.empty());
            }
        }
    }
    MESSAGE(taken, " of 20000 mutated files were still read");
    CHECK(taken > 1000);
}
