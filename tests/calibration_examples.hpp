// SPDX-License-Identifier: Apache-2.0
/// Calibrations and texts that the tests of stereo/geometry/calibration.h share.
#ifndef VERGENCE_TESTS_CALIBRATION_EXAMPLES_HPP
#define VERGENCE_TESTS_CALIBRATION_EXAMPLES_HPP

#include <doctest/doctest.h>

#include <cstdio>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "core/crc.h"
#include "stereo/geometry/calibration.h"
#include "stereo/geometry/calibration_grammar.h"

namespace calibration_examples {

using Random = std::mt19937_64;

inline double uniform(Random &random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

inline int whole(Random &random, int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random);
}

inline std::string print(const calibration &value) {
    char text[CALIBRATION_TEXT_MAX_BYTES];
    const int length = calibration_print(&value, text, sizeof text);
    REQUIRE(length > 0);
    REQUIRE(text[length] == '\0');
    return std::string(text, static_cast<size_t>(length));
}

inline int parse(const std::string &text, calibration *result, calibration_fault *fault = nullptr) {
    // A copy of exactly this size, so that the address sanitizer sees a read beyond the end.
    const std::vector<char> bytes(text.begin(), text.end());
    return calibration_parse(bytes.data(), bytes.size(), result, fault);
}

/// Puts the right checksum on a text whose lines above it were changed.
inline std::string reframe(const std::string &text) {
    const std::string body = text.substr(0, text.rfind("crc32 "));
    char line[32];
    std::snprintf(line, sizeof line, "crc32 %08x\n", crc_update(0, body.data(), body.size()));
    return body + line;
}

inline std::string replace(std::string text, const std::string &from, const std::string &to) {
    const size_t at = text.find(from);
    REQUIRE(at != std::string::npos);
    return text.replace(at, from.size(), to);
}

inline calibration example() {
    calibration value{};
    std::strcpy(value.id, "bench-2.rig_A");
    std::strcpy(value.date, "2024-02-29");
    std::strcpy(value.note, "unit assumed: mm");
    value.left = {640, 480, 533.5, 534.25, 341.625,           234.5, -0.28, 0.09, 0.0012, -0.0001,
                  0.0, 0,   0,     0,      LENS_BROWN_CONRADY};
    value.right = {640,    480,   536.75, 536.5,   326.5,
                   249.25, -0.29, 0.1,    -0.0005, 0.0001,
                   0.01,   0,     0,      0,       LENS_BROWN_CONRADY};
    const double rotation[3] = {0.006, 0.0047, -0.0036};
    const double translation[3] = {-99.5, 1.25, 0.0625};
    std::memcpy(value.rotation_right_left_rad, rotation, sizeof rotation);
    std::memcpy(value.translation_right_left_mm, translation, sizeof translation);
    value.depth_near_mm = 250;
    value.depth_far_mm = 900.5;
    value.rms_px = 0.325;
    return value;
}

inline calibration rectified_example() {
    calibration value = example();
    value.rectified = true;
    value.left = {640, 480, 500, 500, 320, 240, 0, 0, 0, 0, 0, 0, 0, 0, LENS_BROWN_CONRADY};
    value.right = value.left;
    value.right.cx_px = 331.086;
    for (int i = 0; i < 3; i++) {
        value.rotation_right_left_rad[i] = 0;
        value.translation_right_left_mm[i] = i == 0 ? -193.001 : 0;
    }
    return value;
}

/// The same rig, as a motorized instrument calibrates it: version 2 of the text.
inline calibration with_origin(calibration value) {
    value.has_origin = true;
    value.scale_sigma = 0.00015;
    value.yaw_sigma_rad = 0.000025;
    std::strcpy(value.origin.instrument, "rig");
    std::strcpy(value.origin.side[0].camera, "Webcam C at usb-0000:00:14.0-1");
    for (int side = 0; side < 2; side++) {
        calibration_side_origin &origin = value.origin.side[side];
        origin.window = {512, 384, 1};
        origin.axis[CALIBRATION_PAN] = {CALIBRATION_AXIS_KNOWN, side == 0 ? 3.57 : -3.27, 0.0};
        origin.axis[CALIBRATION_ZOOM] = {CALIBRATION_AXIS_KNOWN, 421.5, 0.5};
        origin.axis[CALIBRATION_FOCUS] = {CALIBRATION_AXIS_KNOWN, 612, 1};
        origin.axis[CALIBRATION_IRIS].kind = CALIBRATION_AXIS_NONE;
    }
    value.origin.side[1].window = {0, 0, 0};
    value.origin.side[1].axis[CALIBRATION_FOCUS] = {CALIBRATION_AXIS_UNKNOWN, 0, 0};
    return value;
}

inline bool same_bits(const calibration &a, const calibration &b) {
    // Through the printed text no padding byte counts.
    for (int i = 0; i < calibration_grammar.count; i++) {
        const keyed_field &field = calibration_grammar.fields[i];
        for (int j = 0; keyed_text_has_numbers(&field) && j < field.count; j++) {
            if (keyed_text_value(&field, j, &a) != keyed_text_value(&field, j, &b)) {
                return false;
            }
        }
    }
    return std::strcmp(a.id, b.id) == 0 && std::strcmp(a.date, b.date) == 0 &&
           std::strcmp(a.note, b.note) == 0 && a.rectified == b.rectified;
}

}  // namespace calibration_examples

#endif
