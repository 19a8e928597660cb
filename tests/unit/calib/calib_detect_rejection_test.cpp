// SPDX-License-Identifier: Apache-2.0
// Images without a usable board: each is rejected for the right reason, in bounded time.
#include <doctest/doctest.h>

#include <chrono>
#include <cmath>

#include "calib/detect/detect.hpp"
#include "calib/detect/detect_extent.hpp"
#include "synthetic/board_cases.hpp"

using namespace synthetic;

namespace {

struct Image {
    int width, height;
    std::vector<uint8_t> pixels;

    Image(int w, int h, uint8_t grey = 128)
        : width(w), height(h), pixels(static_cast<size_t>(w) * static_cast<size_t>(h), grey) {}
    image_u8 view() { return {pixels.data(), width, height, width}; }
    template <class Grey>
    void paint(Grey grey) {
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                const double value = grey(x, y);
                pixels[static_cast<size_t>(y) * static_cast<size_t>(width) +
                       static_cast<size_t>(x)] =
                    static_cast<uint8_t>(std::clamp(value, 0.0, 255.0));
            }
        }
    }
};

std::string rejection_of(const calib::board &board, const image_u8 &image) {
    const calib::board_view view = calib::detect_board(board, image, {});
    CHECK(view.corners.empty());
    return view.rejection;
}

BoardImage board_image(const calib::board &board, double width_share, double shift_x,
                       BoardLight light = {}) {
    Random random(5);
    const Camera camera = lens_of(640, 480, random);
    BoardHold hold;
    hold.width_share = width_share;
    hold.turn_rad = {0.2, 0.1, 0.15};
    hold.shift_x = shift_x;
    return photograph(board, camera, hold_board(board, camera, hold), light);
}

}  // namespace

TEST_CASE("each rejection names its reason") {
    const calib::board board = plain_board(9, 6);
    BoardImage smaller = board_image(plain_board(8, 6), 0.7, 0);
    CHECK(rejection_of(board, smaller.view()) == "found 8 x 6 corners, not 9 x 6");
    BoardImage larger = board_image(plain_board(10, 7), 0.7, 0);
    CHECK(rejection_of(board, larger.view()) == "found 10 x 7 corners, not 9 x 6");
    BoardImage upright = board_image(plain_board(5, 8), 0.3, 0);
    CHECK(rejection_of(board, upright.view()) == "found 8 x 5 corners, not 9 x 6");

    BoardImage cut = board_image(board, 0.7, 0.35);
    const std::string cut_off = rejection_of(board, cut.view());
    CAPTURE(cut_off);
    CHECK(cut_off.find("cut off") != std::string::npos);
    CHECK(cut_off.find("of 54 corners") != std::string::npos);

    BoardImage hidden = board_image(board, 0.7, 0);
    for (int y = 200; y < 330; y++) {
        for (int x = 200; x < 330; x++) {
            hidden.pixels[static_cast<size_t>(y * hidden.width + x)] = 110;
        }
    }
    const std::string partly = rejection_of(board, hidden.view());
    CAPTURE(partly);
    CHECK(partly.find("only ") == 0);
    CHECK(partly.find("of 54 corners visible") != std::string::npos);

    BoardLight light;
    light.blur_px = 22;
    BoardImage blurred = board_image(board, 0.7, 0, light);
    const std::string soft = rejection_of(board, blurred.view());
    CAPTURE(soft);
    CHECK(soft.find("blurred") != std::string::npos);

    light = BoardLight();
    light.dark_grey = 250;
    light.light_grey = light.background_grey = 300;
    BoardImage bright = board_image(board, 0.7, 0, light);
    const std::string over = rejection_of(board, bright.view());
    CAPTURE(over);
    CHECK(over.find("overexposed") != std::string::npos);

    light.dark_grey = 5;
    light.light_grey = light.background_grey = 6;
    BoardImage night = board_image(board, 0.7, 0, light);
    CHECK(rejection_of(board, night.view()).find("too dark") != std::string::npos);
    Image empty(640, 480);
    CHECK(rejection_of(board, empty.view()) == "no board found");
}

