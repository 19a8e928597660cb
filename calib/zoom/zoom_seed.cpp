// SPDX-License-Identifier: Apache-2.0
#include "calib/zoom/zoom_seed.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "calib/solve/seed.hpp"
#include "calib/solve/solve_parallel.hpp"
#include "core/invariant.h"
#include "stereo/geometry/geometry.h"

namespace calib {

namespace {

const double SAME_SETTING_COUNTS = 5;  // a lens returns to a position within this
const double DEFAULT_SIGMA_PX = 0.1;
// Noise of a corner is not all: those of one view are off together by some hundredths of a pixel,
// as blur and perspective do to a detector. Taken at their word, sharp corners bend the lens
// functions to that.
const double MIN_SIGMA_PX = 0.03;
// Of the dioptre, 1/m. A distance scale is as wrong as the focal length that the board's distance
// was found with, alike in all pairs, so it says nothing where others were focused by their
// pictures.
const double FOCUSED_BY_SCALE_SIGMA = 0.1, FOCUSED_SIGMA = 0.004;

// Clusters of positions; `of[i]` is the cluster of capture i.
std::vector<double> cluster(const std::vector<double> &counts, std::vector<int> *group) {
    std::vector<size_t> order(counts.size());
    for (size_t i = 0; i < order.size(); i++) {
        order[i] = i;
    }
    std::sort(order.begin(), order.end(),
              [&](size_t a, size_t b) { return counts[a] < counts[b]; });
    group->assign(counts.size(), 0);
    std::vector<double> sums;
    std::vector<int> sizes;
    for (size_t i = 0; i < order.size(); i++) {
        if (i == 0 || counts[order[i]] - counts[order[i - 1]] > SAME_SETTING_COUNTS) {
            sums.push_back(0);
            sizes.push_back(0);
        }
        sums.back() += counts[order[i]];
        sizes.back()++;
        (*group)[order[i]] = int(sums.size()) - 1;
    }
    for (size_t i = 0; i < sums.size(); i++) {
        sums[i] /= sizes[i];
    }
    return sums;
}

zoom_range range_of(const std::vector<double> &values) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    // A motor that was never moved still needs a scale.
    return *high > *low ? zoom_range{*low, *high} : zoom_range{*low - 1, *high + 1};
}

bundle_view view_of(const board_view &seen) {
    bundle_view view;
    for (const corner &one : seen.corners) {
        const double sigma_px = one.sigma_px > 0 ? one.sigma_px : DEFAULT_SIGMA_PX;
        view.corners.push_back(
            {one.index, one.x_px, one.y_px, std::max(sigma_px, MIN_SIGMA_PX), true});
    }
    view.overexposed = seen.overexposed();
    view.used = !view.corners.empty();
    return view;
}

void add_boards(const zoom_observations &seen, zoom_problem *problem) {
    for (const board &one : seen.boards) {
        std::array<bundle, CAMERAS> pair;
        for (size_t camera = 0; camera < CAMERAS; camera++) {
            pair[camera].points = make_board_points(one, pair[camera].half_mm);
            pair[camera].frame[LEFT] = pair[camera].frame[RIGHT] = problem->side[camera].frame;
        }
        problem->boards.push_back(pair);
    }
}

}  // namespace

