// SPDX-License-Identifier: Apache-2.0
// Coded boards: any part of them, in any orientation, in any number of pieces.
#include <doctest/doctest.h>

#include <cmath>

#include "calib/base/coded_layout.hpp"
#include "calib/base/marker.hpp"
#include "calib/detect/detect.hpp"
#include "synthetic/board_cases.hpp"

using namespace synthetic;

namespace {

BoardImage photograph_of(const calib::board &board, const BoardHold &hold, Random &random) {
    const Camera camera = lens_of(800, 600, random);
    BoardLight light;
    light.seed = random.bits();
    return photograph(board, camera, hold_board(board, camera, hold), light);
}

void mirror(BoardImage *image) {
    for (int y = 0; y < image->height; y++) {
        const auto row = image->pixels.begin() + y * image->width;
        std::reverse(row, row + image->width);
    }
}

}  // namespace

TEST_CASE("markers: numbers, positions, rotations") {
    for (const auto &[columns, rows] : {std::pair{9, 6}, {8, 6}, {8, 5}, {9, 5}, {2, 2}}) {
        const calib::board board = coded_board(columns, rows, "4x4_50");
        int next = 0;
        for (int row = 0; row <= rows; row++) {
            for (int column = 0; column <= columns; column++) {
                if (!calib::board_square_white(column, row)) {
                    continue;
                }
                CHECK(calib::board_marker_id(board, column, row) == next);
                const calib::square_place place = calib::board_marker_square(board, next);
                CHECK(place.column == column);
                CHECK(place.row == row);
                next++;
            }
        }
        CHECK(calib::board_marker_count(board) == next);
    }
    const calib::marker_code code = calib::marker_dictionary_named("6x6_250")->codes[7];
    calib::marker_code turned = code;
    for (int turn = 0; turn < 4; turn++) {
        turned = calib::marker_turned(turned, 6);
    }
    CHECK(turned == code);
    CHECK(calib::marker_mirrored(calib::marker_mirrored(code, 6), 6) == code);
    CHECK(calib::marker_dictionary_named("9x9_9") == nullptr);
}

TEST_CASE("a coded board is read whole, in parts and upside down") {
    Random random(test_seed());
    struct Case {
        std::string dictionary;
        int columns, rows;
        double width_share, shift_x, roll_rad;
        size_t at_least;
    };
    const Case cases[] = {
        {"4x4_50", 9, 6, 0.75, 0, 0.1, 54},          {"6x6_250", 8, 6, 0.7, 0, 3.0, 48},
        {"5x5_100", 7, 5, 0.9, 0.4, -1.5, 8},        {"apriltag_36h11", 9, 6, 0.8, 0.4, 0.3, 15},
        {"4x4_50", 9, 6, 1.5, 0, 0.8, 12},           {"7x7_1000", 6, 6, 0.8, -0.3, 2.2, 8},
        {"aruco_original", 9, 6, 0.9, 0.3, 0.2, 12}, {"4x4_250", 13, 9, 0.7, 0, 0, 117},
    };
    for (const Case &c : cases) {
        CAPTURE(c.dictionary);
        CAPTURE(c.roll_rad);
        const calib::board board = coded_board(c.columns, c.rows, c.dictionary);
        BoardHold hold = random_hold(c.width_share, 0.25, 0, random);
        hold.turn_rad.z = c.roll_rad;
        hold.shift_x = c.shift_x;
        BoardImage image = photograph_of(board, hold, random);
        const calib::board_view view = calib::detect_board(board, image.view(), {});
        CHECK(view.rejection == "");
        CHECK(view.corners.size() >= c.at_least);
        Errors errors;
        errors.add(image, view);
        CHECK(errors.rms_px() < 0.03);
        CHECK(errors.worst_px() < 0.2);
    }
}

TEST_CASE("a coded board behind a bar is one board") {
    Random random(11);
    const calib::board board = coded_board(11, 7, "4x4_50");
    BoardImage image = photograph_of(board, random_hold(0.85, 0.2, 0.2, random), random);
    for (int y = 0; y < image.height; y++) {
        for (int x = 330; x < 420; x++) {
            image.pixels[static_cast<size_t>(y * image.width + x)] = 120;
        }
    }
    const calib::board_view view = calib::detect_board(board, image.view(), {});
    Errors errors;
    errors.add(image, view);
    CHECK(view.corners.size() >= 50);
    CHECK(errors.rms_px() < 0.03);
    CHECK(errors.worst_px() < 0.3);
}

