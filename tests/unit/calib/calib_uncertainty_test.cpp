// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>

#include "calib/solve/solve_parallel.hpp"
#include "calib/solve/uncertainty.hpp"
#include "stereo/geometry/geometry.h"
#include "synthetic/rig_views.hpp"
#include "synthetic/seed.hpp"

namespace {

using synthetic::Matrix;
using synthetic::Vector;

synthetic::RigViewsPlan small_rig() {
    synthetic::RigViewsPlan plan;
    plan.width = 640;
    plan.height = 480;
    plan.focal_px = 900;
    plan.boards = 10;
    plan.columns = 7;
    plan.rows = 5;
    plan.k1_px = -20;
    plan.k2_px = 4;
    plan.baseline_mm = 120;
    plan.distance_mm = 900;
    plan.depth_range = 0.25;
    plan.centre_px = 8;
    return plan;
}

// Standard scores of one kind of quantity over many draws.
struct scores {
    double squares = 0;
    int count = 0, within = 0;

    void add(double error, double sigma) {
        squares += error * error / (sigma * sigma);
        count++;
        within += std::fabs(error) < 1.959964 * sigma;
    }
    double rms() const { return std::sqrt(squares / count); }
    double covered() const { return double(within) / count; }
};

// Where the estimated rig sees the point that the true one sees at `pixel`, with the boards fixed:
// the mean over the boards of the frames that they imply.
bool projection_error(const synthetic::RigViews &views, const calib::solution &found, int camera,
                      const double pixel[2], double distance_mm, double error[2]) {
    const synthetic::Camera &eye = camera == 0 ? views.rig.left : views.rig.right;
    const bool far = !std::isfinite(distance_mm);
    const Vector direction = eye.direction({pixel[0], pixel[1]});
    const Vector offset = (far ? 1 : distance_mm / norm(direction)) * direction;
    const Vector point = far ? offset : eye.centre_mm + offset;
    Vector moved;
    const double boards = double(found.T_left_board.size());
    for (size_t i = 0; i < found.T_left_board.size(); i++) {
        const Matrix R_board_left = synthetic::transpose(views.R_left_board[i]);
        const Vector on_board = R_board_left * (far ? point : point - views.t_left_board_mm[i]);
        const double b[3] = {on_board.x, on_board.y, on_board.z};
        double p[3];
        if (far) {
            geometry_rotate(found.T_left_board[i].R, b, p);
        } else {
            calib::apply(found.T_left_board[i], b, p);
        }
        moved = moved + (1 / boards) * Vector{p[0], p[1], p[2]};
    }
    double in_left[3] = {moved.x, moved.y, moved.z}, in_right[3], seen[2];
    if (far) {
        geometry_rotate(found.T_right_left.R, in_left, in_right);
    } else {
        calib::apply(found.T_right_left, in_left, in_right);
    }
    if (!lens_project(&found.camera[camera], camera == 0 ? in_left : in_right, seen)) {
        return false;
    }
    error[0] = seen[0] - pixel[0];
    error[1] = seen[1] - pixel[1];
    return true;
}

// Depth that the estimated rig measures where the true depth is `depth_mm`, with exact pixels.
double depth_error_mm(const synthetic::RigViews &views, const calib::solution &found,
                      const double pixel[2], double depth_mm) {
    const Vector ray = views.rig.left.direction({pixel[0], pixel[1]});
    const Vector point = (depth_mm / ray.z) * ray;
    const auto right = views.rig.right.project(point);
    REQUIRE(right);
    const double right_pixel[2] = {right->x, right->y};
    double left_ray[3], right_ray[3], turned[3];
    REQUIRE(lens_ray(&found.camera[0], pixel, left_ray));
    REQUIRE(lens_ray(&found.camera[1], right_pixel, right_ray));
    const calib::rigid T_left_right = inverse(found.T_right_left);
    geometry_rotate(T_left_right.R, right_ray, turned);
    const double origin[3] = {0, 0, 0};
    geometry_midpoint middle;
    REQUIRE(geometry_rays_midpoint(origin, left_ray, T_left_right.t_mm, turned, &middle));
    return middle.point_mm[2] - depth_mm;
}

struct draw {
    synthetic::RigViews views;
    calib::solution found;
};

// In a campaign (VERGENCE_DRAWS) the model is chosen again in every draw, which takes longer.
draw make_draw(const synthetic::RigViewsPlan &plan, uint64_t scene, uint64_t noise) {
    draw result{synthetic::make_rig_views(plan, scene, noise), {}};
    calib::solve_options options;
    options.choose_model = std::getenv("VERGENCE_DRAWS") != nullptr;
    options.second_start = false;
    options.model = {calib::lens_model::K1_K2_P1_P2, true};
    result.found = calib::solve(result.views.seen, options);
    return result;
}

using all_scores = std::map<std::string, scores>;

void add_projections(const draw &one, all_scores *all) {
    const double pixels[3][2] = {{320, 240}, {40, 30}, {600, 300}};
    for (const double distance_mm : {600.0, 900.0, double(INFINITY)}) {
        for (int camera = 0; camera < 2; camera++) {
            for (const double *pixel : {pixels[0], pixels[1], pixels[2]}) {
                double error[2] = {0, 0}, covariance[3];
                REQUIRE(projection_error(one.views, one.found, camera, pixel, distance_mm, error));
                REQUIRE(one.found.errors->projection_covariance(camera, pixel, distance_mm,
                                                                covariance));
                const std::string name =
                    std::string(camera == 0 ? "left" : "right") + " at " +
                    std::to_string(int(pixel[0])) + ", " +
                    (std::isfinite(distance_mm) ? std::to_string(int(distance_mm)) + " mm"
                                                : "infinity");
                (*all)["x of " + name].add(error[0], std::sqrt(covariance[0]));
                (*all)["y of " + name].add(error[1], std::sqrt(covariance[2]));
            }
        }
    }
}

void add_draw(const draw &one, all_scores *all) {
    const calibration truth = one.views.truth();
    const calib::solution &found = one.found;
    (*all)["left f"].add(found.camera[0].fx_px - truth.left.fx_px, found.sigma.focal_px[0]);
    (*all)["right f"].add(found.camera[1].fx_px - truth.right.fx_px, found.sigma.focal_px[1]);
    (*all)["left cx"].add(found.camera[0].cx_px - truth.left.cx_px, found.sigma.centre_x_px[0]);
    (*all)["right cy"].add(found.camera[1].cy_px - truth.right.cy_px, found.sigma.centre_y_px[1]);
    (*all)["baseline"].add(calibration_baseline_mm(&found.rig) - calibration_baseline_mm(&truth),
                           found.sigma.baseline_mm);
    for (int i = 0; i < 3; i++) {
        (*all)["translation " + std::to_string(i)].add(
            found.rig.translation_right_left_mm[i] - truth.translation_right_left_mm[i],
            found.sigma.translation_mm[size_t(i)]);
    }
    const double pixels[3][2] = {{320, 240}, {120, 80}, {500, 400}};
    for (const double depth_mm : {500.0, 900.0, 1500.0}) {
        for (const double *pixel : {pixels[0], pixels[1], pixels[2]}) {
            double sigma_mm = 0;
            REQUIRE(found.errors->depth_sigma(pixel, depth_mm, &sigma_mm));
            (*all)["depth " + std::to_string(int(depth_mm)) + " at " +
                   std::to_string(int(pixel[0]))]
                .add(depth_error_mm(one.views, found, pixel, depth_mm), sigma_mm);
        }
    }
    add_projections(one, all);
}

}  // namespace