std::string make_problem(const zoom_observations &seen, zoom_problem *problem) {
    *problem = zoom_problem{};
    problem->pan_sigma_rad = seen.pan_sigma_rad;
    problem->reading_noise = seen.reading_noise;
    if (seen.captures.empty() || seen.boards.empty()) {
        return "no pairs with corners";
    }
    std::vector<int> setting[CAMERAS];
    for (size_t camera = 0; camera < CAMERAS; camera++) {
        std::vector<double> zoom, focus;
        for (const capture &capture : seen.captures) {
            zoom.push_back(capture.axes[camera].zoom_counts);
            focus.push_back(capture.axes[camera].focus_counts);
        }
        zoom_side &side = problem->side[camera];
        side.settings = cluster(zoom, &setting[camera]);
        side.zoom = range_of(zoom);
        side.focus = range_of(focus);
        side.frame = make_lens_frame(seen.width_px[camera], seen.height_px[camera]);
        side.pixel_mm = seen.pixel_mm[camera];
    }
    add_boards(seen, problem);
    const bool focus_found = std::any_of(seen.captures.begin(), seen.captures.end(),
                                         [](const capture &one) { return one.focused; });
    std::map<std::pair<int, size_t>, size_t> places;
    std::map<int, int> visits;
    for (size_t i = 0; i < seen.captures.size(); i++) {
        const capture &one = seen.captures[i];
        INVARIANT(one.board < seen.boards.size());
        const auto place =
            places.emplace(std::make_pair(one.position, one.board), problem->places.size());
        if (place.second) {
            problem->places.push_back({one.board, {}});
        }
        const int visit = visits.emplace(one.visit, int(visits.size())).first->second;
        problem->places[place.first->second].captures.push_back(i);
        const double focused_sigma = one.focused ? FOCUSED_SIGMA : 0;
        problem->captures.push_back({one.board,
                                     place.first->second,
                                     visit,
                                     focus_found ? focused_sigma : FOCUSED_BY_SCALE_SIGMA,
                                     {setting[LEFT][i], setting[RIGHT][i]},
                                     one.axes,
                                     {view_of(one.view[0]), view_of(one.view[1])}});
    }
    problem->visits = int(visits.size());
    return "";
}

std::vector<zoom_setting> solve_each(const zoom_observations &seen, const zoom_problem &problem,
                                     int threads, const std::function<void(int, int)> &progress) {
    std::map<std::array<int, CAMERAS>, std::map<size_t, std::vector<size_t>>> groups;
    for (size_t i = 0; i < problem.captures.size(); i++) {
        groups[problem.captures[i].setting][problem.captures[i].board].push_back(i);
    }
    std::vector<zoom_setting> result;
    for (const auto &[setting, boards] : groups) {
        zoom_setting one;
        one.setting = setting;
        for (const auto &board : boards) {
            if (board.second.size() > one.captures.size()) {
                one.captures = board.second;
            }
        }
        result.push_back(one);
    }
    int done = 0;
    const auto solve_one = [&](int index) {
        const size_t camera = size_t(index) % CAMERAS;
        zoom_setting &one = result[size_t(index) / CAMERAS];
        observations alone;
        alone.cameras = 1;
        alone.target = seen.boards[problem.captures[one.captures[0]].board];
        alone.width_px[0] = seen.width_px[camera];
        alone.height_px[0] = seen.height_px[camera];
        for (const size_t at : one.captures) {
            const capture &from = seen.captures[at];
            capture view;
            view.name[0] = from.name[camera];
            view.view[0] = from.view[camera];
            alone.captures.push_back(view);
        }
        solve_options options;
        options.choose_model = false;
        options.second_start = false;
        options.model.distortion = lens_model::K1_K2_P1_P2;
        one.alone[camera] = solve(alone, options);
        std::vector<double> distances;
        for (size_t i = 0; i < one.alone[camera].T_left_board.size(); i++) {
            if (one.alone[camera].board_known[i]) {
                distances.push_back(one.alone[camera].T_left_board[i].t_mm[2]);
            }
        }
        if (!distances.empty()) {
            const auto middle = distances.begin() + long(distances.size() / 2);
            std::nth_element(distances.begin(), middle, distances.end());
            one.focused_mm[camera] = *middle;
        }
    };
    const int pieces = CAMERAS * int(result.size());
    parallel_pieces(threads, pieces, solve_one, [&] {
        if (progress) {
            progress(done++, pieces);
        }
    });
    return result;
}

double focal_at_infinity(double focal_px, double pixel_mm, double distance_mm) {
    return distance_mm > 0 ? focal_px / (1 + focal_px * pixel_mm / distance_mm) : focal_px;
}

