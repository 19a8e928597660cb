// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "calib/solve/robust.hpp"
#include "calib/solve/solve.hpp"
#include "synthetic/rig_views.hpp"
#include "synthetic/seed.hpp"

namespace {

using calib::capture;
using calib::corner;
using Named = std::set<std::array<size_t, 3>>;  // position, camera, index

const size_t WHOLE_VIEW = 9999;

synthetic::RigViewsPlan twenty_boards() {
    synthetic::RigViewsPlan plan;
    plan.focal_px = 3000;
    plan.width = 1280;
    plan.height = 960;
    plan.boards = 20;
    plan.columns = 9;
    plan.rows = 6;
    plan.depth_range = 0.2;
    return plan;
}

calib::solution solve(const calib::observations &seen) {
    calib::solve_options options;
    options.threads = 2;
    options.second_start = false;
    options.choose_model = false;
    options.model = {calib::lens_model::K1_K2_P1_P2, true};
    return calib::solve(seen, options);
}

Named named(const calib::solution &found) {
    Named result;
    for (const auto &one : found.rejected_corners) {
        result.insert({one.capture, size_t(one.camera), size_t(one.index)});
    }
    for (const auto &one : found.rejected_views) {
        result.insert({one.capture, size_t(one.camera), WHOLE_VIEW});
    }
    return result;
}

std::string reasons(const calib::solution &found) {
    std::string text;
    for (const auto &one : found.rejected_corners) {
        text += std::to_string(one.capture) + "/" + std::to_string(one.camera) + " corner " +
                std::to_string(one.index) + " " + one.reason + "\n";
    }
    for (const auto &one : found.rejected_views) {
        text += std::to_string(one.capture) + "/" + std::to_string(one.camera) + " " + one.reason +
                "\n";
    }
    return text;
}

double focal_error(const synthetic::RigViews &views, const calib::solution &found) {
    const calibration truth = views.truth();
    return std::hypot(found.camera[0].fx_px / truth.left.fx_px - 1,
                      found.camera[1].fx_px / truth.right.fx_px - 1);
}

double baseline_error(const synthetic::RigViews &views, const calib::solution &found) {
    const calibration truth = views.truth();
    return std::fabs(calibration_baseline_mm(&found.rig) - calibration_baseline_mm(&truth));
}

void half_turn(calib::board_view *view, int count) {
    for (corner &one : view->corners) {
        one.index = count - 1 - one.index;
    }
    std::reverse(view->corners.begin(), view->corners.end());
}

// Corners of one row carry their right neighbours' numbers; the last one gets the first's place.
void shift_row(calib::board_view *view, const calib::board &target, int row) {
    const auto first = view->corners.begin() + row * target.columns;
    const double x = first->x_px, y = first->y_px;
    for (int column = 0; column + 1 < target.columns; column++) {
        first[column].x_px = first[column + 1].x_px;
        first[column].y_px = first[column + 1].y_px;
    }
    first[target.columns - 1].x_px = x;
    first[target.columns - 1].y_px = y;
}

// The numbers of a whole view are one row too low; the last row is new.
void shift_board(calib::board_view *view, const calib::board &target) {
    std::vector<corner> moved;
    for (const corner &one : view->corners) {
        if (one.index >= target.columns) {
            moved.push_back({one.index - target.columns, one.x_px, one.y_px, one.sigma_px});
        }
    }
    view->corners = moved;
}

}  // namespace

TEST_CASE("no good corner is rejected") {
    for (uint64_t seed = 1; seed <= uint64_t(synthetic::rounds(8, 1)); seed++) {
        INFO("seed ", seed);
        const auto views = synthetic::make_rig_views(twenty_boards(), seed, seed + 100);
        const calib::solution found = solve(views.seen);
        INFO(reasons(found));
        CHECK(named(found).empty());
        CHECK(found.captures_used == 20);
    }
}

TEST_CASE("single wrong corners are named, all of them and no others") {
    double clean_focal = 0, clean_baseline = 0, focal = 0, baseline = 0;
    for (uint64_t seed = 1; seed <= uint64_t(synthetic::rounds(6, 2)); seed++) {
        INFO("seed ", seed);
        auto views = synthetic::make_rig_views(twenty_boards(), seed, seed + 100);
        const calib::solution clean = solve(views.seen);
        synthetic::Random random(seed + synthetic::test_seed());
        Named wrong;
        for (size_t i = 0; i < views.seen.captures.size(); i++) {
            for (size_t camera = 0; camera < 2; camera++) {
                for (corner &one : views.seen.captures[i].view[camera].corners) {
                    if (random.uniform(0, 1) < 0.05) {
                        const double off_px = random.uniform(3, 30);
                        const double towards = random.uniform(-3.1416, 3.1416);
                        one.x_px += off_px * std::cos(towards);
                        one.y_px += off_px * std::sin(towards);
                        wrong.insert({i, camera, size_t(one.index)});
                    }
                }
            }
        }
        const calib::solution found = solve(views.seen);
        INFO(reasons(found));
        CHECK(named(found) == wrong);
        clean_focal += std::pow(focal_error(views, clean), 2);
        clean_baseline += std::pow(baseline_error(views, clean), 2);
        focal += std::pow(focal_error(views, found), 2);
        baseline += std::pow(baseline_error(views, found), 2);
    }
    CHECK(std::sqrt(focal) < 1.5 * std::sqrt(clean_focal));
    CHECK(std::sqrt(baseline) < 1.5 * std::sqrt(clean_baseline));
}

