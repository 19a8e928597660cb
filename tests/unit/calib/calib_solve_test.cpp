// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "calib/solve/solve.hpp"
#include "stereo/geometry/geometry.h"
#include "synthetic/rig_views.hpp"
#include "synthetic/seed.hpp"

namespace {

synthetic::RigViewsPlan plain() {
    synthetic::RigViewsPlan plan;
    plan.width = 1280;
    plan.height = 960;
    plan.focal_px = 2000;
    plan.boards = 10;
    plan.columns = 9;
    plan.rows = 6;
    plan.depth_range = 0.2;
    return plan;
}

calib::solution solve(const calib::observations &seen, int threads = 2) {
    calib::solve_options options;
    options.threads = threads;
    return calib::solve(seen, options);
}

// Padding between the text fields of a calibration is ignored.
bool same_rig(const calibration &a, const calibration &b) {
    return std::memcmp(&a.left, &b.left, sizeof a.left) == 0 &&
           std::memcmp(&a.right, &b.right, sizeof a.right) == 0 &&
           std::memcmp(a.rotation_right_left_rad, b.rotation_right_left_rad,
                       sizeof a.rotation_right_left_rad) == 0 &&
           std::memcmp(a.translation_right_left_mm, b.translation_right_left_mm,
                       sizeof a.translation_right_left_mm) == 0 &&
           a.rms_px == b.rms_px;
}

bool same_bytes(const calib::solution &a, const calib::solution &b) {
    return same_rig(a.rig, b.rig) && std::memcmp(a.warp_mm, b.warp_mm, sizeof a.warp_mm) == 0 &&
           std::memcmp(&a.sigma, &b.sigma, sizeof a.sigma) == 0 && a.rms_px == b.rms_px &&
           a.held_out_rms_px == b.held_out_rms_px && a.verdict.sentence == b.verdict.sentence;
}

bool mentions(const calib::solution &found, const char *words) {
    return std::any_of(
        found.verdict.reasons.begin(), found.verdict.reasons.end(),
        [&](const std::string &reason) { return reason.find(words) != std::string::npos; });
}

// A bent board in a rig that has no noise at all.
synthetic::RigViewsPlan exact() {
    synthetic::RigViewsPlan plan = plain();
    plan.noise_px = 0;
    plan.warp_mm[0] = 0.8;
    plan.warp_mm[1] = -0.5;
    plan.aspect = 1.01;
    return plan;
}

}  // namespace

TEST_CASE("without noise the result is the truth: lenses, rig, warp, boards") {
    const auto views = synthetic::make_rig_views(exact(), 1, 2);
    const calib::solution found = solve(views.seen);
    INFO(found.verdict.sentence);
    REQUIRE(found.solved);
    const calibration truth = views.truth();
    CHECK(found.rms_px < 1e-6);
    for (const auto &[ours, true_lens] :
         {std::pair{found.rig.left, truth.left}, std::pair{found.rig.right, truth.right}}) {
        CHECK(ours.fx_px == doctest::Approx(true_lens.fx_px).epsilon(1e-7));
        CHECK(ours.fy_px == doctest::Approx(true_lens.fy_px).epsilon(1e-7));
        CHECK(std::fabs(ours.cx_px - true_lens.cx_px) < 1e-3);
        CHECK(std::fabs(ours.cy_px - true_lens.cy_px) < 1e-3);
        CHECK(ours.k1 == doctest::Approx(true_lens.k1).epsilon(1e-4));
        CHECK(ours.p1 == doctest::Approx(true_lens.p1).epsilon(1e-3));
    }
    for (int i = 0; i < 3; i++) {
        CHECK(std::fabs(found.rig.rotation_right_left_rad[i] - truth.rotation_right_left_rad[i]) <
              1e-6);
        CHECK(std::fabs(found.rig.translation_right_left_mm[i] -
                        truth.translation_right_left_mm[i]) < 1e-3);
    }
    CHECK(found.target.bent);
    CHECK_FALSE(found.model.square_pixels);
    CHECK(found.warp_mm[0] == doctest::Approx(0.8).epsilon(1e-4));
    CHECK(found.warp_mm[1] == doctest::Approx(-0.5).epsilon(1e-4));
    for (size_t i = 0; i < found.T_left_board.size(); i++) {
        REQUIRE(found.board_known[i]);
        const double *t = found.T_left_board[i].t_mm;
        const synthetic::Vector &there = views.t_left_board_mm[i];
        CHECK(std::hypot(t[0] - there.x, t[1] - there.y, t[2] - there.z) < 2e-3);
        for (size_t k = 0; k < 9; k++) {
            CHECK(std::fabs(found.T_left_board[i].R[k] - views.R_left_board[i][k]) < 1e-6);
        }
    }
    CHECK(found.verdict.good);
}