std::vector<double> fit_series(const std::vector<double> &u, const std::vector<double> &value,
                               const std::vector<double> &sigma, int terms) {
    INVARIANT(u.size() == value.size() && u.size() == sigma.size() && terms > 0);
    vector solved = vector::Zero(terms);
    std::vector<double> weight(u.size(), 1);
    for (int round = 0; round < 12; round++) {
        matrix A = matrix::Zero(terms, terms);
        vector b = vector::Zero(terms);
        double size = 0;
        for (size_t k = 0; k < u.size(); k++) {
            double basis[ZOOM_TERMS_MAX];
            zoom_chebyshev(u[k], terms, basis);
            const Eigen::Map<vector> row(basis, terms);
            const double w = weight[k] / (sigma[k] * sigma[k]);
            A += w * row * row.transpose();
            b += w * value[k] * row;
            size += w;
        }
        for (int i = 2; i < terms; i++) {
            A(i, i) += 1e-4 * size / double(u.size()) * i * i;
        }
        A.diagonal().array() += 1e-12 * size;
        solved = solve_symmetric(A, b);
        for (size_t k = 0; k < u.size(); k++) {
            double basis[ZOOM_TERMS_MAX];
            zoom_chebyshev(u[k], terms, basis);
            const double off = (value[k] - Eigen::Map<vector>(basis, terms).dot(solved)) / sigma[k];
            weight[k] = 1 / (1 + off * off / 9);
        }
    }
    return {solved.data(), solved.data() + terms};
}

