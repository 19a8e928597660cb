// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>

#include "calib/solve/model_choice.hpp"
#include "synthetic/rig_views.hpp"
#include "synthetic/seed.hpp"

namespace {

const int kScenes = synthetic::rounds(8, 1);
const int kMax = (kScenes * 3 + 3) / 4;

using calib::lens_model;

synthetic::RigViewsPlan ideal() {
    synthetic::RigViewsPlan plan;
    plan.width = 1280;
    plan.height = 960;
    plan.focal_px = 1500;
    plan.boards = 10;
    plan.columns = 9;
    plan.rows = 6;
    plan.depth_range = 0.2;
    plan.k1_px = plan.k2_px = plan.p1_px = plan.p2_px = 0;
    return plan;
}

calib::solution solve(const synthetic::RigViewsPlan &plan, uint64_t seed) {
    calib::solve_options options;
    options.threads = 2;
    options.second_start = false;
    return calib::solve(synthetic::make_rig_views(plan, seed, seed + 30).seen, options);
}

// Number of scenes whose result `wanted` accepts.
template <typename Wanted>
int count(const synthetic::RigViewsPlan &plan, Wanted wanted) {
    int found = 0;
    for (int seed = 1; seed <= kScenes; seed++) {
        found += wanted(solve(plan, uint64_t(seed)));
    }
    return found;
}

}  // namespace

TEST_CASE("an ideal camera and a flat board get the simple model") {
    CHECK(count(ideal(), [](const calib::solution &found) {
              return found.model.distortion <= lens_model::K1_K2_P1_P2;
          }) >= kMax);
    CHECK(count(ideal(), [](const calib::solution &found) {
              return found.model.square_pixels && found.target.count() == 0;
          }) >= kMax);
}

TEST_CASE("existing effects are estimated") {
    synthetic::RigViewsPlan plan = ideal();
    SUBCASE("barrel") {
        plan.k1_px = -3;
        CHECK(count(plan, [](const calib::solution &found) {
                  return found.model.distortion >= lens_model::K1;
              }) == kScenes);
        CHECK(count(plan, [](const calib::solution &found) {
                  return found.model.distortion <= lens_model::K1_K2_P1_P2;
              }) >= kMax);
    }
    SUBCASE("a lens off its axis") {
        plan.p1_px = 1;
        CHECK(count(plan, [](const calib::solution &found) {
                  return found.model.distortion >= lens_model::K1_K2_P1_P2;
              }) == kScenes);
    }
    SUBCASE("pixels that are not square") {
        plan.aspect = 1.002;
        CHECK(count(plan, [](const calib::solution &found) {
                  return !found.model.square_pixels;
              }) == kScenes);
    }
    SUBCASE("a bent board") {
        plan.warp_mm[0] = 3;
        CHECK(count(plan, [](const calib::solution &found) { return found.target.bent; }) ==
              kScenes);
    }
    SUBCASE("a twisted board") {
        plan.twist_mm = 2;
        CHECK(count(plan, [](const calib::solution &found) { return found.target.bent; }) ==
              kScenes);
    }
    SUBCASE("a stretched print, its pixels being square") {
        plan.stretch = 0.003;
        CHECK(count(plan, [](const calib::solution &found) {
                  return found.target.stretched && found.model.square_pixels;
              }) == kScenes);
        // A board that was never rotated in its plane is not mistaken for non-square pixels,
        // either.
        plan.roll_max_rad = 0;
        CHECK(count(plan, [](const calib::solution &found) {
                  return found.target.stretched && found.model.square_pixels;
              }) == kScenes);
    }
}

TEST_CASE("scores are reported, one of them chosen, and held-out residuals are near the noise") {
    synthetic::RigViewsPlan plan = ideal();
    plan.k1_px = -10;
    const calib::solution found = solve(plan, 3);
    int chosen = 0;
    for (const calib::model_score &score : found.scores) {
        chosen += score.chosen;
        CHECK(std::isfinite(score.held_out_rms_px));
        if (score.chosen) {
            CHECK(score.held_out_rms_px == found.held_out_rms_px);
            CHECK(score.model.distortion == found.model.distortion);
        }
    }
    CHECK(chosen == 1);
    CHECK(found.held_out_rms_px > found.rms_px);
    CHECK(found.held_out_rms_px < 1.1 * found.rms_px);
}

TEST_CASE("a distortion that the caller states is kept, and pixels and board are chosen") {
    synthetic::RigViewsPlan plan = ideal();
    plan.k1_px = -10;
    plan.p1_px = 0.5;
    plan.warp_mm[0] = 3;
    calib::solve_options options;
    options.threads = 2;
    options.second_start = false;
    for (const lens_model::kind kind : {lens_model::K1, lens_model::K1_K2_P1_P2_K3}) {
        options.distortion = kind;
        for (const int boards : {10, 4}) {  // four positions are too few for a choice
            plan.boards = boards;
            const calib::solution found =
                calib::solve(synthetic::make_rig_views(plan, 2, 32).seen, options);
            REQUIRE(found.solved);
            CHECK(found.model.distortion == kind);
            CHECK((found.camera[0].k3 != 0) == (kind == lens_model::K1_K2_P1_P2_K3));
            CHECK((found.camera[1].p1 != 0) == (kind == lens_model::K1_K2_P1_P2_K3));
            CHECK(found.target.bent == (boards == 10));
        }
    }
}

TEST_CASE("names of models") {
    CHECK(std::string(calib::lens_model_name({lens_model::NONE, true})) == "no distortion");
    CHECK(std::string(calib::lens_model_name({lens_model::K1_K2_P1_P2_K3, false})) ==
          "k1 k2 p1 p2 k3, free fy");
    CHECK(lens_model{lens_model::NONE, true}.count() == 3);
    CHECK(lens_model{lens_model::K1_K2_P1_P2_K3, false}.count() == 9);
}
