// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/adjustment.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "measure/zoom_expect.h"
#include "random_rig.hpp"
#include "stereo/zoom/zoom_aim.h"
#include "synthetic/seed.hpp"
#include "synthetic/zoom_rig.hpp"

namespace {

using random_rig::Random;
using random_rig::uniform;
using synthetic::Camera;
using synthetic::operator*;
using synthetic::transpose;
using synthetic::Vector;

double normal(Random &random) {
    return std::sqrt(-2 * std::log(uniform(random, 1e-12, 1))) *
           std::cos(2 * M_PI * uniform(random, 0, 1));
}

bool see(const Camera &camera, const Vector &point, double px[2]) {
    const auto pixel = camera.project(point);
    REQUIRE(pixel);
    px[0] = pixel->x;
    px[1] = pixel->y;
    return px[0] > 0 && px[0] < 2047 && px[1] > 0 && px[1] < 1535;
}

struct Memory {
    std::vector<unsigned char> bytes;
    arena pool = {};
    explicit Memory(size_t size) : bytes(size) { arena_init(&pool, bytes.data(), size); }
};

struct Truth {
    Camera camera[2];
};

// Where the cameras are in truth, if the motors are off by random amounts.
Truth off(const zoom_calibration &calibration, const zoom_state &claimed, Random &random) {
    Truth truth = {};
    for (int side = 0; side < 2; side++) {
        const zoom_camera &camera = calibration.camera[side];
        const auto &at = claimed.side[side];
        const double counts = std::hypot(camera.reading_sigma_counts, camera.drift_sigma_counts);
        truth.camera[side] =
            zoom_rig::camera_at(side, at.zoom_counts + counts * normal(random),
                                at.focus_counts + counts * normal(random),
                                at.pan_rad + camera.pan_sigma_rad * normal(random), true);
    }
    return truth;
}

// Tracks of points with relief in front of both cameras, with noise.
std::vector<adjust_track> observe(const Truth &truth, double noise_px, int count, Random &random) {
    std::vector<adjust_track> tracks;
    const double half_mm = 900 * 1024 / truth.camera[0].fx;
    while (static_cast<int>(tracks.size()) < count) {
        const double x = 125 + uniform(random, -2, 2) * half_mm;
        const double y = uniform(random, -1.5, 1.5) * half_mm;
        const Vector point{x, y, uniform(random, 1650, 1950)};
        adjust_track track = {};
        track.count = 2;
        track.view[1] = 1;
        track.sigma_px = noise_px;
        if (see(truth.camera[0], point, track.pixel_px[0]) &&
            see(truth.camera[1], point, track.pixel_px[1])) {
            for (int i = 0; i < 4; i++) {
                track.pixel_px[i / 2][i % 2] += noise_px * normal(random);
            }
            tracks.push_back(track);
        }
    }
    return tracks;
}

// Depth error in mm of views at the point 1800 mm in front of the left camera.
double depth_error(const Truth &truth, const camera_view view[2]) {
    const Camera &left = truth.camera[0];
    const Vector point = left.centre_mm + transpose(left.R_camera_world) * Vector{0, 0, 1800};
    double px[2][2];
    (void)see(left, point, px[0]);
    (void)see(truth.camera[1], point, px[1]);
    double ray[2][3], seen[3], offset[3];
    geometry_midpoint middle;
    REQUIRE(camera_view_ray(&view[0], px[0], ray[0]));
    REQUIRE(camera_view_ray(&view[1], px[1], ray[1]));
    REQUIRE(
        geometry_rays_midpoint(view[0].position_mm, ray[0], view[1].position_mm, ray[1], &middle));
    for (int i = 0; i < 3; i++) {
        offset[i] = middle.point_mm[i] - view[0].position_mm[i];
    }
    geometry_rotate_back(view[0].R_instrument_camera, offset, seen);
    return seen[2] - 1800;
}

TEST_CASE("a view without correction is the calibration's, and sees what the equations say") {
    Random random(synthetic::test_seed());
    const auto calibration = zoom_rig::calibration();
    Memory memory(adjustment_need_bytes(1));
    for (const double zoom : {300.0, 500.0, 850.0}) {
        const zoom_state state = zoom_rig::state(zoom, 1800);
        memory.pool.used_bytes = 0;
        adjustment adjustment;
        REQUIRE(adjustment_begin(calibration.get(), &state, 1, &memory.pool, &adjustment) == 0);
        for (int side = 0; side < 2; side++) {
            const auto truth = zoom_rig::camera_at(side, zoom, state.side[side].focus_counts,
                                                   state.side[side].pan_rad, false);
            far_point point = {{10, -5, 3}, 0.02, -0.01, 1 / 1700.0};
            const Vector world{10 + 0.02 * 1700, -5 - 0.01 * 1700, 3 + 1700};
            double expected[2], px[2];
            (void)see(truth, world, expected);
            REQUIRE(camera_view_project(&adjustment.view[side], &point, px, nullptr, nullptr));
            // The fitted curves differ from the formulas by less than this.
            CHECK(std::abs(px[0] - expected[0]) < 0.15);
            CHECK(std::abs(px[1] - expected[1]) < 0.15);
        }
    }
}

TEST_CASE("the derivatives of a projection are those of small corrections") {
    const auto calibration = zoom_rig::calibration();
    for (const double zoom : {300.0, 850.0}) {
        const zoom_state state = zoom_rig::state(zoom, 1800);
        Memory memory(adjustment_need_bytes(1));
        adjustment adjustment;
        REQUIRE(adjustment_begin(calibration.get(), &state, 1, &memory.pool, &adjustment) == 0);
        const camera_view &view = adjustment.view[0];
        const double corner[2] = {1800, 1300};
        double ray[3], px[2], of_view[2][VIEW_TERMS], of_point[2][3];
        REQUIRE(camera_view_ray(&view, corner, ray));
        const far_point point = {{1, 2, 3}, ray[0] / ray[2], ray[1] / ray[2], 1 / 1500.0};
        REQUIRE(camera_view_project(&view, &point, px, of_view, of_point));
        for (int term = 0; term < VIEW_TERMS; term++) {
            const double step =
                term == VIEW_FOCAL || (term >= VIEW_ROTATION_X && term <= VIEW_ROTATION_Z) ? 1e-6
                                                                                           : 1e-3;
            double moved[2][2];
            for (int sign = 0; sign < 2; sign++) {
                double correction[VIEW_TERMS] = {};
                correction[term] = sign == 0 ? -step : step;
                camera_view corrected;
                camera_view_correct(&view, correction, &corrected);
                REQUIRE(camera_view_project(&corrected, &point, moved[sign], nullptr, nullptr));
                double back[VIEW_TERMS];
                camera_view_difference(&corrected, &view, back);
                CHECK(back[term] == doctest::Approx(correction[term]).epsilon(1e-6));
            }
            for (int i = 0; i < 2; i++) {
                const double slope = (moved[1][i] - moved[0][i]) / (2 * step);
                CAPTURE(term);
                CHECK(of_view[i][term] == doctest::Approx(slope).epsilon(1e-3).scale(1));
            }
        }
    }
}

// What was expected beforehand of a pair like that, mm at 1800 mm.
zoom_expect expected(const zoom_calibration &calibration, const zoom_state &state,
                     const zoom_state *other, int matches, double match_px, int columns, int rows,
                     double square_mm) {
    zoom_expect_request request = {};
    request.state = state;
    request.other = other;
    zoom_point_ahead(&calibration, 1800, 0, request.point_mm);
    request.near_mm = 1650;
    request.far_mm = 1950;
    request.matches = matches;
    request.match_px = match_px;
    request.columns = columns;
    request.rows = rows;
    request.square_mm = square_mm;
    Memory memory(zoom_expect_need_bytes());
    zoom_expect expect;
    REQUIRE(zoom_expect_at(&calibration, nullptr, &request, &memory.pool, &expect) == ERROR_OK);
    return expect;
}

// Points, and where the board is, are other ones.
void check_near(double expected_mm, double sigma_mm) {
    CAPTURE(sigma_mm);
    CHECK(expected_mm > 0.7 * sigma_mm);
    CHECK(expected_mm < 1.4 * sigma_mm);
}

TEST_CASE("a pair brings rows together, and its error agrees with the predicted sigma") {
    Random random(synthetic::test_seed());
    const auto calibration = zoom_rig::calibration();
    const int draws = synthetic::rounds(60, 3);
    for (const double zoom : {300.0, 422.0, 850.0}) {
        const zoom_state state = zoom_rig::state(zoom, 1800);
        const zoom_expect expect = expected(*calibration, state, nullptr, 300, 0.1, 0, 0, 0);
        CHECK(expect.other_mm < 0);
        CHECK(expect.board_mm < 0);
        double square = 0, before = 0, after = 0;
        for (int draw = 0; draw < draws; draw++) {
            Memory memory(adjustment_need_bytes(1));
            adjustment adjustment;
            REQUIRE(adjustment_begin(calibration.get(), &state, 1, &memory.pool, &adjustment) == 0);
            const Truth truth = off(*calibration, state, random);
            std::vector<adjust_track> tracks = observe(truth, 0.1, 300, random);
            const double error_before = depth_error(truth, adjustment.view);
            CHECK(adjustment_solve(&adjustment, tracks.data(), 300) == 300);
            double rows = 0;
            for (const adjust_track &track : tracks) {
                rows += track.residual * track.residual / 300;
            }
            CHECK(std::sqrt(rows) < 0.115);
            const double centre[2] = {1030, 766};
            double gradient[ADJUST_TERMS_MAX];
            REQUIRE(adjustment_depth_gradient(&adjustment, 0, centre, 1800, gradient));
            const double sigma = adjust_posterior_sigma(&adjustment, gradient);
            CHECK(sigma <= adjust_prior_sigma(&adjustment, gradient) * 1.0001);
            const double scale = 1800 * calibration->scale_sigma;
            check_near(expect.alone_mm, std::hypot(sigma, scale));
            const double error = depth_error(truth, adjustment.view);
            square += error * error / (sigma * sigma) / draws;
            before += error_before * error_before / draws;
            after += error * error / draws;
        }
        CAPTURE(zoom);
        if (draws >= 60) {
            CHECK(after < 0.6 * before);
            // The mount and lens of this draw are the calibration's own: less error than predicted.
            CHECK(std::sqrt(square) < 1.25);
        }
    }
}

TEST_CASE("only a camera that was pushed is a surprise") {
    const auto calibration = zoom_rig::calibration();
    Random random(synthetic::test_seed());
    const zoom_state state = zoom_rig::state(600, 1800);
    zoom_state pushed = state;
    pushed.side[0].pan_rad += 20 * calibration->camera[0].pan_sigma_rad;
    for (const bool was_pushed : {false, true}) {
        Memory memory(adjustment_need_bytes(1));
        adjustment adjustment;
        REQUIRE(adjustment_begin(calibration.get(), &state, 1, &memory.pool, &adjustment) == 0);
        CHECK(adjust_chi_square_score(&adjustment) == 0);
        CHECK(adjust_birge_ratio(&adjustment) == 1);
        std::vector<adjust_track> tracks =
            observe(off(*calibration, was_pushed ? pushed : state, random), 0.1, 400, random);
        (void)adjustment_solve(&adjustment, tracks.data(), 400);
        CHECK((adjust_chi_square_score(&adjustment) > 4) == was_pushed);
        CHECK((adjust_birge_ratio(&adjustment) > 2) == was_pushed);
    }
}

TEST_CASE("a servo that creeps moves between states, and tilts") {
    const auto calibration = zoom_rig::calibration();
    const zoom_state states[2] = {zoom_rig::state(310, 1800), zoom_rig::state(840, 1800)};
    for (const double creep_rad : {0.0, 1e-3}) {
        for (zoom_camera &camera : calibration->camera) {
            camera.creep_sigma_rad = creep_rad;
        }
        Memory memory(adjustment_need_bytes(2));
        adjustment adjustment;
        REQUIRE(adjustment_begin(calibration.get(), states, 2, &memory.pool, &adjustment) == 0);
        double turn[ADJUST_TERMS_MAX] = {}, tilt[ADJUST_TERMS_MAX] = {};
        turn[VIEW_TERMS * adjust_view(0, 0) + VIEW_ROTATION_Y] = -1;
        turn[VIEW_TERMS * adjust_view(1, 0) + VIEW_ROTATION_Y] = 1;
        tilt[VIEW_TERMS * adjust_view(0, 1) + VIEW_ROTATION_X] = 1;
        const double turned = adjust_prior_sigma(&adjustment, turn),
                     tilted = adjust_prior_sigma(&adjustment, tilt);
        CHECK(std::fabs(turned - std::sqrt(2) * creep_rad) < 1e-5);
        CHECK(tilted > creep_rad);
        CHECK(tilted < creep_rad + 2e-4);
    }
}

TEST_CASE("a pair shows the ratio of the focal lengths, not what both have in common") {
    const auto calibration = zoom_rig::calibration();
    Random random(synthetic::test_seed());
    const zoom_state state = zoom_rig::state(600, 1800);
    Memory memory(adjustment_need_bytes(1));
    adjustment adjustment;
    REQUIRE(adjustment_begin(calibration.get(), &state, 1, &memory.pool, &adjustment) == 0);
    std::vector<adjust_track> tracks = observe(off(*calibration, state, random), 0.1, 400, random);
    (void)adjustment_solve(&adjustment, tracks.data(), 400);
    double gradient[ADJUST_TERMS_MAX] = {};
    gradient[VIEW_FOCAL] = gradient[VIEW_TERMS + VIEW_FOCAL] = 0.5;
    CHECK(adjust_posterior_sigma(&adjustment, gradient) >
          0.8 * adjust_prior_sigma(&adjustment, gradient));
    gradient[VIEW_FOCAL] = -1;
    gradient[VIEW_TERMS + VIEW_FOCAL] = 1;
    CHECK(adjust_posterior_sigma(&adjustment, gradient) <
          0.3 * adjust_prior_sigma(&adjustment, gradient));
}

// Corners of a board that stands askew before the cameras, as both see them.
struct Board {
    std::vector<std::array<double, 3>> points;
    std::vector<target_observation> observations;
    adjust_target target = {};

