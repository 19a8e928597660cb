// SPDX-License-Identifier: Apache-2.0
#include "calib/zoom/zoom_expected.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/base/sentence.hpp"
#include "core/error.h"
#include "core/invariant.h"
#include "stereo/geometry/geometry.h"
#include "stereo/zoom/adjustment.h"

namespace calib {

namespace {

const int GRID = 20;  // matches across and down the left image
static_assert(GRID * GRID == EXPECTED_MATCHES, "one match a cell");
const double MARGIN_PX = 4;
const double BOARD_PX = 0.05;       // sigma of a corner of the board
const double BOARD_TURN_RAD = 0.4;  // rotation of the board about its columns
const int FEWEST_CORNERS = 12;
const double SMALLEST_SQUARE_PX = 10;  // smallest square whose corners are detected
// Of the distance: the length of which the error is computed, so small that both cameras see it.
const double LENGTH_SHARE = 0.01;

using point3 = std::array<double, 3>;

class expecting {
  public:
    expecting(const zoom_calibration &calibration, const zoom_state &state,
              const zoom_state &second, double depth_mm)
        : calibration_(calibration),
          depth_mm_(depth_mm),
          memory_(adjustment_need_bytes(ADJUST_STATES_MAX)) {
        arena_init(&pool_, memory_.data(), memory_.size());
        const zoom_state states[ADJUST_STATES_MAX] = {state, second};
        const int code =
            adjustment_begin(&calibration, states, ADJUST_STATES_MAX, &pool_, &adjustment_);
        INVARIANT(code == ERROR_OK);  // the arena is large enough
        own_ = matches(0, 1);
    }

    /// False: one camera does not see what the other does.
    bool sees() const { return !own_.empty(); }

    expected_sigmas read() const { return sigmas(adjust_prior_sigma); }

    expected_sigmas with_own() { return solved(own_); }

    expected_sigmas with_second() {
        std::vector<adjust_track> all = own_;
        for (const auto &more : {matches(1, 1), matches(0, ADJUST_STATES_MAX)}) {
            all.insert(all.end(), more.begin(), more.end());
        }
        return solved(all);
    }

    expected_sigmas with_board(const board &board) {
        std::vector<point3> points;
        std::vector<target_observation> observations;
        for (int i = 0; i < board.corner_count(); i++) {
            const double x = (i % board.columns - 0.5 * (board.columns - 1)) * board.square_mm;
            const double y = (i / board.columns - 0.5 * (board.rows - 1)) * board.square_mm;
            const double seen_mm[3] = {x * std::cos(BOARD_TURN_RAD), y,
                                       depth_mm_ - x * std::sin(BOARD_TURN_RAD)};
            points.push_back({x, y, 0});
            adjust_track track{};
            if (see(seen_mm, 0, 1, &track)) {
                for (int side = 0; side < 2; side++) {
                    observations.push_back(
                        {side, i, {track.pixel_px[side][0], track.pixel_px[side][1]}});
                }
            }
        }
        adjust_target target{};
        target.points = int(points.size());
        target.observations = int(observations.size());
        target.point_mm = reinterpret_cast<const double(*)[3]>(points.data());
        target.observation = observations.data();
        target.sigma_px = BOARD_PX;
        const double square_px = adjustment_.view[0].lens.fx_px * board.square_mm / depth_mm_;
        if (square_px < SMALLEST_SQUARE_PX || int(observations.size()) < 2 * FEWEST_CORNERS ||
            !adjust_target_place(adjustment_.view, &target)) {
            return {};
        }
        adjustment_.target = &target;
        const expected_sigmas result = solved(own_);
        adjustment_.target = nullptr;
        return result;
    }

  private:
    using sigma_function = double (*)(const adjustment *, const double *);

    // A point in the left camera's frame, in the views of `states` states from `first` on. False if
    // one of them does not show it.
    bool see(const double seen_mm[3], int first, int states, adjust_track *track) const {
        double from[3];
        const camera_view &left = adjustment_.view[0];
        geometry_rotate(left.R_instrument_camera, seen_mm, from);
        std::copy_n(left.position_mm, 3, track->point.origin_mm);
        if (!(from[2] > 0)) {
            return false;
        }
        track->point.x = from[0] / from[2];
        track->point.y = from[1] / from[2];
        track->point.w = 1 / from[2];
        track->sigma_px = EXPECTED_MATCH_PX;
        for (int view = adjust_view(first, 0); view < adjust_view(first + states, 0); view++) {
            const lens &lens = adjustment_.view[view].lens;
            double *px = track->pixel_px[track->count];
            track->view[track->count++] = view;
            if (!camera_view_project(&adjustment_.view[view], &track->point, px, nullptr,
                                     nullptr) ||
                px[0] < MARGIN_PX || px[1] < MARGIN_PX || px[0] > lens.width_px - MARGIN_PX ||
                px[1] > lens.height_px - MARGIN_PX) {
                return false;
            }
        }
        return true;
    }