TEST_CASE("the same bytes on any number of threads and in any order") {
    const auto views = synthetic::make_rig_views(plain(), 3, 4);
    const calib::solution one = solve(views.seen, 1);
    REQUIRE(one.solved);
    CHECK(one.verdict.good);
    CHECK(same_bytes(one, solve(views.seen, 1)));
    CHECK(same_bytes(one, solve(views.seen, 4)));
    calib::observations shuffled = views.seen;
    std::reverse(shuffled.captures.begin(), shuffled.captures.end());
    std::swap(shuffled.captures[1], shuffled.captures[6]);
    const calib::solution other = solve(shuffled, 3);
    CHECK(same_bytes(one, other));
    // Results by board position follow the caller's order.
    CHECK(other.views[9][0].rms_px == one.views[0][0].rms_px);
    CHECK(other.T_left_board[9].t_mm[2] == one.T_left_board[0].t_mm[2]);
    CHECK(other.views[1][1].rms_px == one.views[3][1].rms_px);
    for (auto &capture : shuffled.captures) {
        capture.name = {"", ""};
    }
    CHECK(same_bytes(one, solve(shuffled)));
}

TEST_CASE("focal lengths of 26,560 px are found as well as they can be") {
    synthetic::RigViewsPlan plan;
    double squares = 0, predicted = 0, worst = 0;
    const int draws = synthetic::rounds(synthetic::draws(6), 1);
    for (uint64_t seed = 1; seed <= uint64_t(draws); seed++) {
        INFO("seed ", seed);
        const uint64_t base = synthetic::test_seed() + seed;
        const auto views = synthetic::make_rig_views(plan, base, base + 1000);
        const calib::solution found = solve(views.seen);
        const calibration truth = views.truth();
        REQUIRE(found.solved);
        INFO(found.verdict.sentence);
        CHECK(found.verdict.good);
        CHECK(found.second_start.agrees);
        CHECK(found.rejected_corners.empty());
        CHECK(found.rejected_views.empty());
        for (size_t camera = 0; camera < 2; camera++) {
            const double true_px = camera == 0 ? truth.left.fx_px : truth.right.fx_px;
            const double error = found.camera[camera].fx_px / true_px - 1;
            const double sigma = found.sigma.focal_px[camera] / true_px;
            squares += error * error;
            predicted += sigma * sigma;
            worst = std::max(worst, std::fabs(error) / sigma);
        }
    }
    const double count = 2 * draws;
    MESSAGE(draws, " seeds: rms of f ", 100 * std::sqrt(squares / count), " %, predicted ",
            100 * std::sqrt(predicted / count), " %, worst ", worst, " sigma");
    // The bounds allow for chance: an rms of n values is known to 1 / sqrt(2 n), and among some
    // hundred values one beyond 4 sigma is rare, not impossible.
    CHECK(std::sqrt(squares) < (1.1 + 2 / std::sqrt(2 * count)) * std::sqrt(predicted));
    CHECK(worst < 4.5);
}

TEST_CASE("one camera alone") {
    synthetic::RigViewsPlan plan = plain();
    plan.cameras = 1;
    const auto views = synthetic::make_rig_views(plan, 5, 6);
    const calib::solution found = solve(views.seen);
    REQUIRE(found.solved);
    CHECK(found.verdict.good);
    CHECK(std::fabs(found.camera[0].fx_px - views.truth().left.fx_px) <
          4 * found.sigma.focal_px[0]);
    CHECK(found.pairs_used == 0);
}