TEST_CASE("error bars contain the truth over 400 independent draws") {
    const int draws = synthetic::rounds(std::max(400, synthetic::draws(400)), 20);
    const bool many = draws >= 400;
    const uint64_t seed = synthetic::test_seed();
    std::vector<draw> made(static_cast<size_t>(draws));
    calib::parallel_pieces(2, draws, [&](int i) {
        // Ten draws of the noise for each scene.
        made[size_t(i)] =
            make_draw(small_rig(), seed + uint64_t(i / 10), seed + 5000 + uint64_t(i));
    });
    all_scores all;
    for (const draw &one : made) {
        REQUIRE(one.found.solved);
        CHECK(one.found.rejected_corners.empty());
        CHECK_FALSE(one.found.fit.alarm);
        add_draw(one, &all);
    }
    for (const auto &entry : all) {
        const auto &score = entry.second;
        INFO(entry.first, ": z rms ", score.rms(), ", 95 % covers ", score.covered());
        CHECK(score.rms() > (many ? 0.8 : 0.5));
        CHECK(score.rms() < (many ? 1.25 : 1.8));
        CHECK(score.covered() > (many ? 0.92 : 0.7));
        CHECK((score.covered() < 0.98 || !many));
    }
}

TEST_CASE("a lens outside all models raises the alarm and widens the error bars") {
    synthetic::RigViewsPlan plan = small_rig();
    plan.waves_px = 0.15;
    scores focal;
    for (int seed = 1; seed <= synthetic::rounds(12, 3); seed++) {
        INFO("seed ", seed);
        const draw one = make_draw(plan, uint64_t(seed), uint64_t(seed) + 70);
        CHECK(one.found.fit.alarm);
        CHECK(one.found.fit.widened > 1.2);
        CHECK(one.found.fit.systematic_px > 0.03);
        const calibration truth = one.views.truth();
        focal.add(one.found.camera[0].fx_px - truth.left.fx_px, one.found.sigma.focal_px[0]);
    }
    CHECK(focal.rms() < 2);
}

TEST_CASE("arguments must be in front of the cameras") {
    const draw one = make_draw(small_rig(), 1, 2);
    const double pixel[2] = {100, 100};
    double covariance[3], sigma_mm;
    CHECK_FALSE(one.found.errors->projection_covariance(0, pixel, -5, covariance));
    CHECK_FALSE(one.found.errors->depth_sigma(pixel, 0, &sigma_mm));
    CHECK_FALSE(one.found.errors->depth_sigma(pixel, INFINITY, &sigma_mm));
}