    // Spread over the left image of the last of the states, near and far in turns.
    std::vector<adjust_track> matches(int first, int states) const {
        std::vector<adjust_track> tracks;
        const camera_view &left = adjustment_.view[0],
                          &spread = adjustment_.view[adjust_view(first + states - 1, 0)];
        for (int i = 0; i < GRID * GRID; i++) {
            const double px[2] = {(i % GRID + 0.5) / GRID * spread.lens.width_px,
                                  (i / GRID + 0.5) / GRID * spread.lens.height_px};
            const double side = i % 2 == i / GRID % 2 ? 1 : -1;
            double ray[3], seen_mm[3];
            if (!camera_view_ray(&spread, px, ray)) {
                continue;
            }
            geometry_rotate_back(left.R_instrument_camera, ray, seen_mm);
            const double z = depth_mm_ * (1 + 0.5 * side * EXPECTED_RELIEF) / seen_mm[2];
            for (double &value : seen_mm) {
                value *= z;
            }
            adjust_track track{};
            if (see(seen_mm, first, states, &track)) {
                tracks.push_back(track);
            }
        }
        return tracks;
    }

    expected_sigmas solved(std::vector<adjust_track> tracks) {
        return adjustment_solve(&adjustment_, tracks.data(), int(tracks.size())) > 0
                   ? sigmas(adjust_posterior_sigma)
                   : expected_sigmas{};
    }

    expected_sigmas sigmas(sigma_function sigma_of) const {
        const double middle[2] = {0.5 * (adjustment_.view[0].lens.width_px - 1),
                                  0.5 * (adjustment_.view[0].lens.height_px - 1)};
        double gradient[ADJUST_TERMS_MAX];
        expected_sigmas result;
        if (adjustment_depth_gradient(&adjustment_, 0, middle, depth_mm_, gradient)) {
            result.depth_mm =
                std::hypot(sigma_of(&adjustment_, gradient), calibration_.scale_sigma * depth_mm_);
        }
        if (length_gradient(gradient)) {
            result.length_mm =
                std::hypot(sigma_of(&adjustment_, gradient) / (LENGTH_SHARE * depth_mm_),
                           calibration_.scale_sigma) *
                EXPECTED_LENGTH_MM;
        }
        return result;
    }

    static bool length_of(const adjustment &adjustment, const adjust_track ends[2],
                          double *length) {
        point3 at[2];
        for (size_t i = 0; i < 2; i++) {
            adjust_track track = ends[i];
            if (!adjustment_track_place(&adjustment, &track) || !(track.point.w > 0)) {
                return false;
            }
            const far_point &point = track.point;
            at[i] = {point.origin_mm[0] + point.x / point.w, point.origin_mm[1] + point.y / point.w,
                     point.origin_mm[2] + 1 / point.w};
        }
        *length = std::hypot(at[0][0] - at[1][0], at[0][1] - at[1][1], at[0][2] - at[1][2]);
        return true;
    }

    // Of a length of LENGTH_SHARE of the distance, in the middle of the left image.
    bool length_gradient(double gradient[ADJUST_TERMS_MAX]) const {
        adjust_track ends[2] = {};
        double length = 0, after = 0;
        std::fill_n(gradient, int(ADJUST_TERMS_MAX), 0.0);
        for (int i = 0; i < 2; i++) {
            const double x = (i - 0.5) * LENGTH_SHARE * depth_mm_;
            const double seen_mm[3] = {x, 0, depth_mm_};
            if (!see(seen_mm, 0, 1, &ends[i])) {
                return false;
            }
        }
        bool known = length_of(adjustment_, ends, &length);
        for (int i = 0; i < 2 * VIEW_TERMS && known; i++) {
            double one[ADJUST_TERMS_MAX] = {}, change[VIEW_TERMS] = {};
            one[i] = 1;
            const double step = 0.1 * adjust_prior_sigma(&adjustment_, one);
            adjustment moved = adjustment_;
            change[i % VIEW_TERMS] = step;
            camera_view_correct(&adjustment_.view[i / VIEW_TERMS], change,
                                &moved.view[i / VIEW_TERMS]);
            known = length_of(moved, ends, &after);
            gradient[i] = step > 0 ? (after - length) / step : 0;
        }
        return known;
    }

