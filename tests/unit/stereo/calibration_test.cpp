// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/calibration.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "calibration_examples.hpp"
#include "core/error.h"
#include "stereo/geometry/calibration_grammar.h"
#include "stereo/geometry/geometry.h"

using namespace calibration_examples;

TEST_CASE("the text of an example is readable and exact") {
    const std::string text = print(example());
    CHECK(text.find("vergence-calibration 1\nid bench-2.rig_A\ndate 2024-02-29\n"
                    "note unit assumed: mm\nrectified no\nleft_size_px 640 480\n"
                    "left_focal_px 533.500000000 534.250000000\n") == 0);
    CHECK(text.find("\nrotation_right_left_rad 0.006000000000 0.004700000000 -0.003600000000\n"
                    "translation_right_left_mm -99.500000000 1.250000000 0.062500000\n"
                    "depth_range_mm 250.000 900.500\nrms_px 0.325000\ncrc32 ") !=
          std::string::npos);
    calibration parsed;
    REQUIRE(parse(text, &parsed) == ERROR_OK);
    CHECK(same_bits(parsed, example()));
    CHECK(print(parsed) == text);
    CHECK(text == reframe(text));
    char crc[16];
    std::snprintf(crc, sizeof crc, "%08x", calibration_crc(&parsed));
    CHECK(text.substr(text.size() - 9, 8) == crc);
}

TEST_CASE("every single changed bit is noticed") {
    const std::string text = print(example());
    int accepted = 0;
    for (size_t i = 0; i < text.size(); i++) {
        for (int bit = 0; bit < 8; bit++) {
            std::string changed = text;
            changed[i] = static_cast<char>(changed[i] ^ (1 << bit));
            calibration parsed;
            accepted += parse(changed, &parsed) == ERROR_OK ? 1 : 0;
        }
        calibration parsed;
        accepted += parse(text.substr(0, i), &parsed) == ERROR_OK ? 1 : 0;
    }
    CHECK(accepted == 0);
}