    Board(const Truth &truth, int columns, int rows, double square_mm, double noise_px,
          Random &random) {
        const double c = std::cos(0.4), s = std::sin(0.4);
        for (int i = 0; i < columns * rows; i++) {
            const double x = (i % columns) * square_mm, y = (i / columns) * square_mm;
            points.push_back({x, y, 0});
            const Vector world{100 + c * x, -30 + y, 1790 + s * x};
            for (int side = 0; side < 2; side++) {
                target_observation observation = {side, i, {}};
                if (see(truth.camera[side], world, observation.pixel_px)) {
                    for (double &pixel : observation.pixel_px) {
                        pixel += noise_px * normal(random);
                    }
                    observations.push_back(observation);
                }
            }
        }
        target.points = static_cast<int>(points.size());
        target.observations = static_cast<int>(observations.size());
        target.point_mm = reinterpret_cast<const double(*)[3]>(points.data());
        target.observation = observations.data();
        target.sigma_px = noise_px;
    }
};

TEST_CASE("a known length in view gives the depth, as well as predicted") {
    Random random(synthetic::test_seed());
    const auto calibration = zoom_rig::calibration();
    const int draws = synthetic::rounds(30, 2);
    struct Case {
        double zoom;
        int columns, rows;
        double square_mm, limit_mm;
    };
    // Boards, and two marks 200 mm apart. Limits leave room for three sigmas of 30 draws.
    for (const Case &one : {Case{300, 10, 7, 24, 3.3}, Case{422, 10, 7, 24, 2.9},
                            Case{840, 5, 4, 20, 2.0}, Case{422, 2, 1, 200, 8}}) {
        const zoom_state state = zoom_rig::state(one.zoom, 1800);
        const zoom_expect expect =
            expected(*calibration, state, nullptr, 300, 0.1, one.columns, one.rows, one.square_mm);
        double square = 0, error2 = 0;
        for (int draw = 0; draw < draws; draw++) {
            Memory memory(adjustment_need_bytes(1));
            adjustment adjustment;
            REQUIRE(adjustment_begin(calibration.get(), &state, 1, &memory.pool, &adjustment) == 0);
            const Truth truth = off(*calibration, state, random);
            std::vector<adjust_track> tracks = observe(truth, 0.1, 300, random);
            REQUIRE(adjustment_solve(&adjustment, tracks.data(), 300) == 300);
            Board board(truth, one.columns, one.rows, one.square_mm, 0.05, random);
            REQUIRE(adjust_target_place(adjustment.view, &board.target));
            adjustment.target = &board.target;
            REQUIRE(adjustment_solve(&adjustment, tracks.data(), 300) == 300);
            const double centre[2] = {1030, 766};
            double gradient[ADJUST_TERMS_MAX];
            REQUIRE(adjustment_depth_gradient(&adjustment, 0, centre, 1800, gradient));
            const double sigma = adjust_posterior_sigma(&adjustment, gradient);
            const double scale = 1800 * calibration->scale_sigma;
            check_near(expect.board_mm, std::hypot(sigma, scale));
            const double error = depth_error(truth, adjustment.view);
            square += error * error / (sigma * sigma) / draws;
            error2 += error * error / draws;
        }
        CAPTURE(one.zoom);
        CAPTURE(one.columns);
        if (draws >= 30) {
            CHECK(std::sqrt(error2) < one.limit_mm);
            CHECK(std::sqrt(square) < 1.3);
            CHECK(std::sqrt(square) > 0.4);
        }
    }
}

TEST_CASE("a thing at infinity gives the depth, as well as predicted") {
    Random random(synthetic::test_seed());
    const auto calibration = zoom_rig::calibration();
    const int draws = synthetic::rounds(30, 2);
    for (const double zoom : {320.0, 600.0, 840.0}) {
        zoom_state state = zoom_rig::state(zoom, 1800);
        // Toed in, tele lenses would not share anything far away.
        state.side[0].pan_rad = state.side[1].pan_rad = 0;
        double square = 0, before = 0, after = 0;
        for (int draw = 0; draw < draws; draw++) {
            Memory memory(adjustment_need_bytes(1));
            adjustment adjustment;
            REQUIRE(adjustment_begin(calibration.get(), &state, 1, &memory.pool, &adjustment) == 0);
            const Truth truth = off(*calibration, state, random);
            adjust_track far = {};
            far.count = 2;
            far.view[1] = 1;
            far.sigma_px = 0.5;
            far.at_infinity = true;
            const Vector point{1e7 * 0.01, -1e7 * 0.005, 1e7};
            for (int side = 0; side < 2; side++) {
                REQUIRE(see(truth.camera[side], point, far.pixel_px[side]));
                far.pixel_px[side][0] += 0.5 * normal(random);
                far.pixel_px[side][1] += 0.5 * normal(random);
            }
            const double centre[2] = {1024, 768};
            double gradient[ADJUST_TERMS_MAX];
            REQUIRE(adjustment_depth_gradient(&adjustment, 0, centre, 5000, gradient));
            before = adjust_prior_sigma(&adjustment, gradient);
            REQUIRE(adjustment_solve(&adjustment, &far, 1) == 1);
            after = adjust_posterior_sigma(&adjustment, gradient);
            // What remains of the direction between both rays, against what is predicted.
            double turn[ADJUST_TERMS_MAX] = {};
            turn[VIEW_ROTATION_Y] = -1;
            turn[VIEW_TERMS + VIEW_ROTATION_Y] = 1;
            double offset = 0;
            const double *R[2] = {adjustment.view[0].R_instrument_camera,
                                  adjustment.view[1].R_instrument_camera};
            // The third column of R_world_camera.
            const auto &T = truth.camera;
            offset = (std::atan2(T[1].R_camera_world[6], T[1].R_camera_world[8]) -
                      std::atan2(T[0].R_camera_world[6], T[0].R_camera_world[8])) -
                     (std::atan2(R[1][2], R[1][8]) - std::atan2(R[0][2], R[0][8]));
            const double sigma = adjust_posterior_sigma(&adjustment, turn);
            square += offset * offset / (sigma * sigma) / draws;
        }
        CAPTURE(zoom);
        CHECK(after < 0.2 * before);
        if (draws >= 30) {
            CHECK(std::sqrt(square) < 1.4);
            CHECK(std::sqrt(square) > 0.4);
        }
    }
}

TEST_CASE("a wide and a tele pair show where the rings are, and carries pan from wide to tele") {
    Random random(synthetic::test_seed());
    const auto calibration = zoom_rig::calibration();
    const int draws = synthetic::rounds(30, 2);
    double error2[2] = {}, focal2[2] = {}, square = 0;
    const zoom_state wide = zoom_rig::state(320, 1800);
    const zoom_expect expect =
        expected(*calibration, zoom_rig::state(830, 1800), &wide, 300, 0.05, 0, 0, 0);
    for (int draw = 0; draw < draws; draw++) {
        const zoom_state claimed[2] = {zoom_rig::state(320, 1800), zoom_rig::state(830, 1800)};
        double drift[2][2], pan[2];
        for (int side = 0; side < 2; side++) {
            drift[side][0] = normal(random);
            drift[side][1] = normal(random);
            pan[side] = calibration->camera[side].pan_sigma_rad * normal(random);
        }
        Truth truth[2] = {};
        for (int state = 0; state < 2; state++) {
            for (int side = 0; side < 2; side++) {
                const auto &at = claimed[state].side[side];
                truth[state].camera[side] = zoom_rig::camera_at(
                    side, at.zoom_counts + drift[side][0] + 0.25 * normal(random),
                    at.focus_counts + drift[side][1] + 0.25 * normal(random),
                    at.pan_rad + pan[side], true);
            }
        }
        Memory memory(adjustment_need_bytes(2));
        adjustment adjustment;
        REQUIRE(adjustment_begin(calibration.get(), claimed, 2, &memory.pool, &adjustment) == 0);
        std::vector<adjust_track> tracks = observe(truth[0], 0.05, 600, random);
        std::vector<adjust_track> tele = observe(truth[1], 0.05, 300, random);
        for (adjust_track &track : tele) {
            track.view[0] = adjust_view(1, 0);
            track.view[1] = adjust_view(1, 1);
        }
        tracks.insert(tracks.end(), tele.begin(), tele.end());
        // Points of the tele pair that the wide cameras see, too.
        while (tracks.size() < 1000) {
            const Vector point{125 + uniform(random, -60, 60), uniform(random, -45, 45),
                               uniform(random, 1750, 1850)};
            adjust_track track = {};
            track.count = 4;
            track.sigma_px = 0.07;
            bool seen = true;
            for (int i = 0; i < 4; i++) {
                track.view[i] = adjust_view(i < 2 ? 1 : 0, i % 2);
                seen = seen && see(truth[i < 2 ? 1 : 0].camera[i % 2], point, track.pixel_px[i]);
                track.pixel_px[i][0] += 0.07 * normal(random);
                track.pixel_px[i][1] += 0.07 * normal(random);
            }
            if (seen) {
                tracks.push_back(track);
            }
        }
        (void)adjustment_solve(&adjustment, tracks.data(), static_cast<int>(tracks.size()));
        for (int state = 0; state < 2; state++) {
            const double error = depth_error(truth[state], adjustment.view + 2 * state);
            const double focal =
                adjustment.view[2 * state].lens.fx_px / truth[state].camera[0].fx - 1;
            error2[state] += error * error / draws;
            focal2[state] += focal * focal / draws;
        }
        const double centre[2] = {1025, 768};
        double gradient[ADJUST_TERMS_MAX];
        REQUIRE(adjustment_depth_gradient(&adjustment, 1, centre, 1800, gradient));
        const double error = depth_error(truth[1], adjustment.view + 2);
        const double sigma = adjust_posterior_sigma(&adjustment, gradient);
        check_near(expect.other_mm, std::hypot(sigma, 1800 * calibration->scale_sigma));
        square += error * error / (sigma * sigma) / draws;
    }
    if (draws >= 30) {
        CHECK(std::sqrt(focal2[0]) < 2e-3);
        CHECK(std::sqrt(error2[0]) < 5.5);
        CHECK(std::sqrt(error2[1]) < 5.5);
        CHECK(std::sqrt(square) < 1.3);
    }
}

TEST_CASE("too little memory is reported") {
    const auto calibration = zoom_rig::calibration();
    const zoom_state state = zoom_rig::state(600, 1800);
    Memory memory(adjustment_need_bytes(1) - 1000);
    adjustment adjustment;
    CHECK(adjustment_begin(calibration.get(), &state, 1, &memory.pool, &adjustment) < 0);
}

}  // namespace
