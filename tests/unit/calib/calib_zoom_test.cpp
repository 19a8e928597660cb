// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "calib/zoom/zoom_check.hpp"
#include "calib/zoom/zoom_expected.hpp"
#include "calib/zoom/zoom_order.hpp"
#include "calib/zoom/zoom_solve.hpp"
#include "stereo/geometry/geometry.h"
#include "stereo/zoom/zoom_sigma.h"
#include "synthetic/rig_views.hpp"
#include "synthetic/seed.hpp"
#include "synthetic/zoom_views.hpp"

namespace {

using synthetic::Camera;
using synthetic::Vector;
using synthetic::ZoomMoment;

// Sums of squares; `rms` divides.
struct figures {
    double focal = 0, epipolar_px = 0, depth_mm = 0;
    int states = 0, points = 0;

    void add(const figures &other) {
        focal += other.focal;
        epipolar_px += other.epipolar_px;
        depth_mm += other.depth_mm;
        states += other.states;
        points += other.points;
    }
    figures rms() const {
        return {std::sqrt(focal / states), std::sqrt(epipolar_px / points),
                std::sqrt(depth_mm / points), 1, 1};
    }
};

// Both cameras at a zoom, as they are and as they were found, focused at 1.8 m.
struct both {
    Camera truth[2];
    zoom_state state;
    zoom_pair found;
};

both cameras_at(const synthetic::ZoomPlan &plan, const synthetic::ZoomViews &views,
                const calib::zoom_solution &solution, double zoom) {
    both result;
    zoom_state state{};
    for (int side = 0; side < 2; side++) {
        const synthetic::ZoomCamera &zoom_camera = views.rig.camera[side];
        ZoomMoment view_state{zoom, synthetic::focus_of(zoom_camera.lens, zoom, 1800),
                              synthetic::toe_in_rad(plan, side)};
        state.side[side].zoom_counts = view_state.zoom;
        state.side[side].focus_counts = view_state.focus;
        state.side[side].pan_rad = view_state.pan_rad;
        view_state.pan_rad += views.pan_off_rad[side];
        result.truth[side] = synthetic::camera_at(zoom_camera, view_state);
    }
    result.state = state;
    zoom_pair_at(solution.rig->camera, &state, &result.found);
    return result;
}

// The ray of a pixel in the instrument's frame.
void direction_of(const zoom_pair &pair, int side, const double pixel[2], double direction[3]) {
    double ray[3];
    REQUIRE(lens_ray(&pair.side[side].lens, pixel, ray));
    geometry_rotate(pair.side[side].R_instrument_camera, ray, direction);
}

// Points at 1.8 m that both cameras see, by the rays of the found cameras.
figures compare_points(const both &cameras, int count) {
    synthetic::Random random(7);
    figures sum;
    for (int attempt = 0; attempt < 10 * count && sum.points < count; attempt++) {
        const double left[2] = {random.uniform(5, 2042), random.uniform(5, 1530)};
        const Vector ray = cameras.truth[0].direction({left[0], left[1]});
        const Vector point = cameras.truth[0].centre_mm + (1800 / ray.z) * ray;
        const auto other = cameras.truth[1].project(point);
        if (!other || other->x < 5 || other->y < 5 || other->x > 2042 || other->y > 1530) {
            continue;
        }
        const double right[2] = {other->x, other->y};
        double a[3], b[3];
        direction_of(cameras.found, 0, left, a);
        direction_of(cameras.found, 1, right, b);
        geometry_midpoint met;
        REQUIRE(geometry_rays_midpoint(cameras.found.side[0].position_mm, a,
                                       cameras.found.side[1].position_mm, b, &met));
        // The miss as the right camera sees it.
        const double off_px = met.miss_mm / (met.t * geometry_norm(b)) * cameras.truth[1].fx;
        const double off_mm = met.point_mm[2] - point.z;
        sum.epipolar_px += off_px * off_px;
        sum.depth_mm += off_mm * off_mm;
        sum.points++;
    }
    return sum;
}

// Errors at zooms half way between those of the plan.
figures compare(const synthetic::ZoomPlan &plan, const synthetic::ZoomViews &views,
                const calib::zoom_solution &solution) {
    figures sum;
    const std::vector<double> &settings = solution.problem.side[0].settings;
    for (size_t k = 0; k + 1 < settings.size(); k++) {
        const both cameras =
            cameras_at(plan, views, solution, 0.5 * (settings[k] + settings[k + 1]));
        sum.add(compare_points(cameras, 400));
        double worse = 0;
        for (int side = 0; side < 2; side++) {
            worse = std::max(
                worse, std::fabs(cameras.found.side[side].lens.fx_px / cameras.truth[side].fx - 1));
        }
        sum.focal += worse * worse;
        sum.states++;
    }
    return sum;
}

// Standard scores of focal lengths and of depth in the middle of the image.
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

void focal_lengths(const zoom_pair *pair, void *, double *values) {
    values[0] = pair->side[0].lens.fx_px;
    values[1] = pair->side[1].lens.fx_px;
}

void score(const synthetic::ZoomPlan &plan, const synthetic::ZoomViews &views,
           const calib::zoom_solution &solution, scores *focal, scores *depth) {
    // The simulated prints are exact.
    solution.rig->scale_sigma = 0;
    const std::vector<double> &settings = solution.problem.side[0].settings;
    for (size_t k = 0; k + 1 < settings.size(); k++) {
        const double zoom = 0.5 * (settings[k] + settings[k + 1]);
        const both cameras = cameras_at(plan, views, solution, zoom);
        zoom_variance variance[2];
        zoom_propagate(solution.rig.get(), &cameras.state, focal_lengths, nullptr, 2, variance);
        for (int side = 0; side < 2; side++) {
            focal->add(cameras.found.side[side].lens.fx_px - cameras.truth[side].fx,
                       std::sqrt(zoom_variance_sum(&variance[side])));
        }
        const double middle[2] = {1023.5, 767.5};
        const Vector ray = cameras.truth[0].direction({middle[0], middle[1]});
        const Vector along = cameras.truth[0].R_camera_world * ray;
        const Vector point = cameras.truth[0].centre_mm + (1800 / along.z) * ray;
        const auto other = cameras.truth[1].project(point);
        if (!other) {
            continue;
        }
        const double right[2] = {other->x, other->y};
        double a[3], b[3], from_left[3], in_camera[3];
        direction_of(cameras.found, 0, middle, a);
        direction_of(cameras.found, 1, right, b);
        geometry_midpoint met;
        REQUIRE(geometry_rays_midpoint(cameras.found.side[0].position_mm, a,
                                       cameras.found.side[1].position_mm, b, &met));
        for (int i = 0; i < 3; i++) {
            from_left[i] = met.point_mm[i] - cameras.found.side[0].position_mm[i];
        }
        geometry_rotate_back(cameras.found.side[0].R_instrument_camera, from_left, in_camera);
        zoom_variance of_depth =
            zoom_depth_variance(solution.rig.get(), &cameras.state, middle, 1800);
        depth->add(in_camera[2] - 1800, std::sqrt(zoom_variance_sum(&of_depth)));
    }
}

}  // namespace