TEST_CASE("boards that one camera alone saw help that camera") {
    auto views = synthetic::make_rig_views(plain(), 7, 8);
    for (const size_t i : {size_t(1), size_t(4)}) {
        views.seen.captures[i].view[0].corners.clear();
    }
    for (const size_t i : {size_t(2), size_t(8)}) {
        views.seen.captures[i].view[1].corners.clear();
    }
    const calib::solution found = solve(views.seen);
    REQUIRE(found.solved);
    INFO(found.verdict.sentence);
    CHECK(found.verdict.good);
    CHECK(found.pairs_used == 6);
    CHECK(found.captures_used == 10);
    CHECK(found.rejected_views.empty());
    const calibration truth = views.truth();
    CHECK(std::fabs(calibration_baseline_mm(&found.rig) - calibration_baseline_mm(&truth)) <
          4 * found.sigma.baseline_mm);
}

TEST_CASE("parts of boards are enough") {
    synthetic::RigViewsPlan plan = plain();
    plan.all_in_view = false;
    plan.fill = 1.1;
    const auto views = synthetic::make_rig_views(plan, 9, 10);
    size_t corners = 0;
    for (const auto &capture : views.seen.captures) {
        corners += capture.view[0].corners.size();
    }
    CHECK(corners < 0.9 * 540);
    const calib::solution found = solve(views.seen);
    REQUIRE(found.solved);
    CHECK(found.verdict.good);
    CHECK(std::fabs(found.camera[0].fx_px - views.truth().left.fx_px) <
          4 * found.sigma.focal_px[0]);
}

TEST_CASE("unusable observations are rejected with a reason") {
    auto views = synthetic::make_rig_views(plain(), 11, 12);
    calib::observations seen = views.seen;
    SUBCASE("no observations") {
        seen.captures.clear();
        const calib::solution found = solve(seen);
        CHECK_FALSE(found.solved);
        CHECK(mentions(found, "too few boards"));
    }
    SUBCASE("two pairs") {
        seen.captures.resize(2);
        CHECK_FALSE(solve(seen).solved);
    }
    SUBCASE("never both cameras") {
        for (size_t i = 0; i < seen.captures.size(); i++) {
            seen.captures[i].view[i % 2].corners.clear();
        }
        const calib::solution found = solve(seen);
        CHECK_FALSE(found.solved);
        CHECK(mentions(found, "seen by both cameras"));
    }
    SUBCASE("numbers beyond the board") {
        seen.captures[3].view[1].corners.back().index = 54;
        const calib::solution found = solve(seen);
        CHECK_FALSE(found.solved);
        CHECK(mentions(found, "right003"));
    }
    SUBCASE("not a number") {
        seen.captures[3].view[1].corners[0].x_px = std::nan("");
        CHECK_FALSE(solve(seen).solved);
    }
    SUBCASE("no size") {
        seen.width_px[1] = 0;
        CHECK_FALSE(solve(seen).solved);
    }
    SUBCASE("no board") {
        seen.target.square_mm = 0;
        CHECK_FALSE(solve(seen).solved);
    }
}

TEST_CASE("three images of each camera give a result that is marked as not good") {
    synthetic::RigViewsPlan plan = plain();
    plan.boards = 3;
    const calib::solution found = solve(synthetic::make_rig_views(plan, 13, 14).seen);
    REQUIRE(found.solved);
    CHECK_FALSE(found.verdict.good);
    CHECK(mentions(found, "only 3 boards"));
}

TEST_CASE("an unobservable focal length is reported") {
    synthetic::RigViewsPlan plan = plain();
    plan.depth_range = 0.1;
    SUBCASE("boards parallel to the image") {
        plan.tilt_min_rad = 0;
        plan.tilt_max_rad = 0.02;
    }
    SUBCASE("one image, ten times") {
        plan.boards = 1;
    }
    auto views = synthetic::make_rig_views(plan, 15, 16);
    while (views.seen.captures.size() < 10) {
        views.seen.captures.push_back(views.seen.captures[0]);
    }
    const calib::solution found = solve(views.seen);
    INFO(found.verdict.sentence);
    CHECK_FALSE(found.verdict.good);
    REQUIRE(!found.verdict.reasons.empty());
    CHECK(found.verdict.sentence.find("parallel to each other") != std::string::npos);
}
