// SPDX-License-Identifier: Apache-2.0
// Wide lenses: which model is found, and how well it maps the field.
#include <doctest/doctest.h>

#include <cmath>
#include <optional>
#include <string>

#include "calib/solve/solve.hpp"
#include "core/error.h"
#include "synthetic/rig_views.hpp"
#include "synthetic/seed.hpp"

namespace {

using calib::lens_model;

// 160 degrees over the width.
synthetic::RigViewsPlan wide_plan(bool equidistant) {
    synthetic::RigViewsPlan plan;
    plan.width = 640;
    plan.height = 480;
    plan.columns = 9;
    plan.rows = 6;
    plan.boards = 24;
    plan.focal_px = 229;
    plan.baseline_mm = 100;
    plan.distance_mm = 600;
    plan.depth_range = 0.3;
    plan.centre_px = 5;
    plan.fill = 0.3;
    plan.all_in_view = false;
    plan.equidistant = equidistant;
    const double angular[8] = {-0.02, 0.004, 0, 0, -0.002, 0.0003, 0, 0};
    const double rational[8] = {0.6, 0.02, 3e-4, -2e-4, 0.0002, 0.95, 0.1, 0.001};
    std::copy_n(equidistant ? angular : rational, 8, plan.wide);
    return plan;
}

// Largest distance in px between where two cameras see the rays of the first one's image.
double largest_off_px(const lens &truth, const lens &found, double share) {
    double largest = 0;
    for (int i = 0; i <= 20; i++) {
        for (int k = 0; k <= 20; k++) {
            const double pixel_px[2] = {truth.cx_px + share * truth.width_px * (i / 20.0 - 0.5),
                                        truth.cy_px + share * truth.height_px * (k / 20.0 - 0.5)};
            double ray[3], seen_px[2];
            REQUIRE(lens_ray(&truth, pixel_px, ray));
            REQUIRE(lens_project(&found, ray, seen_px));
            largest =
                std::fmax(largest, std::hypot(seen_px[0] - pixel_px[0], seen_px[1] - pixel_px[1]));
        }
    }
    return largest;
}

calib::solution solve(const synthetic::RigViews &views,
                      std::optional<lens_model::kind> model = std::nullopt) {
    calib::solve_options options;
    options.distortion = model;
    options.threads = 2;
    options.second_start = false;
    return calib::solve(views.seen, options);
}

}  // namespace

TEST_CASE("a lens of 160 degrees is found equidistant, with all its boards") {
    const synthetic::RigViews views = synthetic::make_rig_views(wide_plan(true), 5, 6);
    const calib::solution found = solve(views);
    INFO(found.verdict.sentence);
    REQUIRE(found.solved);
    CHECK(found.model.distortion == lens_model::EQUIDISTANT);
    CHECK(found.rejected_views.empty());
    CHECK(found.captures_used == 24);
    CHECK(found.rms_px < 0.16);  // noise of 0.1 px in x and in y
    const calibration truth = views.truth();
    CHECK(largest_off_px(truth.left, found.rig.left, 0.9) < 1);
    CHECK(std::fabs(calibration_baseline_mm(&found.rig) - 100) < 0.5);
    CHECK(found.verdict.good);
}

TEST_CASE("a rational lens is found rational") {
    const synthetic::RigViews views = synthetic::make_rig_views(wide_plan(false), 7, 8);
    const calib::solution found = solve(views);
    INFO(found.verdict.sentence);
    REQUIRE(found.solved);
    CHECK(found.model.distortion == lens_model::RATIONAL);
    CHECK(found.rejected_views.empty());
    CHECK(found.rms_px < 0.16);
    CHECK(std::fabs(calibration_baseline_mm(&found.rig) - 100) < 0.5);
}

TEST_CASE("a wide lens forced into a model that is too narrow is named first, with the way out") {
    const synthetic::RigViews views = synthetic::make_rig_views(wide_plan(true), 9, 10);
    for (const lens_model::kind model : {lens_model::NONE, lens_model::K1_K2_P1_P2_K3}) {
        const calib::solution found = solve(views, model);
        INFO(found.verdict.sentence);
        CHECK_FALSE(found.verdict.good);
        CHECK(found.verdict.lens_outside_model);
        CHECK(found.verdict.sentence.find("lens") != std::string::npos);
        CHECK(found.verdict.sentence.find("omit --model") != std::string::npos);
    }
}

TEST_CASE("a lens that no model follows is named first, and something that moved is not a lens") {
    synthetic::RigViewsPlan plan;
    plan.width = 1280;
    plan.height = 960;
    plan.focal_px = 1000;
    plan.columns = 9;
    plan.rows = 6;
    plan.boards = 15;
    plan.distance_mm = 900;
    plan.baseline_mm = 120;
    plan.depth_range = 0.35;
    plan.fill = 0.45;
    const uint64_t seed = synthetic::test_seed();
    INFO("VERGENCE_SEED=" << seed);
    for (uint64_t i = 0; i < uint64_t(synthetic::rounds(3, 1)); i++) {
        synthetic::RigViewsPlan rippled = plan, moved = plan, bumped = plan;
        rippled.ripple_px = 2;
        moved.moved_mm = 1;
        bumped.displacement_rad = 0.002;
        const calib::solution odd = solve(synthetic::make_rig_views(rippled, seed + i, seed + i));
        INFO(odd.verdict.sentence);
        CHECK_FALSE(odd.verdict.good);
        CHECK(odd.verdict.lens_outside_model);
        CHECK(odd.verdict.sentence.find("does not follow its model") != std::string::npos);
        CHECK(odd.verdict.sentence.find("crop") != std::string::npos);
        for (const synthetic::RigViewsPlan &shifted : {moved, bumped}) {
            const calib::solution found =
                solve(synthetic::make_rig_views(shifted, seed + i, seed + i));
            INFO(found.verdict.sentence);
            CHECK_FALSE(found.verdict.lens_outside_model);
            std::string all;
            for (const auto &texts : {found.verdict.reasons, found.verdict.remarks}) {
                for (const std::string &text : texts) {
                    all += text;
                }
            }
            CHECK(all.find("did the board move") != std::string::npos);
        }
    }
}