TEST_CASE("each mistake is named with its line and field") {
    const std::string good = print(example());
    const struct {
        std::string text;
        int code, line;
        const char *field;
    } mistakes[] = {
        {"", ERROR_SYNTAX, 1, ""},
        {"hello\n", ERROR_SYNTAX, 1, ""},
        {replace(good, "calibration 1", "calibration 5"), ERROR_VERSION, 1, ""},
        {replace(good, "calibration 1", "calibration 1 "), ERROR_VERSION, 1, ""},
        {replace(good, "calibration 1\n", "calibration 1\r\n"), ERROR_SYNTAX, 1, ""},
        {replace(good, "640 480\nleft_f", "640 480\r\nleft_f"), ERROR_SYNTAX, 6, "left_size_px"},
        {good.substr(0, good.size() - 1), ERROR_SYNTAX, 24, "crc32"},
        {good.substr(0, good.rfind("crc32")), ERROR_MISSING, 24, "crc32"},
        {good + "\n", ERROR_SYNTAX, 24, "crc32"},
        {good + good, ERROR_SYNTAX, 24, "crc32"},
        {reframe(replace(good, "date 2024-02-29\n", "")), ERROR_MISSING, 3, "date"},
        {reframe(replace(good, "date 2024-02-29\n", "date 2024-02-29\nid x\n")), ERROR_DUPLICATE, 4,
         "id"},
        {reframe(replace(good, "rectified", "rectify")), ERROR_SYNTAX, 5, "rectified"},
        {reframe(replace(good, "note unit", "colour red\nnote unit")), ERROR_SYNTAX, 4, "note"},
        {reframe(replace(good, "left_size_px 640 480\n", "")), ERROR_MISSING, 6, "left_size_px"},
        {replace(good, "rms_px 0.325000\n", ""), ERROR_MISSING, 23, "rms_px"},
        {reframe(replace(good, "02-29", "02-30")), ERROR_SYNTAX, 3, "date"},
        {reframe(replace(good, "2024-02-29", "2023-02-29")), ERROR_SYNTAX, 3, "date"},
        {reframe(replace(good, "2024-02-29", "2024-13-01")), ERROR_SYNTAX, 3, "date"},
        {reframe(replace(good, "2024-02-29", "")), ERROR_SYNTAX, 3, "date"},
        {reframe(replace(good, "date 2024", "date  2024")), ERROR_SYNTAX, 3, "date"},
        {reframe(replace(good, "id bench-2", "id bench 2")), ERROR_SYNTAX, 2, "id"},
        {reframe(replace(good, "bench", std::string(40, 'x'))), ERROR_SYNTAX, 2, "id"},
        {reframe(replace(good, ": mm\n", ": mm \n")), ERROR_SYNTAX, 4, "note"},
        {reframe(replace(good, "note unit", "note " + std::string(240, 'x'))), ERROR_SYNTAX, 4,
         "note"},
        {reframe(replace(good, "unit assumed", "\xc2\xb5m")), ERROR_SYNTAX, 4, "note"},
        {reframe(replace(good, "rectified no", "rectified No")), ERROR_SYNTAX, 5, "rectified"},
        {reframe(replace(good, "rectified no", "rectified yes")), ERROR_RANGE, 5, "rectified"},
        {reframe(replace(good, "640 480", "640")), ERROR_SYNTAX, 6, "left_size_px"},
        {reframe(replace(good, "640 480", "640 480 1")), ERROR_SYNTAX, 6, "left_size_px"},
        {reframe(replace(good, "640 480", "640 480 ")), ERROR_SYNTAX, 6, "left_size_px"},
        {reframe(replace(good, "640 480", "0 480")), ERROR_RANGE, 6, "left_size_px"},
        {reframe(replace(good, "640 480", "32769 480")), ERROR_RANGE, 6, "left_size_px"},
        {reframe(replace(good, "533.500000000", "nan")), ERROR_SYNTAX, 7, "left_focal_px"},
        {reframe(replace(good, "533.500000000", "0.000000000")), ERROR_RANGE, 7, "left_focal_px"},
        {reframe(replace(good, "533.500000000", "-533.500000000")), ERROR_RANGE, 7,
         "left_focal_px"},
        {reframe(replace(good, "533.500000000", "533.5")), ERROR_SYNTAX, 7, "left_focal_px"},
        {reframe(replace(good, "533.500000000", "9999999999999999999999.000000000")), ERROR_RANGE,
         7, "left_focal_px"},
        {reframe(replace(good, "left_k1 -0.280000000000", "left_k1 -9.000000000000")),
         ERROR_DISTORTION, 0, "left"},
        {reframe(replace(good, "-99.500000000 1.250000000 0.062500000",
                         "0.000000000 0.000000000 0.000000000")),
         ERROR_BASELINE, 21, "translation_right_left_mm"},
        {reframe(replace(good, "0.006000000000 0.00", "3.100000000000 3.00")), ERROR_ROTATION, 20,
         "rotation_right_left_rad"},
        {reframe(replace(good, "250.000 900.500", "900.500 250.000")), ERROR_DEPTH_RANGE, 22,
         "depth_range_mm"},
        {reframe(replace(good, "250.000 900.500", "0.000 900.500")), ERROR_DEPTH_RANGE, 22,
         "depth_range_mm"},
        {replace(good, "900.500", "900.501"), ERROR_CRC, 24, "crc32"},
        {replace(good, "crc32 ", "crc32  "), ERROR_SYNTAX, 24, "crc32"},
    };
    for (const auto &mistake : mistakes) {
        const calibration before = rectified_example();
        calibration result = before;
        calibration_fault fault{-1, nullptr, nullptr, 0};
        INFO("text ", mistake.text);
        CHECK(parse(mistake.text, &result, &fault) == mistake.code);
        CHECK(fault.line == mistake.line);
        CHECK(std::string(fault.field) == mistake.field);
        CHECK(same_bits(result, before));
        CHECK(parse(mistake.text, &result) == mistake.code);  // the fault may be NULL
    }
}

TEST_CASE("a wrong checksum comes with the right one") {
    const std::string changed = replace(print(example()), "900.500", "901.500");
    calibration parsed;
    calibration_fault fault;
    REQUIRE(parse(changed, &parsed, &fault) == ERROR_CRC);
    char line[32];
    std::snprintf(line, sizeof line, "crc32 %08x\n", fault.crc);
    const std::string mended = changed.substr(0, changed.rfind("crc32 ")) + line;
    CHECK(mended == reframe(changed));
    CHECK(parse(mended, &parsed) == ERROR_OK);
    CHECK(parsed.depth_far_mm == 901.5);
}