namespace {

// Solutions of several simulated rigs.
struct outcome {
    figures error;  // rms
    scores focal, depth;
    int wrong = 0, missed = 0, good = 0, rejected_good = 0;
};

bool is_named(const calib::zoom_solution &solution, const calib::zoom_observations &seen,
              const std::string &name, int index) {
    return std::any_of(solution.rejections.begin(), solution.rejections.end(),
                       [&](const calib::zoom_rejection &one) {
                           return seen.captures[one.capture].name[size_t(one.camera)] == name &&
                                  (one.index < 0 || one.index == index);
                       });
}

// Counts wrong pictures and corners that were not named, and good ones that were.
void count_named(const synthetic::ZoomViews &views, const calib::zoom_solution &solution,
                 outcome *result) {
    for (const std::string &name : views.wrong_views) {
        result->wrong++;
        result->missed += !is_named(solution, views.seen, name, -1);
    }
    for (const auto &[name, index] : views.wrong_corners) {
        result->wrong++;
        result->missed += !is_named(solution, views.seen, name, index);
    }
    for (const calib::zoom_rejection &one : solution.rejections) {
        const std::string &name = views.seen.captures[one.capture].name[size_t(one.camera)];
        const bool wrong_view =
            std::count(views.wrong_views.begin(), views.wrong_views.end(), name);
        const bool wrong_corner = std::any_of(
            views.wrong_corners.begin(), views.wrong_corners.end(),
            [&](const auto &corner) { return corner.first == name && corner.second == one.index; });
        result->rejected_good += !wrong_view && !wrong_corner;
    }
}

outcome solve_rigs(const char *what, const synthetic::ZoomPlan &plan, int rigs,
                   calib::zoom_options options = {}, uint64_t seed = synthetic::test_seed()) {
    options.leave_out = false;
    outcome result;
    figures all;
    for (int rig = 0; rig < rigs; rig++) {
        const uint64_t scene = seed + uint64_t(rig);
        INFO("scene seed " << scene << ", noise seed " << scene + 1000);
        const synthetic::ZoomViews views = synthetic::make_zoom_views(plan, scene, scene + 1000);
        const calib::zoom_solution solution = calib::solve_zoom(views.seen, options);
        REQUIRE(solution.failure == "");
        const figures error = compare(plan, views, solution);
        std::fprintf(stderr, "%s, seed %llu: f %.4f %%, epipolar %.4f px, depth %.3f mm\n", what,
                     static_cast<unsigned long long>(scene), 100 * error.rms().focal,
                     error.rms().epipolar_px, error.rms().depth_mm);
        all.add(error);
        if (!options.paper) {
            CHECK(solution.noise_ratio == doctest::Approx(1).epsilon(0.05));
            score(plan, views, solution, &result.focal, &result.depth);
        }
        count_named(views, solution, &result);
    }
    result.error = all.rms();
    std::printf("| %s, %d rigs from seed %llu | %.4f %% | %.4f px | %.3f mm |", what, rigs,
                static_cast<unsigned long long>(seed), 100 * result.error.focal,
                result.error.epipolar_px, result.error.depth_mm);
    if (result.wrong > 0) {
        std::printf(" %d wrong, %d not named; %d good ones rejected |", result.wrong, result.missed,
                    result.rejected_good);
    } else if (!options.paper) {
        std::printf(" z of f %.2f (%.0f %% within 95 %%), of depth %.2f (%.0f %%) |",
                    result.focal.rms(), 100 * result.focal.covered(), result.depth.rms(),
                    100 * result.depth.covered());
    }
    std::printf("\n");
    return result;
}

// Error bars agree with the errors. States of one rig are not independent, so it takes many rigs.
void check_scores(const scores &total) {
    if (total.count >= 400 && synthetic::draws(1) >= 40) {
        CHECK(total.rms() > 0.8);
        CHECK(total.rms() < 1.25);
        CHECK(total.covered() > 0.92);
    }
}

synthetic::ZoomPlan sweep(int boards) {
    synthetic::ZoomPlan plan;
    plan.boards = boards;
    plan.same_boards = plan.log_spaced = true;
    return plan;
}

}  // namespace

