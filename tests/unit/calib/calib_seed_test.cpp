// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>

#include "calib/solve/seed.hpp"
#include "calib/solve/solve_input.hpp"
#include "synthetic/rig_views.hpp"
#include "synthetic/seed.hpp"

namespace {

using calib::LEFT;

synthetic::RigViewsPlan plan_at(double focal_px, double noise_px) {
    synthetic::RigViewsPlan plan;
    plan.focal_px = focal_px;
    plan.noise_px = noise_px;
    plan.k1_px = plan.k2_px = plan.p1_px = plan.p2_px = plan.centre_px = 0;
    return plan;
}

calib::bundle used_bundle(const calib::observations &seen) {
    calib::bundle data = calib::order_observations(seen).data;
    for (auto &capture : data.captures) {
        capture[0].used = capture[1].used = true;
    }
    return data;
}

std::vector<calib::homography> homographies(const calib::bundle &data, size_t camera) {
    std::vector<calib::homography> result(data.captures.size());
    for (size_t i = 0; i < result.size(); i++) {
        REQUIRE(calib::fit_homography(data, data.captures[i][camera], &result[i]));
    }
    return result;
}

}  // namespace

TEST_CASE("a homography of exact corners is exact, and robust against wrong ones") {
    const auto views = synthetic::make_rig_views(plan_at(3000, 0), 1, 2);
    calib::bundle data = used_bundle(views.seen);
    calib::bundle_view &view = data.captures[0][LEFT];
    calib::homography clean, dirty;
    REQUIRE(calib::fit_homography(data, view, &clean));
    CHECK(clean.misfit_px < 1e-8);
    CHECK_FALSE(clean.mirrored);
    for (size_t i = 3; i < view.corners.size(); i += 7) {
        view.corners[i].x_px += 40;
    }
    REQUIRE(calib::fit_homography(data, view, &dirty));
    CHECK(dirty.misfit_px < 0.05);
    for (calib::bundle_corner &corner : view.corners) {
        corner.x_px = 2047 - corner.x_px;
    }
    REQUIRE(calib::fit_homography(data, view, &dirty));
    CHECK(dirty.mirrored);
    view.corners.resize(12);  // one row
    CHECK_FALSE(calib::fit_homography(data, view, &dirty));
}

TEST_CASE("the scan finds focal lengths from 500 to 30,000 px") {
    for (const double focal_px : {500.0, 1200.0, 5000.0, 12000.0, 30000.0}) {
        for (uint64_t seed = 1; seed <= 5; seed++) {
            INFO("focal length ", focal_px, " px, seed ", seed);
            const auto views = synthetic::make_rig_views(plan_at(focal_px, 0.1), seed, seed + 50);
            const calib::bundle data = used_bundle(views.seen);
            const auto found =
                calib::scan_focal_lengths(data.frame[LEFT], homographies(data, LEFT), 2);
            REQUIRE(!found.empty());
            CHECK(std::fabs(std::log(found[0] / focal_px)) < 0.15);
        }
    }
}

TEST_CASE("a pose is found from its mirrored twin") {
    const auto views = synthetic::make_rig_views(plan_at(26560, 0.1), 3, 4);
    const calib::bundle data = used_bundle(views.seen);
    const calibration truth = views.truth();
    calib::bundle_state state;
    state.lens[0] = calib::state_from_lens(data.frame[0], truth.left);
    state.lens[1] = calib::state_from_lens(data.frame[1], truth.right);
    int twins = 0;
    for (size_t i = 0; i < data.captures.size(); i++) {
        calib::both_views left_only = data.captures[i];
        left_only[1].used = false;
        calib::homography seen;
        calib::rigid pose;
        REQUIRE(calib::fit_homography(data, left_only[0], &seen));
        REQUIRE(calib::pose_from_homography(seen, truth.left.fx_px, truth.left.cx_px,
                                            truth.left.cy_px, &pose));
        calib::rigid right = pose, twin = calib::second_pose(pose);
        const double cost = calib::fit_pose(data, left_only, state, 0, &right);
        REQUIRE(cost > 0);
        CHECK(cost < 3);  // noise makes two
        calib::rigid stuck = twin;
        twins += calib::fit_pose(data, left_only, state, 0, &stuck) > 1.5 * cost;
        CHECK(calib::fit_pose_either_way(data, left_only, state, 0, &twin) ==
              doctest::Approx(cost).epsilon(1e-3));
        CHECK(calib::turn_between_rad(right, twin) < 1e-3);
        // Reversed twice is the original.
        CHECK(calib::turn_between_rad(calib::second_pose(calib::second_pose(pose)), pose) < 1e-12);
    }
    CHECK(twins >= 10);  // the second solution exists, and is worse
}

TEST_CASE("pairs vote for the rig, and outliers stand out") {
    auto views = synthetic::make_rig_views(plan_at(3000, 0.1), 5, 6);
    std::swap(views.seen.captures[2].view[1], views.seen.captures[7].view[1]);
    const calib::bundle data = used_bundle(views.seen);
    const calibration truth = views.truth();
    const calib::lens_state right = calib::state_from_lens(data.frame[1], truth.right);
    std::vector<calib::rigid> poses[2];
    std::vector<size_t> pairs;
    for (size_t camera = 0; camera < 2; camera++) {
        const lens &lens = camera == 0 ? truth.left : truth.right;
        const calib::bundle alone = calib::single_camera(data, int(camera));
        calib::bundle_state state;
        state.lens[0] = calib::state_from_lens(data.frame[camera], lens);
        for (const calib::homography &seen : homographies(data, camera)) {
            calib::rigid pose;
            REQUIRE(calib::pose_from_homography(seen, lens.fx_px, lens.cx_px, lens.cy_px, &pose));
            REQUIRE(calib::fit_pose_either_way(alone, alone.captures[poses[camera].size()], state,
                                               3, &pose) > 0);
            poses[camera].push_back(pose);
        }
    }
    for (size_t i = 0; i < data.captures.size(); i++) {
        pairs.push_back(i);
    }
    calib::rigid T_right_left;
    const auto off = calib::vote_rig(data, right, poses, pairs, &T_right_left);
    const std::vector<size_t> caller = calib::order_observations(views.seen).caller;
    for (size_t i = 0; i < off.size(); i++) {
        INFO("pair ", caller[i]);
        CHECK((off[i] > 50) == (caller[i] == 2 || caller[i] == 7));
    }
    for (int i = 0; i < 3; i++) {
        CHECK(std::fabs(T_right_left.t_mm[i] - truth.translation_right_left_mm[i]) < 5);
    }
}
