// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "calib/bundle/bundle.hpp"
#include "stereo/geometry/geometry.h"
#include "stereo/geometry/lens.h"
#include "synthetic/scene.hpp"
#include "synthetic/seed.hpp"

namespace {

using calib::LEFT;
using calib::RIGHT;

const int WIDTH = 1280, HEIGHT = 960;

calib::lens_state random_lens(synthetic::Random &random, double focal_px) {
    calib::lens_state state;
    auto &q = state.value;
    q[calib::LOG_FOCAL] = std::log(focal_px);
    q[calib::LOG_ASPECT] = random.uniform(-0.02, 0.02);
    for (const int place :
         {calib::CENTRE_X, calib::CENTRE_Y, calib::RADIAL_2, calib::RADIAL_4, calib::RADIAL_6}) {
        q[size_t(place)] = random.uniform(-20, 20);
    }
    q[calib::TANGENTIAL_1] = random.uniform(-2, 2);
    q[calib::TANGENTIAL_2] = random.uniform(-2, 2);
    return state;
}

// A rig in front of one board; corners are displaced by some pixels.
struct scene {
    calib::bundle data;
    calib::bundle_state state;
};

scene random_scene(uint64_t seed, double focal_px) {
    synthetic::Random random(seed);
    scene result;
    calib::board board;
    board.columns = 7;
    board.rows = 5;
    board.square_mm = 20;
    result.data.points = calib::make_board_points(board, result.data.half_mm);
    const double distance_mm = 0.25 * focal_px;
    for (int camera = 0; camera < 2; camera++) {
        result.data.frame[camera] = calib::make_lens_frame(WIDTH, HEIGHT);
        result.state.lens[camera] = random_lens(random, focal_px);
    }
    const double turn[3] = {random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5),
                            random.uniform(-3, 3)};
    result.state.T_left_board.push_back(calib::turned({}, turn));
    double *t = result.state.T_left_board[0].t_mm;
    t[0] = random.uniform(-20, 20);
    t[1] = random.uniform(-20, 20);
    t[2] = distance_mm;
    const double rig_turn[3] = {0.02, -0.05, 0.01};
    result.state.T_right_left = calib::turned({}, rig_turn);
    result.state.T_right_left.t_mm[0] = -0.05 * distance_mm;
    result.state.warp_mm[0] = 0.5;
    result.state.warp_mm[1] = -0.3;
    result.state.warp_mm[2] = 0.2;
    result.state.warp_mm[3] = 0.4;
    result.data.captures.emplace_back();
    for (int camera = 0; camera < 2; camera++) {
        calib::bundle_view &view = result.data.captures[0][size_t(camera)];
        view.used = true;
        for (int index = 0; index < board.corner_count(); index++) {
            calib::bundle_corner corner{index, 0, 0, 0.1, true};
            double residual[2];
            REQUIRE(calib::corner_residual(result.data, camera, corner, result.state,
                                           result.state.T_left_board[0], residual));
            corner.x_px = residual[0] + random.normal();
            corner.y_px = residual[1] + random.normal();
            view.corners.push_back(corner);
        }
    }
    return result;
}

// Residual of one corner after one parameter was changed.
std::array<double, 2> moved_residual(const scene &from, int camera, size_t corner, int kind,
                                     int place, double step) {
    calib::bundle_state state = from.state;
    double increment[calib::POSE_PARAMETERS] = {0, 0, 0, 0, 0, 0};
    if (kind == 0) {
        state.lens[camera].value[size_t(place)] += step;
    } else if (kind == 1) {
        increment[place] = step;
        state.T_left_board[0] = calib::moved_board(state.T_left_board[0], increment);
    } else if (kind == 2) {
        increment[place] = step;
        state.T_right_left = calib::moved_rig(state.T_right_left, increment);
    } else {
        state.warp_mm[place] += step;
    }
    std::array<double, 2> residual;
    REQUIRE(calib::corner_residual(from.data, camera,
                                   from.data.captures[0][size_t(camera)].corners[corner], state,
                                   state.T_left_board[0], residual.data()));
    return residual;
}

}  // namespace

TEST_CASE("the solver's lens is the core's in other units") {
    synthetic::Random random(synthetic::test_seed());
    for (const double focal_px : {500.0, 3000.0, 30000.0}) {
        const calib::lens_frame frame = calib::make_lens_frame(WIDTH, HEIGHT);
        const calib::lens_state state = random_lens(random, focal_px);
        const lens lens = calib::lens_from_state(frame, state);
        const calib::lens_state back = calib::state_from_lens(frame, lens);
        for (size_t place = 0; place < calib::LENS_PARAMETERS; place++) {
            CHECK(back.value[place] == doctest::Approx(state.value[place]).epsilon(1e-12));
        }
        for (int i = 0; i < 200; i++) {
            const double z = 1000, spread = 0.4 * WIDTH / focal_px * z;
            const double point[3] = {random.uniform(-spread, spread),
                                     random.uniform(-spread, spread), z};
            double ours[2], core[2];
            REQUIRE(calib::project(frame, state, point, ours));
            REQUIRE(lens_project(&lens, point, core));
            CHECK(std::hypot(ours[0] - core[0], ours[1] - core[1]) < 1e-9);
        }
    }
    const double behind[3] = {0, 0, -1};
    double pixel[2];
    CHECK_FALSE(calib::project(calib::make_lens_frame(10, 10), {}, behind, pixel));
}

