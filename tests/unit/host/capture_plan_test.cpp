// SPDX-License-Identifier: Apache-2.0
// The plan of a calibration capture: zooms, what a view says about the board, where it should be
// next.
#include "tools/host/capture/capture_plan.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "core/math.h"

namespace {

const calib::board board = {10, 7, 24, "4x4_50", 17};

/// The board as a pinhole camera sees it, tilted about y, `z_mm` away.
calib::board_view view_of(double focal_px, double z_mm, double tilt_deg, double x_px) {
    calib::board_view view;
    const double tilt = tilt_deg * 3.14159265358979 / 180;
    for (int i = 0; i < board.corner_count(); i++) {
        const double u = (i % board.columns - 4.5) * board.square_mm;
        const double v = (i / board.columns - 3.0) * board.square_mm;
        const double z = z_mm + u * std::sin(tilt);
        view.corners.push_back(
            {i, x_px + focal_px * u * std::cos(tilt) / z, 768 + focal_px * v / z, 0.02});
    }
    return view;
}

capture_shot shot_at(int zoom, const calib::board_view &view) {
    capture_shot shot;
    shot.axes[0].zoom_counts = zoom + 0.4;
    shot.axes[1].zoom_counts = zoom - 0.3;
    shot.view = {view, view};
    return shot;
}

}  // namespace

TEST_CASE("zooms are equally spaced in the logarithm of the focal length") {
    const capture_optics optics;
    const std::vector<int> zooms = capture_zooms(optics, 300, 840, 13);
    REQUIRE(zooms.size() == 13);
    CHECK(zooms.front() == 300);
    CHECK(zooms.back() == 840);
    const double ratio = std::pow(optics.focal_mm(840) / optics.focal_mm(300), 1.0 / 12);
    for (size_t i = 1; i < zooms.size(); i++) {
        CHECK(optics.focal_mm(zooms[i]) / optics.focal_mm(zooms[i - 1]) ==
              doctest::Approx(ratio).epsilon(0.01));
        CHECK(capture_zoom_index(zooms, zooms[i] + 1.2) == static_cast<int>(i));
    }
}

TEST_CASE("a view says how far away the board is, and how much it is tilted") {
    for (const double tilt_deg : {0.0, 10.0, 25.0}) {
        capture_look look;
        REQUIRE(capture_look_at(board, view_of(2656, 1800, tilt_deg, 1000), 2656, &look));
        CHECK(look.distance_mm == doctest::Approx(1800).epsilon(0.01));
        CHECK(look.tilt_deg == doctest::Approx(tilt_deg).epsilon(0.1).scale(10));
        CHECK(look.x_px == doctest::Approx(1000).epsilon(0.01));
    }
    calib::board_view line = view_of(2656, 1800, 0, 1000);
    line.corners.resize(8);
    capture_look look;
    CHECK(!capture_look_at(board, line, 2656, &look));
}

TEST_CASE("corners leave the frame as the focal length grows") {
    const capture_optics optics;
    const calib::board_view view = view_of(2656, 1800, 0, 1024);
    CHECK(capture_corners_after_zoom(optics, view, 1) == 70);
    const int tele = capture_corners_after_zoom(optics, view, 9.8);
    CHECK(tele >= CAPTURE_CORNERS_MIN);
    CHECK(tele < 40);
    CHECK(capture_corners_after_zoom(optics, view, 100) < CAPTURE_CORNERS_MIN);
}

