// SPDX-License-Identifier: Apache-2.0
#include "calib/solve/solve_start.hpp"

#include <algorithm>
#include <cmath>

#include "calib/solve/robust.hpp"
#include "calib/solve/solve_parallel.hpp"
#include "core/invariant.h"

namespace calib {

namespace {

const size_t MIN_VIEWS = 3;
const int ROUNDS = 3;

// Sum of the distances, which ranks starts regardless of their losses.
double total_distance(const bundle &data, const bundle_state &state) {
    INVARIANT(state.T_left_board.size() == data.captures.size());
    double sum = 0;
    for (size_t i = 0; i < data.captures.size(); i++) {
        for (int camera = 0; camera < data.cameras; camera++) {
            const bundle_view &view = data.captures[i][size_t(camera)];
            for (const bundle_corner &corner : view.corners) {
                double residual[2];
                if (!view.used || !corner.used) {
                    continue;
                }
                const bool seen =
                    corner_residual(data, camera, corner, state, state.T_left_board[i], residual);
                sum += seen ? std::hypot(residual[0], residual[1]) / corner.sigma_px : 1e9;
            }
        }
    }
    return sum;
}

struct single_start {
    bundle data;  // the views of one camera
    std::vector<homography> seen;
    std::vector<size_t> captures;  // index of the capture, for each element of `seen`
};

single_start prepare(const bundle &data, const view_records &records, int camera) {
    INVARIANT(records.size() == data.captures.size());
    single_start result;
    result.data = single_camera(data, camera);
    for (size_t i = 0; i < data.captures.size(); i++) {
        if (data.captures[i][size_t(camera)].used) {
            result.seen.push_back(records[i][size_t(camera)].seen);
            result.captures.push_back(i);
        }
    }
    return result;
}

// One camera from one focal length. Views whose homography implies no pose are set aside.
bundle_state start_single(single_start from, double focal_px, const bundle_options &robust) {
    INVARIANT(focal_px > 0 && from.seen.size() == from.captures.size());
    bundle_state state;
    state.lens[LEFT].value[LOG_FOCAL] = std::log(focal_px);
    state.T_left_board.resize(from.data.captures.size());
    for (size_t k = 0; k < from.seen.size(); k++) {
        const size_t i = from.captures[k];
        rigid &pose = state.T_left_board[i];
        const bool possible =
            pose_from_homography(from.seen[k], focal_px, from.data.frame[LEFT].middle_x_px,
                                 from.data.frame[LEFT].middle_y_px, &pose);
        from.data.captures[i][LEFT].used =
            possible &&
            fit_pose_either_way(from.data, from.data.captures[i], state, LOSS, &pose) >= 0;
    }
    bundle_options rough = robust;
    rough.free_lens = {};
    rough.free_lens[LOG_FOCAL] = true;
    rough.free_lens[RADIAL_2] = robust.free_lens[RADIAL_2];
    rough.free_warp = {};
    adjust_robustly(from.data, rough, &state);
    bundle_options flat = robust;
    flat.free_warp = {};
    adjust_robustly(from.data, flat, &state);
    return state;
}

// The poses and lenses of both cameras in one state; false when no pair determines the pose of the
// right camera.
bool join(bundle *data, const bundle_state (&single)[CAMERAS], bundle_state *state) {
    std::vector<size_t> pairs;
    for (size_t i = 0; i < data->captures.size(); i++) {
        if (data->captures[i][LEFT].used && data->captures[i][RIGHT].used) {
            pairs.push_back(i);
        }
    }
    if (pairs.empty()) {
        return false;
    }
    const std::vector<rigid> poses[CAMERAS] = {single[LEFT].T_left_board,
                                               single[RIGHT].T_left_board};
    const std::vector<double> off =
        vote_rig(*data, single[RIGHT].lens[LEFT], poses, pairs, &state->T_right_left);
    INVARIANT(off.size() == pairs.size());
    std::vector<double> sorted = off;
    std::nth_element(sorted.begin(), sorted.begin() + long(sorted.size() / 2), sorted.end());
    const double largest_px = 5 * sorted[sorted.size() / 2] + 3;
    for (size_t k = 0; k < pairs.size(); k++) {
        if (off[k] > largest_px) {
            data->captures[pairs[k]][LEFT].used = false;
            data->captures[pairs[k]][RIGHT].used = false;
        }
    }
    state->lens[LEFT] = single[LEFT].lens[LEFT];
    state->lens[RIGHT] = single[RIGHT].lens[LEFT];
    state->T_left_board = single[LEFT].T_left_board;
    for (size_t i = 0; i < data->captures.size(); i++) {
        if (!data->captures[i][LEFT].used && data->captures[i][RIGHT].used) {
            state->T_left_board[i] = inverse(state->T_right_left) * single[RIGHT].T_left_board[i];
            data->captures[i][RIGHT].used = state->T_left_board[i].t_mm[2] > 0;
        }
    }
    return true;
}

// One camera's start.
struct attempt {
    int camera;
    double focal_px;
    bundle_state state{};
    double distance = 0;
    bundle data{};  // views that a wide start used; empty for other starts
};

std::string too_few_views(const bundle &data, int camera, size_t views) {
    static const char *const whose[CAMERAS] = {"left", "right"};
    const std::string who =
        data.cameras == 1 ? "the camera" : std::string("the ") + whose[camera] + " camera";
    return "too few boards: " + who + " has " + std::to_string(views) +
           (views == 1 ? " usable view" : " usable views") + " (minimum 3, recommended 15)";
}

// Each camera separately, from its best focal lengths.
std::string start_singles(const bundle &data, const view_records &records,
                          const start_options &options, bundle_state (&best)[CAMERAS]) {
    std::vector<single_start> from;
    for (int camera = 0; camera < data.cameras; camera++) {
        from.push_back(prepare(data, records, camera));
        if (from.back().seen.size() < MIN_VIEWS) {
            return too_few_views(data, camera, from.back().seen.size());
        }
    }
    std::vector<double> focal_px[CAMERAS];
    parallel_pieces(options.threads, data.cameras, [&](int camera) {
        focal_px[camera] = scan_focal_lengths(data.frame[camera], from[size_t(camera)].seen, 2);
    });
    std::vector<attempt> attempts;
    for (int camera = 0; camera < data.cameras; camera++) {
        for (const double focal : focal_px[camera]) {
            attempts.push_back({camera, focal * options.focal_factor[camera]});
        }
    }
    parallel_pieces(options.threads, int(attempts.size()), [&](int k) {
        attempt &one = attempts[size_t(k)];
        const single_start &own = from[size_t(one.camera)];
        one.state = start_single(own, one.focal_px, options.robust);
        one.distance = total_distance(own.data, one.state);
    });
    for (int camera = 0; camera < data.cameras; camera++) {
        double min = INFINITY;
        INVARIANT(!focal_px[camera].empty());
        for (const attempt &one : attempts) {
            if (one.camera == camera && (one.distance < min || min == INFINITY)) {
                min = one.distance;
                best[camera] = one.state;
            }
        }
    }
    return "";
}

// Share of a view's extent by which a board may miss its homography, at the start.
const double BENT = 0.1;

// One camera with an equidistant lens, from one focal length: `one->data` are its assessed views,
// of which those that fit no board are set aside.
void start_wide(const bundle_options &robust, attempt *one) {
    const lens_frame &frame = one->data.frame[LEFT];
    bundle_state &state = one->state;
    state.lens[LEFT].kind = LENS_EQUIDISTANT;
    state.lens[LEFT].value[LOG_FOCAL] = std::log(one->focal_px);
    state.T_left_board.resize(one->data.captures.size());
    for (size_t i = 0; i < one->data.captures.size(); i++) {
        bundle_view &view = one->data.captures[i][LEFT];
        homography seen;
        rigid &pose = state.T_left_board[i];
        view.used = view.used &&
                    fit_flat_homography(one->data, LEFT, view, state.lens[LEFT], &seen) &&
                    seen.misfit_px < BENT * seen.extent_px &&
                    pose_from_homography(seen, one->focal_px, frame.middle_x_px, frame.middle_y_px,
                                         &pose) &&
                    fit_pose_either_way(one->data, one->data.captures[i], state, LOSS, &pose) >= 0;
    }
    bundle_options rough = robust;
    rough.free_lens = {};
    rough.free_lens[LOG_FOCAL] = rough.free_lens[RADIAL_2] = true;
    rough.free_warp = {};
    adjust_robustly(one->data, rough, &state);
    bundle_options flat = robust;
    flat.free_warp = {};
    adjust_robustly(one->data, flat, &state);
    one->distance = robust_scale(one->data, state);
}

int used_views(const bundle &alone) {
    int count = 0;
    for (const auto &capture : alone.captures) {
        count += capture[LEFT].used;
    }
    return count;
}

// The attempt with the most views, and of these the one that explains them best.
attempt best_of(const std::vector<attempt> &attempts, int camera) {
    const attempt *best = nullptr;
    for (const attempt &one : attempts) {
        if (one.camera != camera) {
            continue;
        }
        const int more = best == nullptr ? 1 : used_views(one.data) - used_views(best->data);
        best = more > 0 || (more == 0 && one.distance < best->distance) ? &one : best;
    }
    INVARIANT(best != nullptr);
    return *best;
}

// The same for equidistant lenses, with all views that could be judged.
std::string start_wide_singles(const bundle &data, const view_records &records,
                               const start_options &options, attempt (&best)[CAMERAS]) {
    bundle alone[CAMERAS];
    for (int camera = 0; camera < data.cameras; camera++) {
        alone[camera] = single_camera(data, camera);
        for (size_t i = 0; i < data.captures.size(); i++) {
            alone[camera].captures[i][LEFT].used = records[i][size_t(camera)].assessed;
        }
        if (used_views(alone[camera]) < int(MIN_VIEWS)) {
            return too_few_views(data, camera, size_t(used_views(alone[camera])));
        }
    }
    std::vector<double> focal_px[CAMERAS];
    parallel_pieces(options.threads, data.cameras,
                    [&](int camera) { focal_px[camera] = scan_equidistant(alone[camera], 2); });
    std::vector<attempt> attempts;
    for (int camera = 0; camera < data.cameras; camera++) {
        for (const double focal : focal_px[camera]) {
            attempts.push_back({camera, focal * options.focal_factor[camera]});
            attempts.back().data = alone[camera];
        }
    }
    parallel_pieces(options.threads, int(attempts.size()),
                    [&](int k) { start_wide(options.robust_wide, &attempts[size_t(k)]); });
    for (int camera = 0; camera < data.cameras; camera++) {
        best[camera] = best_of(attempts, camera);
        const int views = used_views(best[camera].data);
        if (views < int(MIN_VIEWS)) {
            return too_few_views(data, camera, size_t(views));
        }
    }
    return "";
}

// Whether equidistant lenses are worth a try: corners beyond some 40 degrees, or boards that look
// bent to a pinhole. `single` may be without a solution.
bool may_be_wide(const bundle &data, const view_records &records, bool started,
                 const bundle_state (&single)[CAMERAS]) {
    static const double wide = 0.8;
    for (int camera = 0; camera < data.cameras; camera++) {
        for (size_t i = 0; i < data.captures.size(); i++) {
            if (records[i][size_t(camera)].assessed && !data.captures[i][size_t(camera)].used) {
                return true;
            }
        }
        const double focal_px = std::exp(single[camera].lens[LEFT].value[LOG_FOCAL]);
        if (!started || data.frame[camera].radius_px > wide * focal_px) {
            return true;
        }
    }
    return false;
}

// Whether equidistant lenses explain the corners clearly better, of as many views.
bool is_clearly_wide(const bundle &data, const attempt (&wide)[CAMERAS],
                     const bundle_state (&plain)[CAMERAS]) {
    static const double clearly = 0.5, similar = 1.1;
    bool clear = false;
    for (int camera = 0; camera < data.cameras; camera++) {
        const bundle alone = single_camera(data, camera);
        const int views = used_views(alone), more = used_views(wide[camera].data);
        const double scale = robust_scale(alone, plain[camera]);
        if (more < views || wide[camera].distance > similar * scale) {
            return false;
        }
        clear = clear || wide[camera].distance < clearly * scale;
    }
    return clear;
}

// The cameras alone, with pinholes or equidistant lenses; `*data` keeps the views that were used.
std::string start_either(bundle *data, const view_records &records, const start_options &options,
                         bundle_state (&single)[CAMERAS]) {
    std::string failure;
    if (options.wide != wide_start::ALWAYS) {
        failure = start_singles(*data, records, options, single);
        if (options.wide == wide_start::NEVER ||
            !may_be_wide(*data, records, failure.empty(), single)) {
            return failure;
        }
    }
    attempt wide[CAMERAS];
    const std::string wide_failure = start_wide_singles(*data, records, options, wide);
    if (options.wide == wide_start::ALWAYS) {
        failure = wide_failure;
    }
    const bool plain_failed = options.wide == wide_start::ALWAYS || !failure.empty();
    if (!wide_failure.empty() || (!plain_failed && !is_clearly_wide(*data, wide, single))) {
        return failure;
    }
    for (int camera = 0; camera < data->cameras; camera++) {
        single[camera] = wide[camera].state;
        for (size_t i = 0; i < data->captures.size(); i++) {
            data->captures[i][size_t(camera)].used = wide[camera].data.captures[i][LEFT].used;
        }
    }
    return "";
}

}  // namespace

void adjust_robustly(const bundle &data, bundle_options options, bundle_state *state) {
    INVARIANT(state->T_left_board.size() == data.captures.size());
    options.tolerance = ROUGH_TOLERANCE;
    for (int round = 0; round < ROUNDS; round++) {
        options.loss_scale = LOSS * robust_scale(data, *state);
        adjust(data, options, state);
        const double scale = LOSS * robust_scale(data, *state);
        bool reversed = false;
        for (size_t i = 0; i < data.captures.size(); i++) {
            if (!data.used(i)) {
                continue;
            }
            rigid same = state->T_left_board[i], other = second_pose(same);
            const double same_cost = fit_pose(data, data.captures[i], *state, scale, &same);
            const double other_cost = fit_pose(data, data.captures[i], *state, scale, &other);
            if (other_cost >= 0 && other_cost < 0.99 * same_cost &&
                turn_between_rad(same, other) > 1e-3) {
                state->T_left_board[i] = other;
                reversed = true;
            }
        }
        const bool settled = scale > 0.8 * options.loss_scale;
        if (!reversed && settled) {
            break;
        }
    }
}

std::string find_start(bundle *data, const view_records &records, const start_options &options,
                       bundle_state *state) {
    bundle_state single[CAMERAS];
    const std::string failure = start_either(data, records, options, single);
    if (!failure.empty()) {
        return failure;
    }
    if (data->cameras == 1) {
        *state = single[LEFT];
    } else if (!join(data, single, state)) {
        return "no board position was seen by both cameras";
    }
    for (size_t i = 0; i < data->captures.size(); i++) {
        if (!(state->T_left_board[i].t_mm[2] > 0)) {  // no pose was found
            data->captures[i][LEFT].used = data->captures[i][RIGHT].used = false;
        }
    }
    const bool wide = state->lens[LEFT].kind == LENS_EQUIDISTANT;
    adjust_robustly(*data, wide ? options.robust_wide : options.robust, state);
    return "";
}

}  // namespace calib
