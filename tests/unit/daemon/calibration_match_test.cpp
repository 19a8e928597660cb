// SPDX-License-Identifier: Apache-2.0
// Whether a calibration belongs to a pair: each kind of mismatch is rejected by name; and the
// effect of the axes' repeatability on the depth.
#include "console/pair/calibration_match.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <string>

#include "calibration_examples.hpp"
#include "core/error.h"
#include "device/lens_driver.h"
#include "device/mt9t001.h"
#include "rig/pair.h"

namespace {

const uint16_t window_width_px = 640, window_height_px = 480;

struct pair captured() {
    struct pair pair = {};
    pair.number = 1;
    for (int side = 0; side < RIG_SIDES; side++) {
        pair_frame &frame = pair.frame[side];
        frame.image.width_px = window_width_px;
        frame.image.height_px = window_height_px;
        frame.window = {704, 528, 1};
        frame.before.pan_q4 = static_cast<uint16_t>(side == RIG_LEFT ? 24588 : 23461);
        frame.before.lens[LENS_ZOOM].position_q4 = 422 * 16;
        frame.before.lens[LENS_FOCUS].position_q4 = 538 * 16;
        frame.before.lens[LENS_IRIS].position_q4 = 800 * 16;
        frame.after = frame.before;
    }
    return pair;
}

calibration_match_state state_of(const struct pair &pair, const char *profile = "rig") {
    rig_profile rig = {};
    REQUIRE(rig_profile_named("rig", &rig) == ERROR_OK);
    pair_instrument instrument = calibration_match_instrument(&rig);
    std::strcpy(instrument.camera[RIG_LEFT], "Cam at usb-1");
    std::strcpy(instrument.camera[RIG_RIGHT], "Cam at usb-2");
    calibration_match_state state = {};
    calibration_match_pair(profile, &instrument, &pair, &state);
    return state;
}

/// A calibration as `vergence calibrate` makes it from such pairs.
calibration made() {
    calibration value = calibration_examples::example();
    value.has_origin = true;
    value.origin = state_of(captured()).origin;
    value.left.width_px = value.right.width_px = window_width_px;
    value.left.height_px = value.right.height_px = window_height_px;
    REQUIRE(calibration_round(&value) == ERROR_OK);
    return value;
}

std::string rejection_of(const calibration &value, const calibration_match_state &state,
                         int expected = ERROR_MISMATCH) {
    message why{};
    CHECK(calibration_match(&value, &state, "--accept-mismatch", &why) == expected);
    return why.text;
}

void check_names(const std::string &text, std::initializer_list<const char *> words) {
    for (const char *word : words) {
        CAPTURE(text);
        CHECK(text.find(word) != std::string::npos);
    }
}

/// The message for a pair that differs from the calibration's by `change`.
std::string changed(const std::function<void(struct pair &)> &change) {
    struct pair pair = captured();
    change(pair);
    return rejection_of(made(), state_of(pair));
}

}  // namespace

TEST_CASE("a pair with the calibrated axes matches") {
    const calibration value = made();
    CHECK(value.origin.side[0].axis[CALIBRATION_PAN].mean == doctest::Approx(3.57).epsilon(0.01));
    CHECK(rejection_of(value, state_of(captured()), ERROR_OK).empty());
    struct pair pair = captured();
    for (pair_frame &frame : pair.frame) {  // a shift within the repeatability
        frame.before.lens[LENS_ZOOM].position_q4 += 4 * 16;
        frame.after.lens[LENS_ZOOM].position_q4 += 4 * 16;
    }
    CHECK(rejection_of(value, state_of(pair), ERROR_OK).empty());
}

TEST_CASE("a moved axis is rejected by name, with both values and a remedy") {
    const uint16_t degree_q4 = 165;  // 10.3 us a degree
    check_names(changed([&](struct pair &pair) {
                    pair.frame[RIG_LEFT].before.pan_q4 += degree_q4;
                    pair.frame[RIG_LEFT].after.pan_q4 += degree_q4;
                }),
                {"left pan", "4.5", "3.5", "deg", "side=left", "--accept-mismatch"});
    const char *const names[] = {"zoom", "focus", "iris"};
    for (int axis = 0; axis < LENS_AXES; axis++) {
        const std::string text = changed([&](struct pair &pair) {
            pair.frame[RIG_RIGHT].before.lens[axis].position_q4 -= 5 * 16;
            pair.frame[RIG_RIGHT].after.lens[axis].position_q4 -= 5 * 16;
        });
        check_names(text, {("right " + std::string(names[axis])).c_str(), "counts"});
    }
}