namespace {

// One camera's focal lengths at the settings that could be calibrated alone.
struct seen_focals {
    std::vector<const zoom_setting *> solved;
    std::vector<double> at, px, sigma_px;  // position within the range, at infinity
};

seen_focals focals_of(const std::vector<zoom_setting> &settings, const zoom_side &side,
                      int camera) {
    seen_focals result;
    for (const zoom_setting &one : settings) {
        const solution &alone = one.alone[size_t(camera)];
        if (alone.solved) {
            const double seen_px = alone.camera[0].fx_px;
            const double counts = side.settings[size_t(one.setting[size_t(camera)])];
            result.solved.push_back(&one);
            result.at.push_back(zoom_range_unit(&side.zoom, counts));
            result.px.push_back(
                focal_at_infinity(seen_px, side.pixel_mm, one.focused_mm[size_t(camera)]));
            result.sigma_px.push_back(alone.sigma.focal_px[0] + 2e-3 * seen_px);
        }
    }
    return result;
}

double value_of_series(const std::vector<double> &terms, double u) {
    double basis[ZOOM_TERMS_MAX], sum = 0;
    zoom_chebyshev(u, int(terms.size()), basis);
    for (size_t i = 0; i < terms.size(); i++) {
        sum += terms[i] * basis[i];
    }
    return sum;
}

// The scale of log f; false where the focal lengths make no sense.
bool seed_focal(const seen_focals &seen, int order, zoom_side *side, std::vector<double> *terms) {
    if (seen.solved.size() < 2) {
        return false;
    }
    *terms = fit_series(seen.at, seen.px, seen.sigma_px,
                        std::min(order, int(seen.solved.size()) / 2 + 1));
    const double low = value_of_series(*terms, -1), high = value_of_series(*terms, 1);
    if (!(low > 1 && high > 1)) {
        return false;
    }
    side->log_focal = {std::log(std::min(low, high)), std::log(std::max(low, high))};
    return side->log_focal.max - side->log_focal.min > 1e-3;
}

// The lens functions of one camera drawn through the settings' own results.
bool seed_lens(const std::vector<zoom_setting> &settings, int camera, zoom_problem *problem,
               const zoom_orders &orders, std::vector<double> terms[ZOOM_FUNCTIONS]) {
    zoom_side &side = problem->side[size_t(camera)];
    const seen_focals seen = focals_of(settings, side, camera);
    if (!seed_focal(seen, orders[ZOOM_FOCAL], &side, &terms[ZOOM_FOCAL])) {
        return false;
    }
    for (int function = ZOOM_CENTRE_X; function < ZOOM_FUNCTIONS; function++) {
        const int parameter = zoom_lens_parameter(function);
        if (parameter < 0 || orders[size_t(function)] == 0) {
            continue;
        }
        std::vector<double> u, value, sigma;
        for (size_t i = 0; i < seen.solved.size(); i++) {
            const solution &alone = seen.solved[i]->alone[size_t(camera)];
            const lens_state own = state_from_lens(side.frame, alone.camera[0]);
            u.push_back(zoom_range_unit(&side.log_focal, std::log(seen.px[i])));
            value.push_back(own.value[size_t(parameter)]);
            sigma.push_back(1 + alone.sigma.centre_x_px[0]);
        }
        terms[function] = fit_series(u, value, sigma, std::min(orders[size_t(function)], 2));
    }
    return true;
}

rigid average(const std::vector<rigid> &poses, const std::vector<double> &weight) {
    matrix3 sum = matrix3::Zero();
    rigid result;
    double total = 0, t[3] = {0, 0, 0};
    for (size_t k = 0; k < poses.size(); k++) {
        for (int i = 0; i < 9; i++) {
            sum(i / 3, i % 3) += weight[k] * poses[k].R[i];
        }
        for (int i = 0; i < 3; i++) {
            t[i] += weight[k] * poses[k].t_mm[i];
        }
        total += weight[k];
    }
    const matrix3 R = nearest_rotation(sum);
    for (int i = 0; i < 9; i++) {
        result.R[i] = R(i / 3, i % 3);
    }
    for (int i = 0; i < 3; i++) {
        result.t_mm[i] = t[i] / total;
    }
    return result;
}

// T_instrument_left of a capture, and where the right camera is in the instrument's frame.
void seed_mounts(const std::vector<zoom_setting> &settings, const zoom_problem &problem,
                 const zoom_layout &layout, std::vector<double> *shared) {
    const double behind_mm = -40;
    for (int camera = 0; camera < CAMERAS; camera++) {
        (*shared)[size_t(layout.mount_at(camera, ZOOM_AXIS_POINT_Z))] = behind_mm;
    }
    std::vector<rigid> mounts;
    std::vector<double> weights;
    for (const zoom_setting &one : settings) {
        const solution &first = one.alone[LEFT], &second = one.alone[RIGHT];
        for (size_t i = 0; first.solved && second.solved && i < one.captures.size(); i++) {
            if (!first.board_known[i] || !second.board_known[i]) {
                continue;
            }
            const zoom_problem::capture &capture = problem.captures[one.captures[i]];
            const posed_camera left =
                camera_at(problem, layout, shared->data(), view_state_of(capture, LEFT), {});
            const rigid T_instrument_right =
                inverse(left.T_camera_instrument) *
                (first.T_left_board[i] * inverse(second.T_left_board[i]));
            // Turned back to pan 0 about the vertical through a point behind the pupil.
            const double angle = -capture.axes[RIGHT].pan_rad, back[3] = {0, angle, 0};
            rigid mount = turned(T_instrument_right, back);
            const double *z = T_instrument_right.R;
            const double arm[3] = {z[2] * behind_mm, z[5] * behind_mm, z[8] * behind_mm};
            double turned_arm[3], turn[9];
            geometry_rotation_from_vector(back, turn);
            geometry_rotate(turn, arm, turned_arm);
            for (int k = 0; k < 3; k++) {
                mount.t_mm[k] = T_instrument_right.t_mm[k] + arm[k] - turned_arm[k];
            }
            mounts.push_back(mount);
            // The distances are as uncertain as the focal lengths, which counts at long ones.
            const double sigma = 1e-3 + first.sigma.focal_px[0] / first.camera[0].fx_px +
                                 second.sigma.focal_px[0] / second.camera[0].fx_px;
            weights.push_back(1 / (sigma * sigma));
        }
    }
    if (mounts.empty()) {
        return;
    }
    const rigid mount = average(mounts, weights);
    double rotation[3];
    if (geometry_vector_from_rotation(mount.R, rotation) != 0) {
        return;
    }
    for (int i = 0; i < 3; i++) {
        (*shared)[size_t(layout.mount_at(RIGHT, ZOOM_ROTATION_X + i))] = rotation[i];
        (*shared)[size_t(layout.mount_at(RIGHT, ZOOM_POSITION_X + i))] = mount.t_mm[i];
    }
    (*shared)[size_t(layout.mount_at(RIGHT, ZOOM_AXIS_POINT_X))] = mount.t_mm[0];
    (*shared)[size_t(layout.mount_at(RIGHT, ZOOM_AXIS_POINT_Z))] = mount.t_mm[2] + behind_mm;
}

// Poses of the boards from the settings that were calibrated alone.
void seed_places(const zoom_observations &seen, const std::vector<zoom_setting> &settings,
                 const zoom_layout &layout, zoom_problem *problem, zoom_estimate *estimate) {
    std::vector<size_t> best(problem->places.size(), 0);
    for (const zoom_setting &one : settings) {
        const solution &alone = one.alone[LEFT];
        for (size_t i = 0; alone.solved && i < one.captures.size(); i++) {
            const zoom_problem::capture &capture = problem->captures[one.captures[i]];
            const size_t corners = capture.view[LEFT].corners.size();
            if (!alone.board_known[i] || corners <= best[capture.place]) {
                continue;
            }
            best[capture.place] = corners;
            const board &target = seen.boards[capture.board];
            rigid middle;
            middle.t_mm[0] = 0.5 * (target.columns - 1) * target.square_mm;
            middle.t_mm[1] = 0.5 * (target.rows - 1) * target.square_mm;
            const posed_camera left = camera_at(*problem, layout, estimate->shared.data(),
                                                view_state_of(capture, LEFT), {});
            estimate->T_instrument_board[capture.place] =
                inverse(left.T_camera_instrument) * (alone.T_left_board[i] * middle);
        }
    }
    for (zoom_problem::capture &capture : problem->captures) {
        if (best[capture.place] == 0) {
            capture.view[LEFT].used = capture.view[RIGHT].used = false;
        }
    }
}

}  // namespace