TEST_CASE("values are checked before they are printed") {
    char text[CALIBRATION_TEXT_MAX_BYTES];
    const auto code = [&](auto change) {
        calibration value = example();
        change(value);
        const int printed = calibration_print(&value, text, sizeof text);
        const int valid = calibration_validate(&value, nullptr);
        CHECK((printed > 0 ? 0 : printed) == valid);
        return valid;
    };
    const double nan = std::nan(""), infinite = std::numeric_limits<double>::infinity();
    CHECK(code([](calibration &) {}) == ERROR_OK);
    CHECK(code([&](calibration &c) { c.left.fx_px = nan; }) == ERROR_RANGE);
    CHECK(code([&](calibration &c) { c.right.k3 = infinite; }) == ERROR_RANGE);
    CHECK(code([&](calibration &c) { c.rotation_right_left_rad[1] = nan; }) == ERROR_RANGE);
    CHECK(code([&](calibration &c) { c.translation_right_left_mm[2] = -infinite; }) == ERROR_RANGE);
    CHECK(code([&](calibration &c) { c.rms_px = nan; }) == ERROR_RANGE);
    CHECK(code([&](calibration &c) { c.depth_far_mm = infinite; }) == ERROR_RANGE);
    CHECK(code([](calibration &c) { c.left.width_px = 0; }) == ERROR_RANGE);
    CHECK(code([](calibration &c) { c.id[0] = '\0'; }) == ERROR_SYNTAX);
    CHECK(code([](calibration &c) { std::memset(c.id, 'x', sizeof c.id); }) == ERROR_SYNTAX);
    CHECK(code([](calibration &c) { std::memset(c.note, 'x', sizeof c.note); }) == ERROR_SYNTAX);
    CHECK(code([](calibration &c) { std::memset(c.date, '1', sizeof c.date); }) == ERROR_SYNTAX);
    CHECK(code([](calibration &c) { c.note[2] = '\n'; }) == ERROR_SYNTAX);
    CHECK(code([](calibration &c) { c.rectified = true; }) == ERROR_RANGE);
}

TEST_CASE("print says when the buffer is too small and never writes beyond it") {
    const calibration value = example();
    const std::string text = print(value);
    for (size_t size = 0; size <= text.size() + 1; size++) {
        std::vector<char> buffer(size + 4, '#');
        const int code = calibration_print(&value, buffer.data(), size);
        CHECK(code == (size > text.size() ? static_cast<int>(text.size()) : ERROR_BUFFER));
        CHECK(std::string(buffer.end() - 4, buffer.end()) == "####");
    }
}

TEST_CASE("a rectified calibration is one in every respect") {
    const calibration good = rectified_example();
    CHECK(calibration_validate(&good, nullptr) == ERROR_OK);
    const auto code = [](auto change) {
        calibration value = rectified_example();
        change(value);
        calibration_fault fault;
        const int result = calibration_validate(&value, &fault);
        CHECK(std::string(fault.field) == "rectified");
        return result;
    };
    CHECK(code([](calibration &c) { c.left.k1 = 1e-9; }) == ERROR_RANGE);
    CHECK(code([](calibration &c) { c.right.p2 = 1e-9; }) == ERROR_RANGE);
    CHECK(code([](calibration &c) { c.right.fx_px += 1e-6; }) == ERROR_RANGE);
    CHECK(code([](calibration &c) { c.right.fy_px += 1e-6; }) == ERROR_RANGE);
    CHECK(code([](calibration &c) { c.right.cy_px += 1e-6; }) == ERROR_RANGE);
    CHECK(code([](calibration &c) { c.right.width_px += 1; }) == ERROR_RANGE);
    CHECK(code([](calibration &c) { c.right.height_px += 1; }) == ERROR_RANGE);
    CHECK(code([](calibration &c) { c.rotation_right_left_rad[2] = 1e-9; }) == ERROR_RANGE);
    CHECK(code([](calibration &c) { c.translation_right_left_mm[1] = 1e-9; }) == ERROR_RANGE);
    CHECK(code([](calibration &c) { c.translation_right_left_mm[0] = 193; }) == ERROR_RANGE);
}

TEST_CASE("baseline and vergence depth of a toed-in rig") {
    // Two cameras 250 mm apart, both turned inwards so that the axes meet 1.8 m in front.
    calibration value = example();
    const double angle = std::atan2(125.0, 1800.0);
    // p_left = R(-a) p_world and p_right = R(a) (p_world - (250, 0, 0)), turned about y.
    const double turn_left[3] = {0, -angle, 0}, turn_right[3] = {0, angle, 0};
    double R_left_world[9], R_right_world[9];
    geometry_rotation_from_vector(turn_left, R_left_world);
    geometry_rotation_from_vector(turn_right, R_right_world);
    const double world_left[9] = {R_left_world[0], R_left_world[3], R_left_world[6],
                                  R_left_world[1], R_left_world[4], R_left_world[7],
                                  R_left_world[2], R_left_world[5], R_left_world[8]};
    double R_right_left[9];
    geometry_multiply(R_right_world, world_left, R_right_left);
    REQUIRE(geometry_vector_from_rotation(R_right_left, value.rotation_right_left_rad) == ERROR_OK);
    const double centre_mm[3] = {-250, 0, 0};
    geometry_rotate(R_right_world, centre_mm, value.translation_right_left_mm);
    CHECK(calibration_baseline_mm(&value) == doctest::Approx(250));
    CHECK(calibration_vergence_depth_mm(&value) ==
          doctest::Approx(std::sqrt(1800.0 * 1800.0 + 125.0 * 125.0)));
    value.rotation_right_left_rad[1] = -value.rotation_right_left_rad[1];
    CHECK(calibration_vergence_depth_mm(&value) < 0);  // looking apart
    value.rotation_right_left_rad[1] = 0;
    CHECK(calibration_vergence_depth_mm(&value) < 0);  // parallel
}