TEST_CASE("other cameras, another instrument and another window are rejected by name") {
    calibration_match_state state = state_of(captured());
    std::swap(state.origin.side[0].camera, state.origin.side[1].camera);
    check_names(rejection_of(made(), state), {"swapped", "Cam at usb-2", "left camera"});
    state = state_of(captured());
    std::strcpy(state.origin.side[1].camera, "Cam at usb-7");
    check_names(rejection_of(made(), state), {"right camera", "Cam at usb-7", "Cam at usb-2"});
    check_names(rejection_of(made(), state_of(captured(), "bench")),
                {"instrument", "bench", "rig"});
    check_names(changed([](struct pair &pair) { pair.frame[RIG_LEFT].window.skip = 2; }),
                {"left window", "skip 2", "skip 1"});
    check_names(changed([](struct pair &pair) { pair.frame[RIG_RIGHT].window.row_px = 8; }),
                {"right window", "704,8"});
    check_names(changed([](struct pair &pair) { pair.frame[RIG_RIGHT].image.width_px = 320; }),
                {"right window", "320 x 480"});
}

TEST_CASE("images of another size are rejected, whether the calibration states axes or not") {
    calibration value = made();
    value.has_origin = false;
    CHECK(rejection_of(value, state_of(captured()), ERROR_OK).empty());
    struct pair pair = captured();
    pair.frame[RIG_RIGHT].image.width_px = 320;
    check_names(rejection_of(value, state_of(pair), ERROR_SIZE_MISMATCH),
                {"right images", "320x480", "640x480", "window"});
    value.right.width_px = MT9T001_WIDTH_PX;
    value.right.height_px = MT9T001_HEIGHT_PX;
    CHECK(rejection_of(value, state_of(pair), ERROR_OK).empty());  // cut to the known window
    pair.frame[RIG_RIGHT].window.skip = 0;                         // a webcam has no known window
    check_names(rejection_of(value, state_of(pair), ERROR_SIZE_MISMATCH), {"320x480", "2048x1536"});
}

TEST_CASE("an accepted mismatch is reported without advice") {
    struct pair pair = captured();
    pair.frame[RIG_LEFT].before.pan_q4 += 165;
    pair.frame[RIG_LEFT].after.pan_q4 += 165;
    const calibration value = made();
    const calibration_match_state state = state_of(pair);
    message why{};
    CHECK(calibration_match(&value, &state, nullptr, &why) == ERROR_MISMATCH);
    CHECK(std::string(why.text).find("left pan") != std::string::npos);
    CHECK(std::string(why.text).find("continue") == std::string::npos);
}

TEST_CASE("a calibration of the whole sensor fits every window of it") {
    calibration value = made();
    for (int side = 0; side < RIG_SIDES; side++) {
        lens &camera = side == RIG_LEFT ? value.left : value.right;
        camera.width_px = MT9T001_WIDTH_PX;
        camera.height_px = MT9T001_HEIGHT_PX;
        value.origin.side[side].window = {0, 0, 1};
    }
    CHECK(rejection_of(value, state_of(captured()), ERROR_OK).empty());
}

