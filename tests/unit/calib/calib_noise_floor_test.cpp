// SPDX-License-Identifier: Apache-2.0
// Corners with larger errors than the noise of their images predicts.
#include <doctest/doctest.h>

#include <cmath>

#include "calib/solve/solve.hpp"
#include "stereo/geometry/geometry.h"
#include "synthetic/rig_views.hpp"
#include "synthetic/seed.hpp"

namespace {

// Ten boards with the same true error, of which every other one claims to be ten times as accurate.
calib::observations claims(uint64_t seed) {
    synthetic::RigViewsPlan plan;
    plan.width = 1280;
    plan.height = 960;
    plan.focal_px = 2000;
    plan.boards = 10;
    plan.columns = 9;
    plan.rows = 6;
    plan.depth_range = 0.2;
    plan.noise_px = 0.1;
    calib::observations seen = synthetic::make_rig_views(plan, seed, seed + 1).seen;
    for (size_t i = 0; i < seen.captures.size(); i++) {
        for (calib::board_view &view : seen.captures[i].view) {
            for (calib::corner &corner : view.corners) {
                corner.sigma_px = i % 2 == 0 ? 0.02 : 0.002;
            }
        }
    }
    return seen;
}

}  // namespace

TEST_CASE("corner errors beyond the noise of the images are found and weighted equally") {
    double squares = 0;
    const int seeds = synthetic::rounds(8, 2);
    for (uint64_t seed = 1; seed <= uint64_t(seeds); seed++) {
        INFO("seed ", seed);
        const calib::solution found = calib::solve(claims(seed), {});
        REQUIRE(found.solved);
        CHECK(found.rejected_corners.empty());
        CHECK(found.fit.floor_px == doctest::Approx(0.1).epsilon(0.1));
        CHECK(found.fit.sigma_ratio > 5);
        CHECK(found.verdict.good);
        CHECK(found.sigma0 == doctest::Approx(1).epsilon(0.15));
        const double off_mm = geometry_norm(found.T_right_left.t_mm) - 250;
        squares += off_mm * off_mm / (found.sigma.baseline_mm * found.sigma.baseline_mm);
        // Views with correct and with too small sigmas have the same errors.
        double by_claim[2] = {0, 0};
        for (size_t i = 0; i < found.views.size(); i++) {
            by_claim[i % 2] += found.views[i][0].rms_px;
        }
        CHECK(by_claim[0] == doctest::Approx(by_claim[1]).epsilon(0.25));
    }
    CHECK(std::sqrt(squares / seeds) < 2);
}

TEST_CASE("corners with correct sigmas have no floor") {
    synthetic::RigViewsPlan plan;
    plan.focal_px = 2000;
    plan.boards = 8;
    plan.depth_range = 0.2;
    const calib::solution found = calib::solve(synthetic::make_rig_views(plan, 3, 4).seen, {});
    REQUIRE(found.solved);
    CHECK(found.fit.floor_px == 0);
    CHECK(found.fit.sigma_ratio == doctest::Approx(1).epsilon(0.15));
}
