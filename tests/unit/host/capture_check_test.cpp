// SPDX-License-Identifier: Apache-2.0
// What a calibration capture checks of its pairs: the board's white, what moved between zooms,
// time.
#include "tools/host/capture/capture_check.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

namespace {

const calib::board board = {10, 7, 24, "4x4_50", 17};
const int square_px = 40, x0_px = 100, y0_px = 80, width_px = 640, height_px = 480;

/// A picture of the board, upright, and its corners.
struct picture {
    std::vector<uint8_t> grey = std::vector<uint8_t>(size_t(width_px) * height_px, 200);
    calib::board_view view;

    picture(int white, int black) {
        for (int i = 0; i < board.corner_count(); i++) {
            view.corners.push_back({i, double(x0_px + i % board.columns * square_px),
                                    double(y0_px + i / board.columns * square_px), 0.02});
        }
        for (int y = y0_px; y < y0_px + (board.rows - 1) * square_px; y++) {
            for (int x = x0_px; x < x0_px + (board.columns - 1) * square_px; x++) {
                const bool is_white = ((x - x0_px) / square_px + (y - y0_px) / square_px) % 2 == 1;
                grey[size_t(y * width_px + x)] = uint8_t(is_white ? white : black);
            }
        }
    }

    calibrate_image image(int full_scale) const {
        calibrate_image image;
        image.grey = grey;
        image.width_px = width_px;
        image.height_px = height_px;
        image.full_scale = full_scale;
        return image;
    }
};

/// A pair whose corners lie at `scale` px a mm about a middle.
capture_shot shot_of(double scale, double x_px, double y_px) {
    capture_shot shot;
    for (calib::board_view &view : shot.view) {
        for (int i = 0; i < board.corner_count(); i++) {
            view.corners.push_back(
                {i, x_px + scale * 24 * (i % 10 - 4.5), y_px + scale * 24 * (i / 10 - 3.0), 0.02});
        }
    }
    return shot;
}

}  // namespace

TEST_CASE("the board's white is that of its bright squares, whatever is around it") {
    for (const int white : {40, 120, 230}) {
        picture seen(white, 20);
        CHECK(capture_whites(board, seen.image(255), seen.view) == doctest::Approx(white / 255.0));
        // A picture of ten bits, of which the highest was not used: 127 is full scale.
        CHECK(capture_whites(board, seen.image(127), seen.view) == doctest::Approx(white / 127.0));
    }
    picture seen(100, 20);
    seen.view.corners.resize(5);
    CHECK(capture_whites(board, seen.image(255), seen.view) == 0);
}

TEST_CASE("the region for the exposure holds the board of both pictures") {
    const capture_optics optics;
    capture_shot shot = shot_of(1, 600, 500);
    shot.view[1] = shot_of(1, 700, 520).view[1];
    const capture_region region = capture_region_of(optics, shot, {});
    CHECK(region.x_px == 492);
    CHECK(region.y_px == 428);
    CHECK(region.x_px + region.width_px == doctest::Approx(808).epsilon(0.005));
    CHECK(region.y_px + region.height_px == doctest::Approx(592).epsilon(0.005));
    // Frames of parts of the sensors.
    const capture_region there = capture_region_of(optics, shot, {{{200, 100}, {40, 60}}});
    CHECK(there.x_px == 632);
    CHECK(there.y_px == 508);
    // Never empty, and within the frame.
    const capture_region small = capture_region_of(optics, shot_of(0.01, 2047, 1535), {});
    CHECK(small.x_px + small.width_px <= optics.width_px);
    CHECK(small.y_px + small.height_px <= optics.height_px);
    CHECK(small.width_px >= 64);
}

TEST_CASE("the corner to focus by is the one nearest to the middle, where it will be") {
    const capture_optics optics;
    const capture_point at = capture_middle_corner(optics, shot_of(5, 1000, 700).view[0], 1.2);
    CHECK(at.x_px == doctest::Approx(1024 + 1.2 * (1000 + 60 - 1024)));
    CHECK(at.y_px == doctest::Approx(768 + 1.2 * (700 - 768 + 120)));
}

TEST_CASE("from one zoom to the next the picture grows as the zoom does, and does not move") {
    const capture_optics optics;
    const capture_shot before = shot_of(1, 1000, 700);
    const auto said = [&](const capture_shot &after, double ratio) {
        return capture_check_zoomed(optics, before, after, ratio);
    };
    CHECK(said(shot_of(1.2, 995, 686), 1.2).empty());
    // A reading that does not change while the lens does; one that is constant; one that falls.
    CHECK(said(shot_of(1.2, 995, 686), 1.0).find("grew 1.20 times") != std::string::npos);
    CHECK(said(shot_of(1.0, 1000, 700), 1.2).find("constant or reversed") != std::string::npos);
    CHECK(said(shot_of(0.8, 1005, 714), 1.2).find("Left lens: ") == 0);
    // A turned camera, a moved board, and one that is gone.
    CHECK(said(shot_of(1.2, 1200, 686), 1.2).find("moved during the position") !=
          std::string::npos);
    CHECK(said(shot_of(1.2, 995, 500), 1.2).find("the same command") != std::string::npos);
    CHECK(said(capture_shot(), 1.2).find("moved") != std::string::npos);
}

TEST_CASE("a capture's time is that of its positions, without the person's and through restarts") {
    std::vector<capture_shot> shots(4);
    const uint64_t begin_us[] = {10000000, 15000000, 100000000, 3000000};
    for (size_t i = 0; i < 4; i++) {
        shots[i].position = i < 2 ? 1 : 2;
        shots[i].begin_us = begin_us[i];
        shots[i].end_us = begin_us[i] + 1000000;
    }
    CHECK(capture_minutes(shots) == doctest::Approx((6 + 1) / 60.0));
}

TEST_CASE("lenses at different zooms show the board in different sizes") {
    capture_look look[2];
    look[0].distance_mm = 1000;
    look[1].distance_mm = 1150;  // nearer to the left camera
    CHECK(capture_check_sides(look).empty());
    look[1].distance_mm = 1600;
    CHECK(capture_check_sides(look).find("left picture shows the board 1.60 times") !=
          std::string::npos);
    look[1].distance_mm = 500;
    CHECK(capture_check_sides(look).find("0.50 times") != std::string::npos);
}