TEST_CASE("figures: 13 zooms, 12 board positions") {
    const outcome found = solve_rigs("13 x 12", sweep(12), synthetic::draws(1));
    CHECK(found.error.focal < 6e-4);
    CHECK(found.error.epipolar_px < 0.1);
    CHECK(found.error.depth_mm < 1);
    check_scores(found.focal);
    check_scores(found.depth);
}

TEST_CASE("figures: 13 zooms, 4 board positions") {
    const outcome found = solve_rigs("13 x 4", sweep(4), synthetic::draws(1));
    CHECK(found.error.epipolar_px < 0.2);
    CHECK(found.error.depth_mm < 2);
    check_scores(found.focal);
    check_scores(found.depth);
}

TEST_CASE("figures: each zoom alone, straight lines between") {
    calib::zoom_options options;
    options.paper = true;
    const outcome found =
        solve_rigs("each zoom alone, straight lines", {}, synthetic::draws(1), options);
    CHECK(found.error.focal > 5e-3);
    CHECK(found.error.epipolar_px > 0.5);
}

TEST_CASE("figures: wrong pictures and corners are named") {
    synthetic::ZoomPlan plan = sweep(12);
    plan.wrong_views = plan.wrong_corners = 0.05;
    // By default a rig with a setting that its one wrong picture may attract.
    const outcome found = solve_rigs("13 x 12, 5 % wrong", plan, synthetic::draws(1), {},
                                     synthetic::draws(1) > 1 ? synthetic::test_seed() : 1303);
    CHECK(found.wrong > 50);
    CHECK(found.missed == 0);
    CHECK(found.rejected_good == 0);
    CHECK(found.error.focal < 9e-4);
    CHECK(found.error.epipolar_px < 0.15);
    CHECK(found.error.depth_mm < 1.5);
}

