// SPDX-License-Identifier: Apache-2.0
// Corners of rendered boards against the truth: their errors, and whether the predicted standard
// deviations match.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <thread>

#include "calib/detect/detect.hpp"
#include "synthetic/board_cases.hpp"

using namespace synthetic;

namespace {

constexpr double pi = 3.14159265358979323846;

struct Case {
    std::string name;
    double width_share, blur_px, noise_grey;
    double worst_rms_px;
};

}  // namespace

TEST_CASE("corners of plain boards are accurate, and so is their predicted sigma") {
    const uint64_t seed = test_seed();
    const calib::board board = plain_board(9, 6);
    // Bounds: the figures stated for larger images; squares are smaller here.
    const Case cases[] = {
        {"large, sharp", 0.75, 0.7, 2, 0.03},       {"large, soft", 0.75, 2, 4, 0.03},
        {"large, blurred", 0.75, 5, 4, 0.1},        {"middling", 0.4, 1, 3, 0.03},
        {"small, sharp", 0.2, 0.7, 2, 0.03},        {"squares of 8 pixels", 0.13, 0.7, 2, 0.04},
        {"tiny noise, sharp", 0.5, 0.7, 0.5, 0.02},
    };
    for (const Case &c : cases) {
        CAPTURE(c.name);
        Random random(seed);
        Errors errors;
        for (int i = 0; i < 2; i++) {
            const Camera camera = lens_of(640, 480, random);
            const BoardPose pose =
                hold_board(board, camera, random_hold(c.width_share, 0.4, 0.5, random));
            BoardLight light;
            light.blur_px = c.blur_px;
            light.noise_grey = c.noise_grey;
            light.shade = 0.2;
            light.seed = random.bits();
            BoardImage image = photograph(board, camera, pose, light);
            const calib::board_view view = calib::detect_board(board, image.view(), {});
            CHECK(view.rejection == "");
            CHECK(view.corners.size() == 54);
            errors.add(image, view);
        }
        CAPTURE(errors.rms_px());
        CAPTURE(errors.z_rms());
        CAPTURE(errors.worst_px());
        CHECK(errors.rms_px() <= c.worst_rms_px);
        CHECK(errors.worst_px() <= 6 * c.worst_rms_px);
        CHECK(errors.z_rms() > 0.7);
        CHECK(errors.z_rms() < 1.3);
    }
}

TEST_CASE("a view states the overexposed share of its white squares") {
    Random random(7);
    for (const bool coded : {false, true}) {
        const calib::board board = coded ? coded_board(9, 6, "5x5_100") : plain_board(9, 6);
        const Camera camera = lens_of(640, 480, random);
        const BoardPose pose = hold_board(board, camera, random_hold(0.7, 0.3, 0, random));
        double shares[3];
        for (int i = 0; i < 3; i++) {
            BoardLight light;
            light.light_grey = i == 0 ? 205 : 275;
            light.shade = i == 1 ? 0.25 : 0;  // the right side is darker
            BoardImage image = photograph(board, camera, pose, light);
            const calib::board_view view = calib::detect_board(board, image.view(), {});
            REQUIRE(view.corners.size() == 54);
            shares[i] = view.clipped;
            CHECK(view.overexposed() == (i == 2));
        }
        CAPTURE(shares[1]);
        CHECK(shares[0] == 0);
        CHECK(shares[1] > 0.05);
        CHECK(shares[1] < 0.5);
        CHECK(shares[2] == 1);
    }
}

TEST_CASE("a board with unique colours is numbered from its black corner in any orientation") {
    const uint64_t seed = test_seed();
    Random random(seed);
    for (const auto &size : {std::pair{9, 6}, {6, 9}, {5, 4}, {3, 3}, {5, 5}, {2, 3}}) {
        const int columns = size.first, rows = size.second;
        const calib::board board = plain_board(columns, rows);
        for (double roll = 0; roll < 2 * pi; roll += pi / 2.3) {
            CAPTURE(columns);
            CAPTURE(rows);
            CAPTURE(roll);
            const Camera camera = lens_of(320, 280, random);
            BoardHold hold = random_hold(0.45, 0.2, 0.1, random);
            hold.turn_rad.z = roll;
            BoardLight light;
            light.seed = random.bits();
            BoardImage image = photograph(board, camera, hold_board(board, camera, hold), light);
            const calib::board_view view = calib::detect_board(board, image.view(), {});
            REQUIRE(view.rejection == "");
            Errors straight, half;
            straight.add(image, view);
            calib::board_view other = view;
            for (calib::corner &c : other.corners) {
                c.index = board.corner_count() - 1 - c.index;
            }
            half.add(image, other);
            const double error = board.looks_same_turned()
                                     ? std::min(straight.rms_px(), half.rms_px())
                                     : straight.rms_px();
            CHECK(error < 0.1);
        }
    }
}

TEST_CASE("the same image gives the same bytes, in many threads at once") {
    Random random(3);
    const calib::board board = plain_board(9, 6);
    const Camera camera = lens_of(640, 480, random);
    BoardImage image = photograph(
        board, camera, hold_board(board, camera, random_hold(0.6, 0.3, 0.3, random)), {});
    const calib::board_view first = calib::detect_board(board, image.view(), {});
    std::vector<calib::board_view> views(4);
    std::vector<std::thread> threads;
    for (calib::board_view &view : views) {
        threads.emplace_back([&] { view = calib::detect_board(board, image.view(), {}); });
    }
    for (std::thread &thread : threads) {
        thread.join();
    }
    for (const calib::board_view &view : views) {
        REQUIRE(view.corners.size() == first.corners.size());
        for (size_t i = 0; i < view.corners.size(); i++) {
            CHECK(view.corners[i].index == first.corners[i].index);
            CHECK(view.corners[i].x_px == first.corners[i].x_px);
            CHECK(view.corners[i].y_px == first.corners[i].y_px);
            CHECK(view.corners[i].sigma_px == first.corners[i].sigma_px);
        }
    }
}