TEST_CASE("values that one side does not know are not compared, which is reported") {
    const calibration old = calibration_examples::example();
    const calibration_match_state state = state_of(captured());
    CHECK(rejection_of(old, state, ERROR_OK).empty());
    CHECK(calibration_match_is_partial(&old, &state.origin));
    const calibration value = made();
    CHECK_FALSE(calibration_match_is_partial(&value, &state.origin));
    const calibration_origin nothing = {};
    CHECK(calibration_match_is_partial(&value, &nothing));
    // A rig without axes needs no values.
    CHECK_FALSE(calibration_match_is_partial(&old, &nothing));
    struct pair pair = captured();
    pair.frame[RIG_LEFT].before.pan_q4 = 0;  // not set yet
    const calibration_match_state unsent = state_of(pair);
    CHECK(unsent.origin.side[0].axis[CALIBRATION_PAN].kind == CALIBRATION_AXIS_UNKNOWN);
    CHECK(calibration_match_is_partial(&value, &unsent.origin));
    check_names(rejection_of(value, unsent), {"left pan", "not set", "pan 3.568 side=left"});
    calibration_match_state elsewhere = unsent;  // state of an instrument with unknown servos
    elsewhere.instrument.servo_q4_per_rad[0] = 0;
    CHECK(rejection_of(value, elsewhere, ERROR_OK).empty());
}

TEST_CASE("a session without an instrument uses its built-in profile") {
    const struct pair pair = captured();
    calibration_match_state state = {};
    calibration_match_pair("rig", nullptr, &pair, &state);
    CHECK(state.origin.side[0].axis[CALIBRATION_PAN].mean == doctest::Approx(3.57).epsilon(0.01));
    calibration_match_pair("of my own", nullptr, &pair, &state);
    CHECK(state.origin.side[0].axis[CALIBRATION_PAN].kind == CALIBRATION_AXIS_UNKNOWN);
}

TEST_CASE("the common deviation includes pan, zoom and the calibration's own") {
    calibration value = made();
    value.yaw_sigma_rad = value.scale_sigma = 0;
    value.translation_right_left_mm[0] = -250;
    value.translation_right_left_mm[1] = value.translation_right_left_mm[2] = 0;
    const pair_instrument instrument = state_of(captured()).instrument;
    const double pan_mm = 1800.0 * 1800 / 250 * 5236e-6 * std::sqrt(2.0);
    const double zoom_mm = 1800 * 4 * 4187e-6 / std::sqrt(2.0);
    const double both_mm = std::hypot(pan_mm, zoom_mm);
    CHECK(both_mm > 95);  // 0.3 degrees of two servos at 1.8 m
    CHECK(calibration_match_sigma_mm(&value, &instrument, nullptr, 1800) ==
          doctest::Approx(both_mm));
    CHECK(calibration_match_sigma_mm(&value, nullptr, nullptr, 1800) == doctest::Approx(both_mm));
    calibration included = value;  // a state of a calibration of all zooms
    included.axes_in_sigma = true;
    CHECK(calibration_match_sigma_mm(&included, &instrument, nullptr, 1800) ==
          doctest::Approx(calibration_depth_sigma_mm(&value, 1800)));
    calibration_origin moved = value.origin;  // a degree at 1.8 m and 250 mm
    moved.side[0].axis[CALIBRATION_PAN].mean += 1;
    CHECK(calibration_match_sigma_mm(&value, &instrument, &value.origin, 1800) ==
          doctest::Approx(both_mm));
    CHECK(calibration_match_sigma_mm(&value, &instrument, &moved, 1800) ==
          doctest::Approx(std::hypot(both_mm, 1800.0 * 1800 / 250 * 0.0174533)));
    value.scale_sigma = 0.01;
    CHECK(calibration_match_sigma_mm(&value, &instrument, nullptr, 1800) ==
          doctest::Approx(std::hypot(both_mm, 18.0)));
    // A servo that was not set during calibration had an unknown position.
    calibration unset = value;
    for (calibration_side_origin &side : unset.origin.side) {
        side.axis[CALIBRATION_PAN] = {CALIBRATION_AXIS_UNKNOWN, 0, 0};
    }
    CHECK(calibration_match_sigma_mm(&unset, &instrument, nullptr, 1800) ==
          doctest::Approx(std::hypot(both_mm, 18.0)));
    // Without motors only the calibration's own remains; the old text states none.
    for (calibration_side_origin &side : value.origin.side) {
        for (calibration_axis &axis : side.axis) {
            axis = {CALIBRATION_AXIS_NONE, 0, 0};
        }
    }
    CHECK(calibration_match_sigma_mm(&value, &instrument, nullptr, 1800) == doctest::Approx(18));
    value.has_origin = false;
    CHECK(calibration_match_sigma_mm(&value, &instrument, nullptr, 1800) < 0);
}