TEST_CASE("the solver's cameras are those of the calibration that it writes") {
    synthetic::ZoomPlan plan;
    plan.zooms = 4;
    plan.boards = 5;
    const synthetic::ZoomViews views = synthetic::make_zoom_views(plan, 3, 4);
    const calib::zoom_solution solution = calib::solve_zoom(views.seen, {});
    REQUIRE(solution.failure == "");
    CHECK(solution.warnings.empty());
    CHECK(std::fabs(solution.rig->validation.chi_square_z) < 6);
    CHECK(solution.rig->validation.held_out_px > 0);
    CHECK(solution.rig->validation.held_out_px < 1);
    CHECK(solution.rig->validation.held_out_focal < 0.05);
    zoom_state state{};
    const ZoomMoment view_state[2] = {{431, 590, 0.05}, {577, 620, -0.09}};
    for (int side = 0; side < 2; side++) {
        state.side[side].zoom_counts = view_state[side].zoom;
        state.side[side].focus_counts = view_state[side].focus;
        state.side[side].pan_rad = view_state[side].pan_rad;
    }
    zoom_pair pair;
    zoom_pair_at(solution.rig->camera, &state, &pair);
    for (int side = 0; side < 2; side++) {
        const calib::posed_camera posed = calib::camera_at(
            solution.problem, solution.layout, solution.estimate.shared.data(),
            {side,
             -1,
             -1,
             {view_state[side].zoom, view_state[side].focus, view_state[side].pan_rad}},
            {});
        const lens lens =
            calib::lens_from_state(solution.problem.side[size_t(side)].frame, posed.lens);
        const calib::rigid back = calib::inverse(posed.T_camera_instrument);
        CHECK(pair.side[side].lens.fx_px == doctest::Approx(lens.fx_px).epsilon(1e-9));
        CHECK(pair.side[side].lens.cx_px == doctest::Approx(lens.cx_px).epsilon(1e-9));
        CHECK(pair.side[side].lens.cy_px == doctest::Approx(lens.cy_px).epsilon(1e-9));
        CHECK(pair.side[side].lens.k1 == doctest::Approx(lens.k1).epsilon(1e-9));
        CHECK(pair.side[side].lens.k2 == doctest::Approx(lens.k2).epsilon(1e-9));
        CHECK(pair.side[side].lens.p1 == doctest::Approx(lens.p1).epsilon(1e-9));
        CHECK(pair.side[side].lens.p2 == doctest::Approx(lens.p2).epsilon(1e-9));
        for (int i = 0; i < 9; i++) {
            CHECK(pair.side[side].R_instrument_camera[i] ==
                  doctest::Approx(back.R[i]).epsilon(1e-9));
        }
        for (int i = 0; i < 3; i++) {
            CHECK(std::fabs(pair.side[side].position_mm[i] - back.t_mm[i]) < 1e-7);
        }
    }
}

