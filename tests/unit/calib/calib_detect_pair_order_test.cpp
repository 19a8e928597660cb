// SPDX-License-Identifier: Apache-2.0
// Which views of a pair must be turned: simulated rigs with right views numbered from a random end.
#include <doctest/doctest.h>

#include <cmath>

#include "calib/base/pair_order.hpp"
#include "synthetic/board_cases.hpp"

using namespace synthetic;

namespace {

constexpr double pi = 3.14159265358979323846;

struct Views {
    std::vector<calib::board_view> left, right;
    std::vector<int> turned;  // quarter turns that correct the right view
};

calib::board_view view_of(const calib::board &board, const Camera &camera, const BoardPose &pose,
                          Random &random) {
    calib::board_view view;
    for (int index = 0; index < board.corner_count(); index++) {
        const Vector on_board = {index % board.columns * board.square_mm,
                                 index / board.columns * board.square_mm, 0};
        const auto seen = camera.project(pose.R_camera_board * on_board + pose.t_camera_board_mm);
        REQUIRE(seen.has_value());
        view.corners.push_back(
            {index, seen->x + 0.1 * random.normal(), seen->y + 0.1 * random.normal(), 0.1});
    }
    return view;
}

// `roll_rad`: of the right camera about its axis, relative to the left one.
Views views_of(const calib::board &board, int pairs, double roll_rad, Random &random) {
    Views made;
    Camera left = lens_of(1280, 960, random), right = lens_of(1280, 960, random);
    right.R_camera_world = rotation_from_vector({0, 0, roll_rad});
    right.centre_mm = {120, 5, 10};
    const bool four = board.columns == board.rows;
    for (int i = 0; i < pairs; i++) {
        BoardHold hold = random_hold(0.35, 0.5, pi, random);
        const BoardPose pose = hold_board(board, left, hold);
        made.left.push_back(view_of(board, left, pose, random));
        const int quarters = four ? static_cast<int>(random.uniform(0, 4))
                                  : 2 * static_cast<int>(random.uniform(0, 2));
        made.turned.push_back((4 - quarters) % 4);
        made.right.push_back(
            calib::turned_view(board, view_of(board, right, pose, random), quarters));
    }
    return made;
}

}  // namespace

TEST_CASE("turns of a view add up") {
    Random random(2);
    for (const auto &[columns, rows] : {std::pair{7, 5}, {4, 4}}) {
        const calib::board board = plain_board(columns, rows);
        calib::board_view view;
        for (int i = 0; i < board.corner_count(); i += 2) {
            view.corners.push_back({i, 1.0 * i, 2.0 * i, 0.1});
        }
        const int step = columns == rows ? 1 : 2;
        calib::board_view turned = view;
        for (int quarters = 0; quarters < 4; quarters += step) {
            turned = calib::turned_view(board, turned, step);
        }
        REQUIRE(turned.corners.size() == view.corners.size());
        for (size_t i = 0; i < view.corners.size(); i++) {
            CHECK(turned.corners[i].index == view.corners[i].index);
            CHECK(turned.corners[i].x_px == view.corners[i].x_px);
        }
    }
}

TEST_CASE("right views are turned as the rig's geometry says") {
    Random random(test_seed());
    int undecided = 0, all = 0;
    for (int rig = 0; rig < 60; rig++) {
        const calib::board board = rig % 3 == 0 ? plain_board(4, 4) : plain_board(7, 5);
        // Mounted upright, on its side, upside down.
        const double roll_rad = rig % 4 < 2 ? random.uniform(-0.1, 0.1) : random.uniform(-pi, pi);
        const Views views = views_of(board, 5 + rig % 10, roll_rad, random);
        const auto answer = calib::pair_order(board, views.left, views.right);
        for (size_t i = 0; i < answer.size(); i++) {
            CAPTURE(rig);
            CAPTURE(i);
            all++;
            if (answer[i].decided) {
                CHECK(answer[i].quarters == views.turned[i]);
            } else {
                undecided++;
            }
        }
    }
    MESSAGE(undecided << " of " << all << " pairs undecided");
    CHECK(undecided <= all / 50);
}

TEST_CASE("few pairs, missing views and boards that need no turn") {
    Random random(4);
    const calib::board board = plain_board(7, 5);
    Views views = views_of(board, 2, 0.05, random);
    auto answer = calib::pair_order(board, views.left, views.right);
    for (size_t i = 0; i < answer.size(); i++) {
        CHECK(answer[i].decided);
        CHECK(answer[i].quarters == views.turned[i]);
    }
    // On its side, a single pair is ambiguous.
    views = views_of(board, 1, pi / 2, random);
    CHECK_FALSE(calib::pair_order(board, views.left, views.right)[0].decided);
    views = views_of(board, 6, 0, random);
    views.left[2] = calib::board_view();
    views.right[4] = calib::board_view();
    answer = calib::pair_order(board, views.left, views.right);
    CHECK(answer[2].quarters == 0);
    CHECK(answer[4].quarters == 0);
    CHECK(answer[5].quarters == views.turned[5]);
    CHECK(calib::pair_order(board, {}, {}).empty());
    const calib::board odd = plain_board(9, 6);
    views = views_of(odd, 3, 0, random);
    for (const calib::pair_turn &turn : calib::pair_order(odd, views.left, views.right)) {
        CHECK(turn.quarters == 0);
        CHECK(turn.decided);
    }
}
