// SPDX-License-Identifier: Apache-2.0
// The axes of the pairs in a calibration: their mean and spread, and the rejection of inconsistent
// pairs.
#include <doctest/doctest.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "calib/solve/solve.hpp"
#include "tools/host/calibrate/calibrate_result.hpp"

namespace {

calibration_match_state state_at(double pan_deg, double zoom_counts) {
    calibration_match_state state = {};
    state.instrument.pan_repeatability_urad = 5236;
    state.instrument.lens_repeatability_counts = 4;
    std::strcpy(state.origin.instrument, "rig");
    for (calibration_side_origin &side : state.origin.side) {
        side.window = {688, 568, 1};
        side.axis[CALIBRATION_PAN] = {CALIBRATION_AXIS_KNOWN, pan_deg, 0};
        side.axis[CALIBRATION_ZOOM] = {CALIBRATION_AXIS_KNOWN, zoom_counts, 0.5};
        side.axis[CALIBRATION_FOCUS] = {CALIBRATION_AXIS_NONE, 0, 0};
    }
    return state;
}

struct pairs {
    std::vector<calibrate_shot> shots;
    calib::solution solution;

    void add(const calibration_match_state &state, bool used = true) {
        calibrate_shot shot;
        shot.path = {"left" + std::to_string(shots.size()), "right"};
        shot.state = std::make_shared<calibration_match_state>(state);
        shots.push_back(shot);
        calib::view_summary view;
        view.used = used;
        solution.views.push_back({view, view});
    }

    /// "" when they are consistent.
    std::string rejection(calibration_origin *origin) const {
        std::string error;
        const bool good = calibrate_origin_of(shots, solution, origin, &error);
        CHECK(good == error.empty());
        return error;
    }
};

}  // namespace

TEST_CASE("axes have the mean and the largest deviation of the pairs that count") {
    pairs taken;
    taken.add(state_at(3.57, 421));
    taken.add(state_at(3.57, 422));
    taken.add(state_at(3.57, 424));
    taken.add(state_at(9, 700), false);  // a rejected one, which was not used in the solution
    calibration_origin origin;
    CHECK(taken.rejection(&origin).empty());
    CHECK(std::string(origin.instrument) == "rig");
    CHECK(origin.side[0].window.row_px == 568);
    CHECK(origin.side[1].axis[CALIBRATION_PAN].mean == doctest::Approx(3.57));
    CHECK(origin.side[0].axis[CALIBRATION_ZOOM].mean == doctest::Approx(1267 / 3.0));
    CHECK(origin.side[0].axis[CALIBRATION_ZOOM].spread == doctest::Approx(424 - 1267 / 3.0));
    CHECK(origin.side[0].axis[CALIBRATION_FOCUS].kind == CALIBRATION_AXIS_NONE);
    CHECK(origin.side[0].axis[CALIBRATION_IRIS].kind == CALIBRATION_AXIS_UNKNOWN);
}

TEST_CASE("an axis that moved between the pairs is rejected by name, and so are other cameras") {
    const auto rejection = [](const calibration_match_state &other) {
        pairs taken;
        taken.add(state_at(3.57, 421));
        taken.add(other);
        calibration_origin origin;
        return taken.rejection(&origin);
    };
    CHECK(rejection(state_at(3.8, 425)).empty());
    CHECK(rejection(state_at(4.5, 421)).find("left pan") == 0);
    CHECK(rejection(state_at(3.57, 426)).find("left zoom") == 0);
    calibration_match_state other = state_at(3.57, 421);
    std::strcpy(other.origin.instrument, "bench");
    CHECK(rejection(other).find("instrument") != std::string::npos);
    other = state_at(3.57, 421);
    other.origin.side[1].window.skip = 2;
    CHECK(rejection(other).find("right window") != std::string::npos);
    other = state_at(3.57, 421);
    std::strcpy(other.origin.side[0].camera, "B");
    CHECK(rejection(other).find("left camera") != std::string::npos);
}

TEST_CASE("a servo that was not set is noted") {
    pairs taken;
    calibration_match_state state = state_at(0, 421);
    state.origin.side[1].axis[CALIBRATION_PAN] = {CALIBRATION_AXIS_UNKNOWN, 0, 0};
    taken.add(state);
    calibration_origin origin;
    CHECK(taken.rejection(&origin).empty());
    CHECK(calibrate_origin_notes(taken.shots, origin).empty());  // it has no servo
    state.instrument.servo_q4_per_rad[1] = 9442;
    taken.shots[0].state = std::make_shared<calibration_match_state>(state);
    const std::vector<std::string> notes = calibrate_origin_notes(taken.shots, origin);
    REQUIRE(notes.size() == 1);
    CHECK(notes[0].find("right pan") == 0);
}

TEST_CASE("pictures without a session make all of it unknown") {
    pairs taken;
    taken.add(state_at(3.57, 421));
    taken.add(state_at(3.57, 421));
    taken.shots[1].state = nullptr;
    calibration_origin origin;
    CHECK(taken.rejection(&origin).empty());
    CHECK(origin.instrument[0] == '\0');
    CHECK(origin.side[0].axis[CALIBRATION_PAN].kind == CALIBRATION_AXIS_UNKNOWN);
}