namespace {

// What the verdict says of a rig that was changed after it was solved.
template <class Change>
std::string verdict_of(const calib::zoom_solution &solution, const Change &change) {
    calib::zoom_solution changed = solution;
    changed.rig = std::make_shared<zoom_calibration>(*solution.rig);
    change(&changed);
    calib::check_rig(&changed);
    CHECK(changed.warnings.empty() == (calib::zoom_verdict(changed, {}).rfind("Good: ", 0) == 0));
    return calib::zoom_verdict(changed, {});
}

bool says(const std::string &text, const char *words) {
    INFO(text);
    return text.rfind("Not good: ", 0) == 0 && text.find(words) != std::string::npos;
}

}  // namespace

TEST_CASE("an implausible rig is not good, with the reason") {
    using solution = calib::zoom_solution;
    synthetic::ZoomPlan plan;
    plan.zooms = 4;
    plan.boards = 5;
    synthetic::ZoomViews views = synthetic::make_zoom_views(plan, 3, 4);
    calib::zoom_options options;
    options.leave_out = false;
    const solution good = calib::solve_zoom(views.seen, options);
    REQUIRE(good.failure == "");
    INFO(calib::zoom_verdict(good, {}));
    CHECK(good.warnings.empty());
    CHECK(verdict_of(good, [](solution *) {}).rfind("Good: ", 0) == 0);
    const auto position = [](solution *rig, int i) -> double & {
        return rig->rig->camera[1].mount[ZOOM_POSITION_X + i];
    };
    CHECK(says(verdict_of(good, [&](solution *rig) { position(rig, 0) = 1e6; }), "impossible"));
    CHECK(says(verdict_of(good, [&](solution *rig) { position(rig, 0) = 0; }), "too similar"));
    CHECK(says(verdict_of(good, [](solution *rig) { rig->covariance.shared *= 1e8; }),
               "too few or too similar positions"));
    CHECK(says(
        verdict_of(good, [](solution *rig) { rig->rig->camera[0].mount[ZOOM_PAN_SCALE] = -0.44; }),
        "left servo"));
    CHECK(says(verdict_of(good,
                          [](solution *rig) {
                              const int turn = rig->layout.mount_at(1, ZOOM_ROTATION_Z);
                              rig->estimate.shared[size_t(turn)] += 1.57;
                          }),
               "degrees"));
    CHECK(says(
        verdict_of(good,
                   [](solution *rig) { rig->rig->camera[1].function[ZOOM_FOCAL].term[2] += 1e5; }),
        "right camera does not follow"));
    for (calib::capture &capture : views.seen.captures) {
        std::swap(capture.view[0], capture.view[1]);
        std::swap(capture.axes[0], capture.axes[1]);
        std::swap(capture.name[0], capture.name[1]);
    }
    const solution exchanged = calib::solve_zoom(views.seen, options);
    REQUIRE(exchanged.failure == "");
    REQUIRE(!exchanged.warnings.empty());
    CHECK(exchanged.warnings[0].find("left and right are exchanged") != std::string::npos);
}

