// SPDX-License-Identifier: Apache-2.0
// Wide lenses: which model is found, and how well it maps the field.
#include <doctest/doctest.h>

#include <cmath>
#include <optional>
#include <string>

#include "calib/detect/detect.hpp"
#include "calib/solve/solve.hpp"
#include "core/error.h"
#include "stereo/geometry/geometry.h"
#include "stereo/geometry/rectify.h"
#include "synthetic/board_image.hpp"
#include "synthetic/rig_views.hpp"
#include "synthetic/seed.hpp"

namespace {

using calib::lens_model;
using synthetic::operator*;

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

// The corners that are found in rendered pictures of the same boards.
void photograph_boards(synthetic::RigViews *views, uint64_t seed) {
    const synthetic::Matrix R_right_left = synthetic::rotation_from_vector(views->rotation_rad);
    for (size_t i = 0; i < views->seen.captures.size(); i++) {
        const synthetic::BoardPose left = {views->R_left_board[i], views->t_left_board_mm[i]};
        const synthetic::BoardPose right = {
            R_right_left * left.R_camera_board,
            R_right_left * left.t_camera_board_mm + views->translation_mm};
        for (const size_t camera : {size_t(0), size_t(1)}) {
            synthetic::BoardLight light;
            light.blur_px = 0.8;
            light.seed = seed + 2 * i + camera;
            synthetic::BoardImage image =
                photograph(views->seen.target, camera == 0 ? views->rig.left : views->rig.right,
                           camera == 0 ? left : right, light);
            views->seen.captures[i].view[camera] =
                calib::detect_board(views->seen.target, image.view(), {});
        }
    }
}

// Largest difference of rows, in px, over the field of the rectified pair.
double largest_row_px(const calibration &truth, const calibration &found) {
    rectify_options options{};
    options.scale = 1;
    rectify_plan plan;
    REQUIRE(rectify_plan_make(&found, &options, &plan) == ERROR_OK);
    double R_right_left[9], largest = 0;
    int seen = 0;
    geometry_rotation_from_vector(truth.rotation_right_left_rad, R_right_left);
    for (int i = 0; i <= 400; i++) {
        const double x = (i % 20 * plan.width_px / 20.0 - plan.cx_left_px) / plan.f_px;
        const double y = (i / 20 * plan.height_px / 20.0 - plan.cy_px) / plan.fy_px;
        const double rect[3] = {1000 * x, 1000 * y, 1000};
        double left_mm[3], right_mm[3], pixel_px[2][2], ray[3], rows[2] = {0, 0};
        geometry_rotate_back(plan.R_rect_left, rect, left_mm);
        geometry_rotate(R_right_left, left_mm, right_mm);
        for (int axis = 0; axis < 3; axis++) {
            right_mm[axis] += truth.translation_right_left_mm[axis];
        }
        bool both = lens_project(&truth.left, left_mm, pixel_px[0]) &&
                    lens_project(&truth.right, right_mm, pixel_px[1]);
        for (int side = 0; side < 2 && both; side++) {
            double turned[3];
            both = lens_ray(side == 0 ? &found.left : &found.right, pixel_px[side], ray);
            geometry_rotate(side == 0 ? plan.R_rect_left : plan.R_rect_right, ray, turned);
            rows[side] = plan.fy_px * turned[1] / turned[2];
        }
        seen += both;
        largest = both ? std::fmax(largest, std::fabs(rows[0] - rows[1])) : largest;
    }
    CHECK(seen > 200);
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

TEST_CASE("rendered pictures of a lens of 160 degrees give rows within 0.1 px") {
    if (synthetic::kSanitized) {
        return;  // rendering takes a minute then; its parts are sanitized in other tests
    }
    synthetic::RigViewsPlan plan = wide_plan(true);
    plan.width /= 2, plan.height /= 2, plan.focal_px /= 2;  // pictures are slow to render
    plan.boards = 10;
    plan.all_in_view = true;
    const uint64_t seed = synthetic::test_seed();
    synthetic::RigViews views = synthetic::make_rig_views(plan, seed, seed + 1);
    photograph_boards(&views, seed);
    const calib::solution found = solve(views);
    INFO(found.verdict.sentence);
    REQUIRE(found.solved);
    CHECK(found.model.distortion == lens_model::EQUIDISTANT);
    CHECK(found.captures_used >= 7);  // boards whose white border is cut off are not found
    const double row_px = largest_row_px(views.truth(), found.rig);
    MESSAGE(found.captures_used, " boards, rows within ", row_px, " px");
    CHECK(row_px < 0.1);
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
    synthetic::RigViewsPlan plan = synthetic::handheld_plan();
    const uint64_t seed = synthetic::test_seed();
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