namespace {

/// What both cameras see of a board at a place at all zooms, without its tilt, as shots of a
/// position.
void see_all(const capture_optics &optics, const std::vector<int> &zooms,
             const capture_place &place, uint32_t position, std::vector<capture_shot> *shots) {
    for (const int zoom : zooms) {
        const double focal_px = optics.focal_px(zoom);
        calib::board_view view = view_of(
            focal_px, place.z_mm, 0, 1024 + (place.aim ? 0 : focal_px * place.x_mm / place.z_mm));
        const auto outside = [&](const calib::corner &c) {
            return std::fabs(c.x_px - 1024) > 1016 || std::fabs(c.y_px - 768) > 760;
        };
        view.corners.erase(std::remove_if(view.corners.begin(), view.corners.end(), outside),
                           view.corners.end());
        if (view.corners.size() >= CAPTURE_CORNERS_MIN) {
            shots->push_back(shot_at(zoom, view));
            shots->back().position = int(position);
            shots->back().axes[0].pan_rad = 4 * MATH_RAD_PER_DEGREE;
            shots->back().axes[1].pan_rad = -4 * MATH_RAD_PER_DEGREE;
        }
    }
}

}  // namespace

TEST_CASE("twelve places see all zooms, far and near, turned in many ways, and are known again") {
    const capture_optics optics;
    const std::vector<int> zooms = capture_zooms(optics, 300, 840, 13);
    std::vector<capture_shot> shots;
    std::vector<capture_place> places;
    for (uint32_t position = 1; position <= 12; position++) {
        capture_coverage covered = capture_coverage_of(optics, zooms, shots);
        covered.tried = places;
        places.push_back(capture_next_place(optics, zooms, board, covered, {4, -4}, 800, 2400));
        see_all(optics, zooms, places.back(), position, &shots);
    }
    int aimed = 0, far = 0, near = 0, steep = 0;
    for (const capture_place &place : places) {
        aimed += place.aim;
        far += place.aim && place.z_mm > 1500;
        near += place.z_mm < 1000;
        steep += std::hypot(place.turn_deg[0], place.turn_deg[1]) > 30;
    }
    CHECK(aimed >= 5);
    CHECK(far >= 2);
    CHECK(near >= 2);
    CHECK(steep >= 3);
    for (const auto &zoom : capture_coverage_of(optics, zooms, shots).zoom) {
        CHECK(zoom[0].boards >= 3);
    }
    // A capture that is resumed plans as if it had not ended.
    const std::vector<capture_place> again =
        capture_places_before(optics, zooms, board, shots, 800, 2400);
    REQUIRE(again.size() == places.size());
    for (size_t i = 0; i < places.size(); i++) {
        CHECK(capture_place_text(again[i]) == capture_place_text(places[i]));
    }
}

TEST_CASE("the next place is where most is missing") {
    const capture_optics optics;
    const std::vector<int> zooms = capture_zooms(optics, 300, 840, 13);
    const std::array<double, 2> pan_deg = {4, -4};
    capture_coverage covered = capture_coverage_of(optics, zooms, {});
    const capture_place first =
        capture_next_place(optics, zooms, board, covered, pan_deg, 800, 2400);
    CHECK(first.aim);  // all zooms at once
    CHECK(first.z_mm >= 1000);
    // With boards all over the frame at all zooms but the widest, the corners of that one are
    // missing.
    std::vector<capture_shot> shots;
    for (size_t i = 0; i < zooms.size(); i++) {
        const double focal_px = optics.focal_px(zooms[i]);
        const calib::board_view view = view_of(focal_px, i == 0 ? 1800 : focal_px / 12, 0, 1024);
        shots.insert(shots.end(), 6, shot_at(zooms[i], view));
    }
    covered = capture_coverage_of(optics, zooms, shots);
    CHECK(covered.zoom[0][1].boards == 6);
    const capture_place later =
        capture_next_place(optics, zooms, board, covered, pan_deg, 800, 2400);
    INFO(capture_place_text(later));
    CHECK(!later.aim);
    CHECK(std::fabs(later.x_mm) + std::fabs(later.y_mm) > 100);
    CHECK(capture_drawing(optics, zooms, board, covered, &later, pan_deg).find("Next: ") !=
          std::string::npos);
    CHECK(capture_drawing(optics, zooms, board, covered, nullptr, pan_deg).find("Next: ") ==
          std::string::npos);
}