TEST_CASE("a part of a board is known as one where noise hid corners of its outer line") {
    BoardImage image = board_image(plain_board(9, 6), 0.7, 0);
    calib::detect::grid part;
    part.columns = 8;
    part.rows = 6;
    part.nodes.resize(48);
    calib::detect::refined_grid corners;
    for (int index = 0; index < 54; index++) {
        const Pixel &at = image.corners[static_cast<size_t>(index)];
        const int column = index % 9, row = index / 9;
        const bool hidden = column == 7 && (row == 1 || row == 3 || row == 4);
        if (column < part.columns) {
            corners.corners.push_back({!hidden, at.x, at.y, 0.1});
        }
    }
    const std::vector<calib::detect::plane> levels = calib::detect::pyramid_of(image.view());
    CHECK(calib::detect::squares_continue(levels[0], part, corners));
}

TEST_CASE("squares go on in a shadow; a pattern of other greys is none of the board's") {
    const auto goes_on = [](double dark_beyond, double light_beyond) {
        Image image(480, 300);
        image.paint([&](int x, int y) {
            const bool light = (x / 40 + y / 40) % 2 != 0;
            return x < 360 ? (light ? 200.0 : 30.0) : (light ? light_beyond : dark_beyond);
        });
        calib::detect::grid part;
        part.columns = 8;
        part.rows = 6;
        part.nodes.resize(48);
        calib::detect::refined_grid corners;
        for (int index = 0; index < 48; index++) {
            corners.corners.push_back(
                {true, 39.5 + 40 * (index % 8), 39.5 + 40 * (index / 8), 0.1});
        }
        const std::vector<calib::detect::plane> levels = calib::detect::pyramid_of(image.view());
        return calib::detect::squares_continue(levels[0], part, corners);
    };
    CHECK(goes_on(30, 200));
    CHECK(goes_on(9, 60));
    CHECK(goes_on(6, 40));
    CHECK_FALSE(goes_on(100, 160));
    CHECK_FALSE(goes_on(110, 110));
}

TEST_CASE("two boards in view are rejected") {
    const calib::board board = plain_board(6, 5);
    BoardImage one = board_image(board, 0.35, -0.25), two = board_image(board, 0.35, 0.25);
    for (int y = 0; y < one.height; y++) {
        for (int x = one.width / 2; x < one.width; x++) {
            const size_t at = static_cast<size_t>(y * one.width + x);
            one.pixels[at] = two.pixels[at];
        }
    }
    CHECK(rejection_of(board, one.view()) == "two boards of this size are in view");
}

TEST_CASE("odd images and odd boards do no harm") {
    Random random(test_seed());
    for (int i = 0; i < 60; i++) {
        const int width = 1 + static_cast<int>(std::exp(random.uniform(0, 6)));
        const int height = 1 + static_cast<int>(std::exp(random.uniform(0, 6)));
        Image image(width, height);
        const int period = 2 + static_cast<int>(random.uniform(0, 30));
        const double noise = random.uniform(0, 60);
        image.paint([&](int x, int y) {
            return ((x / period + y / period) % 2 == 0 ? 60 : 190) + noise * random.normal();
        });
        calib::board board = plain_board(2 + i % 5, 2 + i % 3);
        if (i % 2 == 1) {
            board = coded_board(board.columns, board.rows, "4x4_50");
        }
        const calib::board_view view = calib::detect_board(board, image.view(), {});
        CHECK(view.corners.empty() != view.rejection.empty());
        for (const calib::corner &c : view.corners) {
            CHECK(c.index >= 0);
            CHECK(c.index < board.corner_count());
            CHECK(c.sigma_px > 0);
        }
    }
    for (const auto &[width, height] :
         {std::pair{1, 1}, {4000, 1}, {1, 4000}, {4000, 17}, {16, 16}, {33, 2000}}) {
        Image image(width, height);
        CHECK(rejection_of(plain_board(9, 6), image.view()) != "");
    }
    Image nothing(0, 0);
    CHECK(rejection_of(plain_board(255, 255), nothing.view()) != "");
}