TEST_CASE("swapped numbers and a shifted row are named") {
    auto views = synthetic::make_rig_views(twenty_boards(), 3, 4);
    auto &captures = views.seen.captures;
    std::swap(captures[2].view[0].corners[10].x_px, captures[2].view[0].corners[31].x_px);
    std::swap(captures[2].view[0].corners[10].y_px, captures[2].view[0].corners[31].y_px);
    shift_row(&captures[5].view[1], views.seen.target, 2);
    const calib::solution found = solve(views.seen);
    INFO(reasons(found));
    Named wrong = {{2, 0, 10}, {2, 0, 31}};
    for (size_t column = 0; column < 9; column++) {
        wrong.insert({5, 1, 18 + column});
    }
    CHECK(named(found) == wrong);
    CHECK(found.rejected_corners[0].reason.find("corner 31,") != std::string::npos);
    CHECK(found.rejected_corners[2].reason.find("corner 19,") != std::string::npos);
}

TEST_CASE("a pair numbered from opposite ends is named, and corrected where the board allows it") {
    for (const int rows : {6, 7}) {
        synthetic::RigViewsPlan plan = twenty_boards();
        plan.rows = rows;
        auto views = synthetic::make_rig_views(plan, 5, 6);
        const int count = views.seen.target.corner_count();
        half_turn(&views.seen.captures[4].view[1], count);
        // With both ends turned there is no error: the board is then turned around.
        half_turn(&views.seen.captures[8].view[0], count);
        half_turn(&views.seen.captures[8].view[1], count);
        const calib::solution found = solve(views.seen);
        INFO(reasons(found));
        const bool same_turned = views.seen.target.looks_same_turned();
        CHECK(same_turned == (rows == 7));
        REQUIRE(!found.rejected_views.empty());
        for (const auto &one : found.rejected_views) {
            CHECK(one.capture == 4);
            CHECK(one.repaired == same_turned);
            CHECK(one.reason.find("opposite ends") != std::string::npos);
        }
        CHECK(found.pairs_used == (same_turned ? 20 : 19));
        CHECK(found.rejected_corners.empty());
    }
}

TEST_CASE("wrong partners, shifted boards, nonsense and mirrored order are named") {
    auto views = synthetic::make_rig_views(twenty_boards(), 7, 8);
    auto &captures = views.seen.captures;
    const calib::solution clean = solve(views.seen);
    SUBCASE("images of two pairs swapped") {
        std::swap(captures[1].view[1], captures[9].view[1]);
        const calib::solution found = solve(views.seen);
        INFO(reasons(found));
        CHECK(
            named(found) ==
            Named{{1, 0, WHOLE_VIEW}, {1, 1, WHOLE_VIEW}, {9, 0, WHOLE_VIEW}, {9, 1, WHOLE_VIEW}});
        CHECK(found.rejected_views[0].reason.find("wrongly paired") != std::string::npos);
        CHECK(focal_error(views, found) < 1.5 * focal_error(views, clean) + 1e-4);
    }
    SUBCASE("one view's numbers a row too low") {
        shift_board(&captures[11].view[1], views.seen.target);
        const calib::solution found = solve(views.seen);
        INFO(reasons(found));
        CHECK(named(found) == Named{{11, 0, WHOLE_VIEW}, {11, 1, WHOLE_VIEW}});
        CHECK(found.rejected_views[0].reason == "the right view's numbers are one row too low");
    }
    SUBCASE("a view of random numbers") {
        synthetic::Random random(5);
        auto &corners = captures[3].view[0].corners;
        for (size_t i = corners.size() - 1; i > 0; i--) {
            const size_t other = size_t(random.uniform(0, double(i + 1)));
            std::swap(corners[i].x_px, corners[other].x_px);
            std::swap(corners[i].y_px, corners[other].y_px);
        }
        const calib::solution found = solve(views.seen);
        INFO(reasons(found));
        CHECK(named(found) == Named{{3, 0, WHOLE_VIEW}});
        CHECK(found.rejected_views[0].reason.find("do not fit a flat board") != std::string::npos);
        CHECK(found.views[3][1].used);
    }
    SUBCASE("a mirrored view") {
        for (corner &one : captures[6].view[1].corners) {
            one.x_px = views.seen.width_px[1] - 1 - one.x_px;
        }
        const calib::solution found = solve(views.seen);
        INFO(reasons(found));
        CHECK(named(found) == Named{{6, 1, WHOLE_VIEW}});
        CHECK(found.rejected_views[0].reason.find("mirrored") != std::string::npos);
    }
    SUBCASE("the board moved by a millimetre between the two images") {
        for (corner &one : captures[6].view[1].corners) {
            one.x_px += 1.7;
            one.y_px -= 1.1;
        }
        const calib::solution found = solve(views.seen);
        INFO(reasons(found));
        CHECK(named(found) == Named{{6, 0, WHOLE_VIEW}, {6, 1, WHOLE_VIEW}});
    }
    SUBCASE("five corners, or one row") {
        captures[0].view[0].corners.resize(5);
        captures[1].view[1].corners.resize(9);
        const calib::solution found = solve(views.seen);
        INFO(reasons(found));
        CHECK(named(found) == Named{{0, 0, WHOLE_VIEW}, {1, 1, WHOLE_VIEW}});
        CHECK(found.rejected_views[0].reason.find("only 5 corners") == 0);
        CHECK(found.rejected_views[1].reason.find("one line") != std::string::npos);
    }
}