TEST_CASE("a lens so long that pixels overflow has none") {
    const calib::lens_frame frame = calib::make_lens_frame(WIDTH, HEIGHT);
    const double point_mm[3] = {10, -20, 1000};
    for (const double log_focal : {8.0, 300.0, 800.0}) {
        calib::lens_state lens;
        lens.value[calib::LOG_FOCAL] = log_focal;
        lens.value[calib::RADIAL_6] = -1;
        double pixel_px[2];
        calib::projection seen;
        const bool short_enough = log_focal < 10;
        CHECK(calib::project(frame, lens, point_mm, pixel_px) == short_enough);
        CHECK(calib::project(frame, lens, point_mm, &seen) == short_enough);
    }
}

TEST_CASE("derivatives match finite differences") {
    const uint64_t seed = synthetic::test_seed();
    for (const double focal_px : {800.0, 26560.0}) {
        const scene from = random_scene(seed, focal_px);
        for (int camera = 0; camera < 2; camera++) {
            for (size_t corner = 0; corner < 35; corner += 6) {
                calib::corner_rows rows;
                REQUIRE(calib::make_corner_rows(
                    from.data, camera, from.data.captures[0][size_t(camera)].corners[corner],
                    from.state.lens[camera], from.state.T_left_board[0], from.state.T_right_left,
                    from.state.warp_mm, &rows));
                const int places[4] = {calib::LENS_PARAMETERS, calib::POSE_PARAMETERS,
                                       calib::POSE_PARAMETERS, calib::WARP_PARAMETERS};
                for (int kind = 0; kind < 4; kind++) {
                    for (int place = 0; place < places[kind]; place++) {
                        const double step = 1e-6;
                        const auto more = moved_residual(from, camera, corner, kind, place, step);
                        const auto less = moved_residual(from, camera, corner, kind, place, -step);
                        for (size_t axis = 0; axis < 2; axis++) {
                            const double slope = (more[axis] - less[axis]) / (2 * step);
                            const double *row = kind == 0   ? rows.by_lens[axis]
                                                : kind == 1 ? rows.by_board[axis]
                                                : kind == 2 ? rows.by_rig[axis]
                                                            : rows.by_warp[axis];
                            INFO("kind ", kind, " place ", place, " axis ", axis);
                            CHECK(std::fabs(row[place] - slope) < 1e-3 + 1e-6 * std::fabs(slope));
                        }
                    }
                }
            }
        }
    }
}

TEST_CASE("rotations compose, and their left Jacobian matches finite differences") {
    const double turn[3] = {0.3, -1.2, 0.7}, step = 1e-6;
    const calib::rigid start = calib::turned({}, turn);
    double J[9];
    calib::left_jacobian(turn, J);
    for (int i = 0; i < 3; i++) {
        double more[3] = {turn[0], turn[1], turn[2]}, by_columns[3];
        more[i] += step;
        const calib::rigid moved = calib::turned({}, more);
        for (int k = 0; k < 3; k++) {
            by_columns[k] = J[3 * k + i] * step;
        }
        CHECK(calib::turn_between_rad(moved, calib::turned(start, by_columns)) < 1e-11);
    }
    calib::rigid T = start;
    T.t_mm[0] = 5;
    const calib::rigid unit = T * inverse(T);
    CHECK(calib::turn_between_rad(unit, {}) < 1e-15);
    CHECK(geometry_norm(unit.t_mm) < 1e-14);
}

TEST_CASE("an adjustment ends where the gradient vanishes, from either side") {
    // One board: only its pose is free, so the adjustment converges from far away.
    scene from = random_scene(synthetic::test_seed(), 2000);
    calib::bundle_options options;
    calib::bundle_state one = from.state, other = from.state;
    const double away[6] = {0.05, -0.08, 0.1, 0.01, 0.01, 0.1};
    const double back[6] = {-0.1, 0.02, -0.1, -0.01, 0.02, -0.1};
    one.T_left_board[0] = calib::moved_board(one.T_left_board[0], away);
    other.T_left_board[0] = calib::moved_board(other.T_left_board[0], back);
    // The rig would follow the one board, so only the left view is used.
    from.data.captures[0][RIGHT].used = false;
    const auto first = calib::adjust(from.data, options, &one);
    const auto second = calib::adjust(from.data, options, &other);
    CHECK(first.converged);
    CHECK(second.converged);
    CHECK(first.cost == doctest::Approx(second.cost).epsilon(1e-9));
    CHECK(calib::turn_between_rad(one.T_left_board[0], other.T_left_board[0]) < 1e-6);
    // With a wide loss the result is the same; with a narrow one the cost is smaller.
    options.loss_scale = 1e6;
    calib::bundle_state wide = one;
    CHECK(calib::adjust(from.data, options, &wide).cost ==
          doctest::Approx(first.cost).epsilon(1e-6));
    options.loss_scale = 1;
    CHECK(calib::adjust(from.data, options, &wide).cost < 0.5 * first.cost);
}

TEST_CASE("an empty adjustment succeeds") {
    scene from = random_scene(1, 1000);
    from.data.captures[0][LEFT].used = from.data.captures[0][RIGHT].used = false;
    calib::bundle_state state = from.state;
    CHECK_FALSE(calib::adjust(from.data, {}, &state).converged);
    CHECK(state.T_left_board[0].t_mm[2] == from.state.T_left_board[0].t_mm[2]);
}