TEST_CASE("the grammar's list is the text's order and fits its numbers") {
    const keyed_field *fields = calibration_grammar.fields;
    calibration whole = with_origin(example());
    whole.axes_in_sigma = true;
    whole.right.kind = LENS_RATIONAL;
    std::istringstream lines(print(whole));
    std::string line;
    std::getline(lines, line);
    CHECK(line == CALIBRATION_GRAMMAR_MAGIC "4");
    for (int i = 0; i < calibration_grammar.count; i++) {
        std::getline(lines, line);
        CHECK(line.substr(0, line.find(' ')) == fields[i].name);
        const double scale = std::pow(10.0, fields[i].decimals);
        CHECK(static_cast<double>(fields[i].max) * scale <= std::pow(2.0, 50));
        CHECK(static_cast<double>(fields[i].min) * scale >= -std::pow(2.0, 50));
    }
    std::getline(lines, line);
    CHECK(line.substr(0, 6) == "crc32 ");
}

TEST_CASE("later versions say what the pictures were taken with, version 1 does not") {
    const calibration value = with_origin(example());
    const std::string text = print(value);
    CHECK(text.find("\ninstrument rig\n") != std::string::npos);
    CHECK(text.find("\nleft_camera Webcam C at usb-0000:00:14.0-1\n") != std::string::npos);
    CHECK(text.find("\nright_camera unknown\n") != std::string::npos);
    CHECK(text.find("\nleft_window_px 512 384 1\n") != std::string::npos);
    CHECK(text.find("\nright_window_px unknown\n") != std::string::npos);
    CHECK(text.find("\nright_pan_deg -3.270 0.000\n") != std::string::npos);
    CHECK(text.find("\nright_focus_counts unknown\n") != std::string::npos);
    CHECK(text.find("\nleft_iris_counts none\n") != std::string::npos);
    calibration parsed{};
    REQUIRE(calibration_parse(text.data(), text.size(), &parsed, nullptr) == ERROR_OK);
    CHECK(print(parsed) == text);
    CHECK(parsed.origin.side[1].axis[CALIBRATION_PAN].mean == -3.27);
    CHECK(parsed.origin.side[0].axis[CALIBRATION_ZOOM].spread == 0.5);
    CHECK(parsed.origin.side[0].window.row_px == 384);

    CHECK(text.find(CALIBRATION_GRAMMAR_MAGIC "2\n") == 0);

    calibration of_state = value;
    of_state.axes_in_sigma = true;
    const std::string third = print(of_state);
    CHECK(third.find("\naxes_in_sigma yes\ncrc32 ") != std::string::npos);
    REQUIRE(calibration_parse(third.data(), third.size(), &parsed, nullptr) == ERROR_OK);
    CHECK(parsed.axes_in_sigma);
    CHECK(print(parsed) == third);

    const std::string old = print(example());
    REQUIRE(calibration_parse(old.data(), old.size(), &parsed, nullptr) == ERROR_OK);
    CHECK_FALSE(parsed.has_origin);
    CHECK(parsed.origin.side[0].axis[CALIBRATION_PAN].kind == CALIBRATION_AXIS_UNKNOWN);
    CHECK(print(parsed) == old);
}