TEST_CASE("what pictures add is expected to reduce what the motors leave") {
    synthetic::ZoomPlan plan;
    plan.zooms = 4;
    plan.boards = 5;
    const synthetic::ZoomViews views = synthetic::make_zoom_views(plan, 3, 4);
    calib::zoom_options options;
    options.leave_out = false;
    const calib::zoom_solution solution = calib::solve_zoom(views.seen, options);
    REQUIRE(solution.failure == "");
    const double distance_mm = calib::board_distance_mm(solution);
    const zoom_state state = calib::zoom_aimed(*solution.rig, 0, distance_mm);
    const calib::zoom_expected expected =
        calib::expect_zoom(*solution.rig, state, calib::zoom_again(*solution.rig, state, 1),
                           views.seen.boards[0], distance_mm);
    const double middle[2] = {1023.5, 767.5};
    const zoom_variance variance =
        zoom_depth_variance(solution.rig.get(), &state, middle, distance_mm);
    CHECK(expected.read.depth_mm ==
          doctest::Approx(std::sqrt(zoom_variance_sum(&variance))).epsilon(0.05));
    CHECK(expected.own.depth_mm < 0.7 * expected.read.depth_mm);
    CHECK(expected.second.depth_mm < 0.7 * expected.own.depth_mm);
    CHECK(expected.board.depth_mm < 0.3 * expected.own.depth_mm);
    CHECK(expected.board.length_mm < 0.3 * expected.own.length_mm);
    // A point that the right camera does not see.
    zoom_state apart = state;
    apart.side[1].pan_rad = 1.5;
    CHECK(calib::expect_zoom(*solution.rig, apart, apart, views.seen.boards[0], distance_mm)
              .read.depth_mm == 0);
}

TEST_CASE("a board nearer than the lens can focus does not say where it was focused") {
    synthetic::ZoomPlan plan = sweep(3);
    plan.zooms = 4;
    const synthetic::ZoomViews views = synthetic::make_zoom_views(plan, 3, 4);
    calib::zoom_problem problem;
    REQUIRE(calib::make_problem(views.seen, &problem) == "");
    problem.side[0].log_focal = {7.9, 10.2};
    const calib::zoom_layout layout(problem, calib::richest_orders(problem));
    calib::posed_camera posed;
    posed.focal_px = 5000;
    int near = 0, focused = 0;
    for (size_t i = 0; i < problem.captures.size(); i++) {
        const bool says = !calib::focus_row_of(problem, layout, i, 0, posed, {}).columns.empty();
        const bool at_stop = problem.captures[i].axes[0].focus_counts >= 850;
        CHECK_FALSE((at_stop && says));
        near += at_stop;
        focused += says;
    }
    CHECK(near > 0);
    CHECK(focused > 0);
}

TEST_CASE("the focus is what pictures say, not a scale that is off") {
    synthetic::ZoomPlan plan = sweep(6);
    plan.zooms = 6;
    plan.scale_error = 0.04;
    synthetic::ZoomViews views = synthetic::make_zoom_views(plan, 3, 4);
    calib::zoom_options options;
    options.leave_out = false;
    // Most error of 1 / distance over the zoom at what is in focus at 1.8 m, 1/m.
    const auto error_per_m = [&] {
        const calib::zoom_solution solution = calib::solve_zoom(views.seen, options);
        REQUIRE(solution.failure == "");
        double most = 0;
        for (const double zoom : {400.0, 550.0, 700.0, 840.0}) {
            const both cameras = cameras_at(plan, views, solution, zoom);
            for (const auto &side : cameras.found.side) {
                most = std::fmax(most, std::fabs(side.focus_dioptre - 1 / 1.8));
            }
        }
        return most;
    };
    CHECK(error_per_m() < 0.008);
    for (calib::capture &capture : views.seen.captures) {
        capture.focused = false;
    }
    CHECK(error_per_m() > 0.008);
}

TEST_CASE("no corner counts as better than what a detector's errors have in common") {
    synthetic::ZoomPlan plan = sweep(1);
    plan.zooms = 1;
    plan.noise_px = 0.005;
    calib::zoom_problem problem;
    REQUIRE(calib::make_problem(synthetic::make_zoom_views(plan, 3, 4).seen, &problem) == "");
    REQUIRE(!problem.captures.empty());
    for (const calib::bundle_corner &corner : problem.captures[0].view[0].corners) {
        CHECK(corner.sigma_px == 0.03);
    }
}