std::string seed_zoom(const zoom_observations &seen, const std::vector<zoom_setting> &settings,
                      zoom_problem *problem, const zoom_orders &orders, zoom_estimate *estimate) {
    std::vector<double> terms[CAMERAS][ZOOM_FUNCTIONS];
    for (int camera = 0; camera < CAMERAS; camera++) {
        if (!seed_lens(settings, camera, problem, orders, terms[camera])) {
            return std::string("fewer than two zooms of the ") +
                   (camera == LEFT ? "left" : "right") + " camera could be calibrated";
        }
    }
    const zoom_layout layout(*problem, orders);
    *estimate = zoom_estimate{};
    estimate->shared.assign(size_t(layout.size()), 0);
    estimate->T_instrument_board.assign(problem->places.size(), {});
    estimate->latent.assign(problem->captures.size(), {});
    for (int camera = 0; camera < CAMERAS; camera++) {
        for (int function = 0; function < ZOOM_FUNCTIONS; function++) {
            std::copy(terms[camera][function].begin(), terms[camera][function].end(),
                      estimate->shared.begin() + layout.terms_at(camera, function));
        }
        // The lens is focused on the boards.
        double closeness = 0;
        int count = 0;
        for (const zoom_setting &one : settings) {
            const double focused_mm = one.focused_mm[size_t(camera)];
            if (one.alone[size_t(camera)].solved && focused_mm > 0) {
                closeness += 1e3 / focused_mm;
                count++;
            }
        }
        estimate->shared[size_t(layout.terms_at(camera, ZOOM_FOCUS_DIOPTRE))] =
            count > 0 ? closeness / count : 0;
    }
    seed_mounts(settings, *problem, layout, &estimate->shared);
    seed_places(seen, settings, layout, problem, estimate);
    return "";
}

}  // namespace calib