TEST_CASE("a coded board that is mirrored, of other markers or of another size is rejected") {
    Random random(12);
    const calib::board board = coded_board(9, 6, "4x4_50");
    BoardImage image = photograph_of(board, random_hold(0.7, 0.2, 0.2, random), random);
    const auto rejection = [&](const calib::board &wanted) {
        const calib::board_view view = calib::detect_board(wanted, image.view(), {});
        CHECK(view.corners.empty());
        return view.rejection;
    };
    CHECK(rejection(coded_board(9, 6, "6x6_250")).find("dictionary 6x6_250") != std::string::npos);
    CHECK(rejection(coded_board(8, 6, "4x4_50")) != "");
    mirror(&image);
    CHECK(rejection(board) == "the board is mirrored: its markers read backwards");
}

TEST_CASE("the layout of OpenCV before 4.6 is recognized, whole and in part") {
    Random random(test_seed());
    for (const auto &size : {std::pair{7, 5}, {9, 7}}) {
        const int columns = size.first, rows = size.second;
        for (const bool white_first : {false, true}) {
            for (const double shift : {0.0, 0.35}) {
                CAPTURE(columns);
                CAPTURE(white_first);
                CAPTURE(shift);
                const calib::board board = coded_board(columns, rows, "4x4_50");
                BoardHold hold = random_hold(0.75, 0.25, 0.3, random);
                hold.shift_x = shift;
                const Camera camera = lens_of(800, 600, random);
                BoardLight light;
                light.white_first = white_first;
                BoardImage image =
                    photograph(board, camera, hold_board(board, camera, hold), light);
                const calib::board_view view = calib::detect_board(board, image.view(), {});
                CHECK(view.rejection == "");
                CHECK(view.corners.size() >= (shift > 0 ? 8U : size_t(columns) * size_t(rows)));
                CHECK(view.white_first == white_first);
                Errors errors;
                errors.add(image, view);
                CHECK(errors.worst_px() < 0.2);
            }
        }
    }
}

// With an odd number of squares in a row the layouts differ by one column only.
TEST_CASE("all views together decide the layout that a part of the board cannot show") {
    const uint64_t seed = test_seed();
    Random random(seed);
    for (const bool white_first : {false, true}) {
        CAPTURE(white_first);
        const calib::board board =
            white_first ? coded_board(8, 5, "4x4_50") : coded_board(6, 7, "4x4_50");
        std::vector<BoardImage> images;
        std::vector<calib::board_view> views;
        // The whole board, its middle, and its two ends.
        for (const auto &[share, shift] :
             {std::pair{0.75, 0.0}, {1.6, 0.0}, {0.8, -0.35}, {0.8, 0.35}}) {
            const Camera camera = lens_of(480, 360, random);
            BoardHold hold;
            hold.width_share = share;
            hold.shift_x = shift;
            BoardLight light;
            light.white_first = white_first;
            light.seed = random.bits();
            images.push_back(photograph(board, camera, hold_board(board, camera, hold), light));
            views.push_back(calib::detect_board(board, images.back().view(), {}));
            CHECK(views.back().rejection == "");
        }
        CHECK(views[0].corners.size() == size_t(board.corner_count()));
        CHECK(views[0].white_first == white_first);
        CHECK_FALSE(views[0].layout_open);
        CHECK(views[1].layout_open);
        calib::board_view middle = views[1];
        calib::settle_layouts(board, {&middle});
        CHECK(middle.layout_open);
        CHECK_FALSE(middle.white_first);
        calib::settle_layouts(board, {&views[0], &views[1], &views[2], &views[3]});
        for (size_t i = 0; i < views.size(); i++) {
            CAPTURE(i);
            CHECK(views[i].white_first == white_first);
            Errors errors;
            errors.add(images[i], views[i]);
            CHECK(errors.worst_px() < 0.3);
        }
    }
}
