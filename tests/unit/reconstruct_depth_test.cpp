// SPDX-License-Identifier: Apache-2.0
// The depths that are asked for: what lies outside is no part of the surface.
#include <doctest/doctest.h>

#include <algorithm>

#include "core/error.h"
#include "synthetic/seed.hpp"
#include "synthetic/verged.hpp"

using namespace synthetic;

TEST_CASE("no point lies outside the depths asked for, and none within them is lost") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Verged setup = make_verged(seed);
    // Between two disparities that are searched anyhow: the cut is the points' own.
    constexpr double kNearMm = 900, kFarMm = 1003.5;
    VergedSetting asked;
    asked.options.rectify.depth_near_mm = kNearMm;
    asked.options.rectify.depth_far_mm = kFarMm;
    const VergedRun done = run_verged(setup, asked);
    REQUIRE(done.status == ERROR_OK);
    int outside = 0;
    for (uint32_t i = 0; i < done.result.vertex_count; i++) {
        const double z_mm = done.result.points[i].z_um / 1000.0;
        outside += z_mm < kNearMm - 0.001 || z_mm > kFarMm + 0.001;
    }
    CHECK(outside == 0);
    CHECK(done.result.reason_count[REASON_VALID] == done.result.vertex_count);

    asked.options.keep_all = true;
    const VergedRun all = run_verged(setup, asked);
    REQUIRE(all.status == ERROR_OK);
    double least_mm = 1e9, most_mm = 0;
    for (uint32_t i = 0; i < all.result.vertex_count; i++) {
        least_mm = std::min(least_mm, all.result.points[i].z_um / 1000.0);
        most_mm = std::max(most_mm, all.result.points[i].z_um / 1000.0);
    }
    CHECK(least_mm < kNearMm);
    CHECK(most_mm > kFarMm);

    // The same search, asked for as disparities: what lies within is what was kept.
    VergedSetting searched = asked;
    searched.options.keep_all = false;
    searched.options.rectify.disparity_min = done.result.plan.disparity_min;
    searched.options.rectify.disparity_count = done.result.plan.disparity_count;
    const VergedRun wide = run_verged(setup, searched);
    REQUIRE(wide.status == ERROR_OK);
    const auto within =
        std::count_if(wide.result.points, wide.result.points + wide.result.vertex_count,
                      [](const triangulate_point &point) {
                          return point.z_um >= 1000 * kNearMm && point.z_um <= 1000 * kFarMm + 1;
                      });
    CHECK(within == static_cast<long>(done.result.vertex_count));
    CHECK(wide.result.vertex_count > done.result.vertex_count);
}

TEST_CASE("depths without anything in them are no surface") {
    const Verged setup = make_verged(5);
    VergedSetting asked;
    // One disparity is 39 mm there, and the search goes beyond what was asked for by one or more.
    asked.options.rectify.depth_near_mm = 1399;
    asked.options.rectify.depth_far_mm = 1399.01;
    const VergedRun done = run_verged(setup, asked);
    CHECK(done.status == ERROR_NO_SURFACE);
    CHECK(done.result.reason_count[REASON_VALID] == 0);
}