    const zoom_calibration &calibration_;
    double depth_mm_;
    std::vector<unsigned char> memory_;
    arena pool_{};
    adjustment adjustment_{};
    std::vector<adjust_track> own_;
};

}  // namespace

zoom_expected expect_zoom(const zoom_calibration &calibration, const zoom_state &state,
                          const zoom_state &second, const board &board, double depth_mm) {
    INVARIANT(depth_mm > 0);
    expecting at(calibration, state, second, depth_mm);
    zoom_expected result;
    if (at.sees()) {
        result.read = at.read();
        result.own = at.with_own();
        result.second = at.with_second();
        result.board = at.with_board(board);
    }
    return result;
}

double board_distance_mm(const zoom_solution &solution) {
    std::vector<double> distances;
    for (const rigid &T_instrument_board : solution.estimate.T_instrument_board) {
        distances.push_back(geometry_norm(T_instrument_board.t_mm));
    }
    const auto middle = distances.begin() + long(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return distances.empty() ? INFINITY : *middle;
}

zoom_state zoom_aimed(const zoom_calibration &calibration, double share, double depth_mm) {
    INVARIANT(share >= 0 && share <= 1 && depth_mm > 0);
    const double point_mm[3] = {0.5 * calibration.camera[1].mount[ZOOM_POSITION_X], 0, depth_mm};
    zoom_state state{};
    for (size_t side = 0; side < 2; side++) {
        const zoom_camera &camera = calibration.camera[side];
        state.side[side].zoom_counts =
            camera.zoom.min + (camera.zoom.max - camera.zoom.min) * share;
        state.side[side].focus_counts = 0.5 * (camera.focus.min + camera.focus.max);
    }
    // Turns each camera by the angle of the point from its axis, which its horn and mount decide.
    for (int pass = 0; pass < 2; pass++) {
        zoom_pair pair;
        zoom_pair_at(calibration.camera, &state, &pair);
        for (size_t side = 0; side < 2; side++) {
            const zoom_range &range = calibration.camera[side].pan_rad;
            double arm_mm[3], seen[3];
            for (size_t i = 0; i < 3; i++) {
                arm_mm[i] = point_mm[i] - pair.side[side].position_mm[i];
            }
            geometry_rotate_back(pair.side[side].R_instrument_camera, arm_mm, seen);
            state.side[side].pan_rad = std::clamp(
                state.side[side].pan_rad + std::atan2(seen[0], seen[2]), range.min, range.max);
        }
    }
    return state;
}

zoom_state zoom_again(const zoom_calibration &calibration, const zoom_state &state, double share) {
    zoom_state result = state;
    for (size_t side = 0; side < 2; side++) {
        const zoom_range &zoom = calibration.camera[side].zoom;
        result.side[side].zoom_counts = zoom.min + (zoom.max - zoom.min) * share;
    }
    return result;
}

std::array<zoom_lengths, 2> lengths_of_zoom(const zoom_solution &solution, const board &board) {
    const zoom_calibration &rig = *solution.rig;
    std::array<zoom_lengths, 2> result;
    for (size_t i = 0; i < 2; i++) {
        zoom_lengths &one = result[i];
        one.distance_mm = board_distance_mm(solution);
        const zoom_state state = zoom_aimed(rig, double(i), one.distance_mm);
        one.focal_px =
            zoom_function_value(&rig.camera[LEFT], ZOOM_FOCAL, state.side[LEFT].zoom_counts);
        one.expected =
            expect_zoom(rig, state, zoom_again(rig, state, 1 - double(i)), board, one.distance_mm);
    }
    return result;
}

std::string zoom_verdict(const zoom_solution &solution,
                         const std::array<zoom_lengths, 2> &lengths) {
    const zoom_validation &checked = solution.rig->validation;
    if (!solution.warnings.empty()) {
        const size_t more = solution.warnings.size() - 1;
        const std::string others =
            more > 0 ? sentence("; and %zu more %s", more, more == 1 ? "reason" : "reasons") : "";
        return "Not good: " + solution.warnings[0] + others + ".";
    }
    std::string text = sentence("Good: %d zooms and %d board positions fit to %.3f px",
                                checked.settings, checked.boards, checked.rms_px);
    if (checked.held_out_px > 0) {
        text += sentence(", zooms left out are predicted to %.2f px and %.3f %% of f",
                         checked.held_out_px, 100 * checked.held_out_focal);
    }
    const double worst_mm =
        std::max(lengths[0].expected.own.length_mm, lengths[1].expected.own.length_mm);
    if (worst_mm > 0) {
        text += sentence(
            "; a length of %.0f mm at %.0f mm is known to +- %.2g mm with a pair's own "
            "matches",
            EXPECTED_LENGTH_MM, lengths[0].distance_mm, worst_mm);
    }
    return text + ".";
}

}  // namespace calib
