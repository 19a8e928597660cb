// SPDX-License-Identifier: Apache-2.0
// Errors common to a whole view, with good residuals: the error bars and, above a limit, the
// verdict must show them.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "calib/solve/solve.hpp"
#include "synthetic/rig_views.hpp"
#include "synthetic/seed.hpp"

namespace {

const int kScenes = synthetic::rounds(8, 1);

synthetic::RigViewsPlan handheld() {
    synthetic::RigViewsPlan plan = synthetic::handheld_plan();
    plan.k1_px = -20;
    return plan;
}

struct outcome {
    int scenes = 0, good = 0, scattered = 0, stretched = 0;
    double baseline_z2 = 0, focal_z2 = 0, turn_z2 = 0;  // sums of squared standard scores
    std::string words;

    double rms(double sum) const { return std::sqrt(sum / scenes); }
};

outcome solve_some(const synthetic::RigViewsPlan &plan, int scenes) {
    outcome result;
    const uint64_t seed = synthetic::test_seed();
    for (uint64_t i = 0; i < uint64_t(scenes); i++) {
        const auto views = synthetic::make_rig_views(plan, seed + i, seed + 500 + i);
        const calibration truth = views.truth();
        calib::solve_options options;
        options.threads = 2;
        options.second_start = false;
        const calib::solution found = calib::solve(views.seen, options);
        REQUIRE(found.solved);
        result.scenes++;
        result.good += found.verdict.good;
        result.scattered += found.fit.scattered;
        result.stretched += found.target.stretched;
        for (const std::string &text : found.verdict.reasons) {
            result.words += text;
        }
        for (const std::string &text : found.verdict.remarks) {
            result.words += text;
        }
        result.baseline_z2 +=
            std::pow((calibration_baseline_mm(&found.rig) - calibration_baseline_mm(&truth)) /
                         found.sigma.baseline_mm,
                     2);
        result.focal_z2 +=
            std::pow((found.camera[0].fx_px - truth.left.fx_px) / found.sigma.focal_px[0], 2);
        result.turn_z2 +=
            std::pow((found.rig.rotation_right_left_rad[1] - truth.rotation_right_left_rad[1]) /
                         found.sigma.rotation_rad[1],
                     2);
    }
    return result;
}

}  // namespace

TEST_CASE("consistent views are not called scattered") {
    const outcome seen = solve_some(handheld(), kScenes);
    CHECK(seen.scattered == 0);
    CHECK(seen.good == kScenes);
    CHECK(seen.rms(seen.baseline_z2) < 2);
}

TEST_CASE("boards that moved between left and right pictures widen the error bars") {
    synthetic::RigViewsPlan plan = handheld();
    plan.moved_mm = 0.3;
    const outcome seen = solve_some(plan, kScenes);
    CHECK(seen.scattered == kScenes);
    CHECK(seen.words.find("did the board move between left and right pictures") !=
          std::string::npos);
    // All moved the same way, which causes no scatter; without the widening this is 5.
    CHECK(seen.rms(seen.baseline_z2) < 3.5);
    CHECK(seen.rms(seen.turn_z2) < 2.5);
    CHECK(seen.rms(seen.focal_z2) < 2);
}

TEST_CASE("a rig that was bumped is not good") {
    synthetic::RigViewsPlan plan = handheld();
    plan.displacement_rad = 0.002;
    const outcome seen = solve_some(plan, kScenes);
    CHECK(seen.scattered >= kScenes - 1);
    CHECK(seen.good <= kScenes * 3 / 8);
}

TEST_CASE("a stretched print makes all lengths doubtful, with a remark") {
    synthetic::RigViewsPlan plan = handheld();
    plan.stretch = 0.003;
    const outcome seen = solve_some(plan, kScenes);
    CHECK(seen.stretched == kScenes);
    CHECK(seen.good == kScenes);
    CHECK(seen.words.find("measure --square along both") != std::string::npos);
    CHECK(seen.rms(seen.baseline_z2) < 2);
    CHECK(seen.rms(seen.focal_z2) < 2);
    plan.stretch = 0.03;
    const outcome much = solve_some(plan, 2);
    INFO(much.words);
    CHECK(much.good == 0);
    CHECK(much.words.find("pixels that are not square explain it worse") != std::string::npos);
    CHECK(much.words.find("baseline") == std::string::npos);  // known but for the print
}

TEST_CASE("pixels that are not square are named, and the print is not blamed") {
    for (const double aspect : {1.03, 0.75}) {
        synthetic::RigViewsPlan plan = handheld();
        plan.aspect = aspect;
        const outcome seen = solve_some(plan, 2);
        INFO(seen.words);
        CHECK(seen.good == 2);
        CHECK(seen.stretched == 0);
        CHECK(seen.words.find(aspect > 1 ? "3.0 % taller than wide" : "25.0 % wider than tall") !=
              std::string::npos);
        CHECK(seen.words.find("print") == std::string::npos);
    }
}

TEST_CASE("a twisted board does not bend the focal length") {
    synthetic::RigViewsPlan plan = handheld();
    plan.twist_mm = 1;
    const outcome seen = solve_some(plan, kScenes);
    CHECK(seen.good == kScenes);
    CHECK(seen.rms(seen.focal_z2) < 2);
}

TEST_CASE("cameras in the same place have no baseline") {
    synthetic::RigViewsPlan plan = handheld();
    plan.baseline_mm = 0.05;
    const outcome seen = solve_some(plan, 2);
    CHECK(seen.good == 0);
    INFO(seen.words);
    CHECK(seen.words.find("in the same place") != std::string::npos);
    CHECK(seen.words.find("is --square in mm") != std::string::npos);
}