TEST_CASE("version 4 says the kind of each lens, and is only for what needs it") {
    for (const bool origin : {false, true}) {
        calibration value = origin ? with_origin(example()) : example();
        value.left.kind = LENS_EQUIDISTANT;
        value.left.p1 = value.left.p2 = 0;
        value.left.k1 = -0.02;
        value.left.k4 = 0.000123456789;
        value.right.kind = LENS_RATIONAL;
        value.right.k4 = 0.25, value.right.k5 = -0.125, value.right.k6 = 0.0625;
        const std::string text = print(value);
        CHECK(text.find(CALIBRATION_GRAMMAR_MAGIC "4\n") == 0);
        CHECK(text.find("\nleft_lens equidistant\nleft_k4 0.000123456789\n") != std::string::npos);
        CHECK(text.find("\nright_lens rational\nright_k4 0.250000000000\nright_k5 -0.1250000000\n"
                        "right_k6 0.06250000\ncrc32 ") != std::string::npos);
        calibration parsed{};
        REQUIRE(calibration_parse(text.data(), text.size(), &parsed, nullptr) == ERROR_OK);
        CHECK(print(parsed) == text);
        CHECK(parsed.left.kind == LENS_EQUIDISTANT);
        CHECK(parsed.left.k4 == value.left.k4);
        CHECK(parsed.right.k5 == value.right.k5);
        CHECK(parsed.origin.instrument == std::string(value.origin.instrument));

        calibration_fault fault{};
        const std::string unknown = reframe(replace(text, "lens equidistant", "lens orthographic"));
        CHECK(calibration_parse(unknown.data(), unknown.size(), &parsed, &fault) == ERROR_SYNTAX);
        CHECK(std::string(fault.field) == "left_lens");
        value.left.k5 = 1e-3;  // not a coefficient of this model
        CHECK(calibration_validate(&value, &fault) == ERROR_RANGE);
    }
    calibration plain = with_origin(example());
    plain.axes_in_sigma = true;
    std::string text = print(plain);
    text = replace(text, CALIBRATION_GRAMMAR_MAGIC "3", CALIBRATION_GRAMMAR_MAGIC "4");
    text = replace(text, "\ncrc32",
                   "\nleft_lens brown-conrady\nleft_k4 0.000000000000\nleft_k5 "
                   "0.0000000000\nleft_k6 0.00000000\nright_lens brown-conrady\n"
                   "right_k4 0.000000000000\nright_k5 0.0000000000\nright_k6 "
                   "0.00000000\ncrc32");
    text = reframe(text);
    calibration parsed{};
    CHECK(calibration_parse(text.data(), text.size(), &parsed, nullptr) == ERROR_VERSION);
}

TEST_CASE("an origin that cannot be is refused by its field") {
    const auto fault_of = [](const std::function<void(calibration &)> &change) {
        calibration value = with_origin(example());
        change(value);
        calibration_fault fault{};
        CHECK(calibration_validate(&value, &fault) != ERROR_OK);
        return std::string(fault.field);
    };
    CHECK(fault_of([](calibration &c) { c.origin.side[0].axis[CALIBRATION_ZOOM].spread = -1; }) ==
          "left_zoom_counts");
    CHECK(fault_of([](calibration &c) { c.origin.side[1].axis[CALIBRATION_PAN].mean = NAN; }) ==
          "right_pan_deg");
    CHECK(fault_of([](calibration &c) { c.origin.side[0].window.skip = -1; }) == "left_window_px");
    CHECK(fault_of([](calibration &c) { c.origin.instrument[0] = '\n'; }) == "instrument");
    CHECK(fault_of([](calibration &c) { c.yaw_sigma_rad = 2; }) == "yaw_sigma_rad");
    const std::string text = print(with_origin(example()));
    for (const char *wrong : {"left_zoom_counts 421.500\n", "left_zoom_counts 421.500 0.5\n",
                              "left_zoom_counts 421.500 0.500 1.000\n", "left_zoom_counts \n"}) {
        std::string broken = text;
        const size_t at = broken.find("left_zoom_counts");
        broken.replace(at, broken.find('\n', at) + 1 - at, wrong);
        calibration parsed;
        calibration_fault fault{};
        CHECK(calibration_parse(broken.data(), broken.size(), &parsed, &fault) == ERROR_SYNTAX);
        CHECK(std::string(fault.field) == "left_zoom_counts");
    }
}

TEST_CASE("the calibration's share of the depth's deviation grows with the square of the depth") {
    calibration value = with_origin(example());
    value.scale_sigma = 0;
    const double at_1m_mm = calibration_depth_sigma_mm(&value, 1000);
    CHECK(at_1m_mm == doctest::Approx(value.yaw_sigma_rad * 1e6 / calibration_baseline_mm(&value)));
    CHECK(calibration_depth_sigma_mm(&value, 2000) == doctest::Approx(4 * at_1m_mm));
    value.scale_sigma = 0.001;
    value.yaw_sigma_rad = 0;
    CHECK(calibration_depth_sigma_mm(&value, 2000) == doctest::Approx(2));
}