namespace {

std::vector<double> blurred_rows(const std::vector<double> &image, int width, double sigma_px) {
    std::vector<double> made(image.size());
    const int reach = static_cast<int>(3 * sigma_px + 1);
    for (int i = 0; i < static_cast<int>(image.size()); i++) {
        const int x = i % width;
        double sum = 0, weight = 0;
        for (int u = std::max(-x, -reach); u <= std::min(width - 1 - x, reach); u++) {
            const double w = std::exp(-u * u / (2 * sigma_px * sigma_px));
            sum += w * image[static_cast<size_t>(i + u)];
            weight += w;
        }
        made[static_cast<size_t>(i)] = sum / weight;
    }
    return made;
}

std::vector<double> turned(const std::vector<double> &image, int width) {
    std::vector<double> made;
    for (int x = 0; x < width; x++) {
        for (size_t at = static_cast<size_t>(x); at < image.size();
             at += static_cast<size_t>(width)) {
            made.push_back(image[at]);
        }
    }
    return made;
}

struct Defects {
    std::string name;
    double noise_grey = 0, sharpening = 0, glare_grey = 0;
    double motion_px = 0;
};

// Motion along the rows, uneven light, and what a cheap camera adds: noise, sharpening with halos.
void spoil(const Defects &defects, Random &random, BoardImage *image) {
    const int width = image->width, height = image->height;
    std::vector<double> greys(image->pixels.begin(), image->pixels.end());
    if (defects.motion_px > 0) {
        greys = blurred_rows(greys, width, defects.motion_px);
    }
    for (int i = 0; i < width * height; i++) {
        const double x = double(i % width) / width - 0.5, y = double(i / width) / height - 0.5;
        double &grey = greys[static_cast<size_t>(i)];
        grey += defects.glare_grey * std::exp(-(x * x + y * y) / (2 * 0.06 * 0.06));
        grey += defects.noise_grey * random.normal();
    }
    if (defects.sharpening > 0) {
        const std::vector<double> once = turned(blurred_rows(greys, width, 2), width);
        const std::vector<double> soft = turned(blurred_rows(once, height, 2), height);
        for (size_t i = 0; i < greys.size(); i++) {
            greys[i] += defects.sharpening * (greys[i] - soft[i]);
        }
    }
    for (size_t i = 0; i < greys.size(); i++) {
        image->pixels[i] = static_cast<uint8_t>(std::lround(std::clamp(greys[i], 0.0, 255.0)));
    }
}

}  // namespace

TEST_CASE("boards are seen in bad light and bad pictures, as bad prints and without a border") {
    Random random(test_seed());
    struct Case {
        Defects defects;
        double dark_grey, light_grey, margin_squares, worst_rms_px;
        double ink_squares = 0;
    };
    const Case cases[] = {
        {{"noise", 25, 0, 0}, 60, 160, 1, 0.25},
        {{"sharpened noise", 8, 2.2, 0}, 65, 180, 1, 0.25},
        {{"halos", 2, 4, 0}, 50, 190, 1, 0.15},
        {{"glare", 2, 0, 150}, 40, 180, 1, 0.2},
        {{"low light", 5, 0, 0}, 12, 32, 1, 0.25},
        {{"no border", 3, 0, 0}, 30, 200, 0, 0.05},
        {{"motion", 2, 0, 0, 5}, 30, 200, 1, 0.2},
        {{"spread ink", 2, 0, 0}, 30, 200, 1, 0.05, 0.1},
        {{"overexposed", 2, 0, 0}, 20, 500, 1, 0.1},
    };
    for (const Case &c : cases) {
        CAPTURE(c.defects.name);
        const calib::board board = plain_board(9, 6);
        const Camera camera = lens_of(640, 480, random);
        BoardLight light;
        light.dark_grey = c.dark_grey;
        light.light_grey = c.light_grey;
        light.background_grey = (c.dark_grey + c.light_grey) / 2;
        light.margin_squares = c.margin_squares;
        light.ink_squares = c.ink_squares;
        light.noise_grey = 0;
        BoardImage image = photograph(
            board, camera, hold_board(board, camera, random_hold(0.5, 0.4, 0.3, random)), light);
        spoil(c.defects, random, &image);
        const calib::board_view view = calib::detect_board(board, image.view(), {});
        CHECK(view.rejection == "");
        REQUIRE(view.corners.size() >= 44);
        Errors errors;
        errors.add(image, view);
        CAPTURE(errors.z_rms());
        CHECK(errors.rms_px() <= c.worst_rms_px);
        for (const auto &size : {std::pair{8, 6}, {9, 5}, {7, 5}, {10, 6}, {9, 7}}) {
            const int columns = size.first, rows = size.second;
            CAPTURE(columns);
            CAPTURE(rows);
            CHECK(
                calib::detect_board(plain_board(columns, rows), image.view(), {}).corners.empty());
        }
    }
}
