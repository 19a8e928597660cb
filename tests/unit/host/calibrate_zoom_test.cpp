// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate/calibrate_zoom.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

#include "synthetic/zoom_views.hpp"
#include "tools/host/calibration_report/zoom_report.hpp"

namespace {

const double rad_per_degree = 3.14159265358979323846 / 180;

calibration_axis known(double value) {
    return {CALIBRATION_AXIS_KNOWN, value, 0};
}

// A recording of synthetic views: every capture is a shot.
struct recording {
    std::vector<calibrate_shot> shots;
    calibrate_views views;
    calibrate_zoom_job job;

    explicit recording(const calib::zoom_observations &seen) {
        views.seen.target = seen.boards[0];
        for (const calib::capture &one : seen.captures) {
            const auto state = std::make_shared<calibration_match_state>();
            std::strcpy(state->origin.instrument, "synthetic");
            state->instrument.pan_repeatability_urad = 5236;
            for (size_t side = 0; side < 2; side++) {
                calibration_side_origin &origin = state->origin.side[side];
                origin.window = {0, 0, 1};
                origin.axis[CALIBRATION_PAN] = known(one.axes[side].pan_rad / rad_per_degree);
                origin.axis[CALIBRATION_ZOOM] = known(one.axes[side].zoom_counts);
                origin.axis[CALIBRATION_FOCUS] = known(one.axes[side].focus_counts);
                state->width_px[side] = seen.width_px[side];
                state->height_px[side] = seen.height_px[side];
            }
            calibrate_shot shot;
            shot.path = one.name;
            shot.state = state;
            shot.session = 1;
            shot.board_position = uint32_t(one.position) + 1;
            shot.pan_visit = 1;
            shots.push_back(shot);
            views.seen.captures.push_back({one.name, one.view});
        }
        job.shots = &shots;
        job.views = &views;
        job.progress = [](int, int) {};
    }
};

synthetic::ZoomViews sweep() {
    synthetic::ZoomPlan plan;
    plan.zooms = 6;
    plan.boards = 6;
    plan.same_boards = true;
    plan.log_spaced = true;
    return synthetic::make_zoom_views(plan, 11, 12);
}

}  // namespace

TEST_CASE("a recording at many zooms becomes the calibration of the whole rig") {
    recording made(sweep().seen);
    REQUIRE(calibrate_zoom_is_wanted(made.shots));
    std::string error;
    const bool solved = calibrate_zoom_solve(&made.job, &error);
    INFO(error);
    REQUIRE(solved);
    const std::string text = calibrate_zoom_file(made.job);
    const auto rig = std::make_unique<zoom_calibration>();
    REQUIRE(zoom_calibration_parse(text.data(), text.size(), nullptr, rig.get(), nullptr) == 0);
    CHECK(std::string(rig->instrument) == "synthetic");
    CHECK(rig->camera[0].zoom.max > 840);
    CHECK(std::exp(rig->camera[0].log_focal.max) > 25000);
    CHECK(calibrate_zoom_text(made.job).find("zooms       6") != std::string::npos);
    CHECK(calibrate_zoom_json(made.job).find("\"zooms\": 6") != std::string::npos);
    const std::string page = zoom_report({&made.job.seen, &made.job.solution, "Good."});
    for (const char *part : {"Focal length against zoom position", "Difference from the curve",
                             "Entrance pupil", "one sigma", "What 0.1 degrees of one pan cost"}) {
        CHECK(page.find(part) != std::string::npos);
    }
    CHECK(page.find("nan") == std::string::npos);
    CHECK(page.find("inf ") == std::string::npos);
}

TEST_CASE("pairs of one zoom, or without positions, are not calibrated as functions of zoom") {
    recording made(sweep().seen);
    std::vector<calibrate_shot> shots = {made.shots[0], made.shots[0]};
    CHECK(!calibrate_zoom_is_wanted(shots));
    shots = made.shots;
    shots[1].state = nullptr;
    CHECK(!calibrate_zoom_is_wanted(shots));
}

TEST_CASE("pairs of another instrument, or that skip pixels, are refused in one sentence") {
    for (const bool skips : {false, true}) {
        recording made(sweep().seen);
        const auto state = std::make_shared<calibration_match_state>(*made.shots[3].state);
        std::strcpy(state->origin.instrument, skips ? "synthetic" : "other");
        state->origin.side[1].window.skip = skips ? 2 : 1;
        made.shots[3].state = state;
        std::string error;
        CHECK(!calibrate_zoom_solve(&made.job, &error));
        CHECK(error.find(made.shots[3].path[1 - !skips]) != std::string::npos);
        CHECK(error.find(skips ? "skips pixels" : "another instrument") != std::string::npos);
    }
}
