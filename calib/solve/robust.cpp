// SPDX-License-Identifier: Apache-2.0
#include "calib/solve/robust.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/solve/robust_reason.hpp"
#include "core/invariant.h"

namespace calib {

namespace {

const int MIN_CORNERS = 6;      // minimum in a view: four determine its pose, two more verify it
const double MIN_RIGHT = 0.75;  // share of a view's corners that must be right
const double GARBAGE = 0.03;    // misfit of a homography, as a share of the view's extent
const double NOISIER = 3;       // maximum noise of a used view, as a multiple of the common noise
// Median radius of a two-dimensional Gaussian, in sigmas.
const double MEDIAN_RADIUS = 1.1774100225154747;
const double MIN_LIMIT_PX = 1e-3;

double median_of(std::vector<double> *values) {
    INVARIANT(!values->empty());
    const auto middle = values->begin() + long(values->size() / 2);
    std::nth_element(values->begin(), middle, values->end());
    return *middle;
}

double median_sigma(const bundle_view &view) {
    std::vector<double> sigmas;
    for (const bundle_corner &corner : view.corners) {
        sigmas.push_back(corner.sigma_px);
    }
    return median_of(&sigmas);
}

// How well one pose explains one board position.
struct explanation {
    rigid T_left_board;
    double cost = -1;  // negative: not at all
    bool right[CAMERAS] = {false, false};
    std::vector<double> off[CAMERAS];  // lengths of all residuals in sigmas, by corner
    double limit[CAMERAS] = {0, 0};    // largest residual of a right corner, in sigmas
    double noise[CAMERAS] = {0, 0};    // noise of the view over that of all views
};

class view_assessor {
  public:
    view_assessor(const bundle &data, const bundle_state &state, double scale, double limit)
        : data_(data), state_(state), scale_(scale), limit_(limit) {}

    // The best pose for the views of `cameras`, using all corners, refined from each of `starts`.
    explanation explain(const std::array<bundle_view, CAMERAS> &views, bool left, bool right,
                        const std::vector<rigid> &starts) const {
        std::array<bundle_view, CAMERAS> asked = views;
        const bool ask[CAMERAS] = {left, right};
        for (int camera = 0; camera < CAMERAS; camera++) {
            asked[size_t(camera)].used = ask[camera];
            for (bundle_corner &corner : asked[size_t(camera)].corners) {
                corner.used = true;
            }
        }
        explanation best;
        for (rigid pose : starts) {
            const double cost = fit_pose(data_, asked, state_, LOSS * scale_, &pose);
            if (cost >= 0 && (best.cost < 0 || cost < best.cost)) {
                best.cost = cost;
                best.T_left_board = pose;
            }
        }
        for (int camera = 0; best.cost >= 0 && camera < CAMERAS; camera++) {
            if (ask[camera]) {
                measure(asked[size_t(camera)], camera, &best);
            }
        }
        return best;
    }

    // The two poses that a view's own homography implies.
    std::vector<rigid> starts_of(int camera, const homography &pinhole,
                                 const bundle_view &view) const {
        const lens_state &own = state_.lens[camera];
        const lens lens = lens_from_state(data_.frame[camera], own);
        homography seen = pinhole;
        if (own.kind != LENS_BROWN_CONRADY) {
            fit_flat_homography(data_, camera, view, own, &seen);
        }
        rigid pose;
        std::vector<rigid> starts;
        if (pose_from_homography(seen, lens.fx_px, lens.cx_px, lens.cy_px, &pose)) {
            for (const rigid &way : {pose, second_pose(pose)}) {
                starts.push_back(camera == RIGHT ? inverse(state_.T_right_left) * way : way);
            }
        }
        return starts;
    }

  private:
    void measure(const bundle_view &view, int camera, explanation *result) const {
        INVARIANT(result->cost >= 0 && scale_ > 0 && limit_ > 0);
        std::vector<double> &off = result->off[camera];
        for (const bundle_corner &corner : view.corners) {
            double residual[2];
            const bool seen =
                corner_residual(data_, camera, corner, state_, result->T_left_board, residual);
            off.push_back(seen ? std::hypot(residual[0], residual[1]) / corner.sigma_px : 1e9);
        }
        std::vector<double> sorted = off;
        // A view may be somewhat noisier than the others without being wrong.
        const double own = median_of(&sorted) / MEDIAN_RADIUS;
        INVARIANT(off.size() == view.corners.size() && own >= 0);
        result->limit[camera] = limit_ * std::clamp(own, scale_, NOISIER * scale_);
        result->noise[camera] = own * median_sigma(view) < MIN_LIMIT_PX ? 1 : own / scale_;
        size_t right = 0;
        for (size_t i = 0; i < off.size(); i++) {
            right += is_right(view.corners[i], off[i], result->limit[camera]);
        }
        result->right[camera] = double(right) >= MIN_RIGHT * double(off.size()) &&
                                right >= size_t(MIN_CORNERS) && result->noise[camera] <= NOISIER;
    }

  public:
    static bool is_right(const bundle_corner &corner, double off, double limit) {
        return off <= std::max(limit, MIN_LIMIT_PX / corner.sigma_px);
    }

  private:
    const bundle &data_;
    const bundle_state &state_;
    const double scale_, limit_;
};

// Applies an explanation to one camera's view.
void accept(const explanation &given, int camera, bundle_view *view) {
    INVARIANT(given.cost >= 0 && given.off[camera].size() == view->corners.size());
    view->used = true;
    for (size_t i = 0; i < view->corners.size(); i++) {
        bundle_corner &corner = view->corners[i];
        corner.used = view_assessor::is_right(corner, given.off[camera][i], given.limit[camera]);
    }
}

void renumber_turned(const bundle &data, bundle_view *view) {
    for (bundle_corner &corner : view->corners) {
        corner.index = int(data.points.size()) - 1 - corner.index;
        INVARIANT(corner.index >= 0);
    }
    std::reverse(view->corners.begin(), view->corners.end());
}

std::string garbage_reason(const bundle_view &view, const explanation &alone, int camera) {
    if (alone.off[camera].empty()) {
        return "no board position in front of the camera explains its corners";
    }
    INVARIANT(alone.off[camera].size() == view.corners.size());
    size_t wrong = 0;
    for (size_t i = 0; i < alone.off[camera].size(); i++) {
        wrong +=
            !view_assessor::is_right(view.corners[i], alone.off[camera][i], alone.limit[camera]);
    }
    char text[160];
    if (double(wrong) <= (1 - MIN_RIGHT) * double(view.corners.size())) {
        std::snprintf(text, sizeof text, "its residuals are %.1f times those of other views",
                      alone.noise[camera]);
        return text;
    }
    std::snprintf(text, sizeof text, "%zu of its %zu corners do not fit a flat board", wrong,
                  view.corners.size());
    return text;
}

// One board position being judged: the results for each of its views.
struct trial {
    const view_assessor &assess;
    bundle *data;
    bundle_state *state;
    const board &target;
    size_t capture;
    std::array<view_record, CAMERAS> *records;

    std::array<bundle_view, CAMERAS> &views() const { return data->captures[capture]; }
    view_record &record(int camera) const { return (*records)[size_t(camera)]; }
    bool has(int camera) const { return record(camera).assessed; }

    explanation alone(int camera) const {
        INVARIANT(has(camera) && !views()[size_t(camera)].empty());
        std::vector<rigid> starts =
            assess.starts_of(camera, record(camera).seen, views()[size_t(camera)]);
        if (data->used(capture)) {
            starts.insert(starts.begin(), state->T_left_board[capture]);
        }
        return assess.explain(views(), camera == LEFT, camera == RIGHT, starts);
    }

    void settle(const explanation &given) const {
        state->T_left_board[capture] = given.T_left_board;
    }

    void one(int camera, const explanation &given) const {
        bundle_view &view = views()[size_t(camera)];
        if (given.cost >= 0 && given.right[camera]) {
            accept(given, camera, &view);
            record(camera).reason.clear();
            settle(given);
        } else {
            view.used = false;
            record(camera).reason = garbage_reason(view, given, camera);
        }
    }

    bool both(const std::vector<rigid> &starts, const std::string &reason) const {
        INVARIANT(!starts.empty() && has(LEFT) && has(RIGHT));
        const explanation given = assess.explain(views(), true, true, starts);
        if (given.cost < 0 || !given.right[LEFT] || !given.right[RIGHT]) {
            return false;
        }
        for (int camera = 0; camera < CAMERAS; camera++) {
            accept(given, camera, &views()[size_t(camera)]);
            record(camera).reason.clear();
        }
        record(RIGHT).reason = reason;
        settle(given);
        return true;
    }

    // Each view is consistent, but they disagree with each other.
    void disagreement(const explanation &left, const explanation &right) const {
        const mismatch found =
            explain_mismatch(*data, *state, capture, target, left.T_left_board, right.T_left_board);
        if (found.half_turn && target.looks_same_turned()) {
            bundle_view &view = views()[RIGHT];
            const bundle_view before = view;
            renumber_turned(*data, &view);
            if (both({left.T_left_board}, found.reason)) {
                record(RIGHT).turned = !record(RIGHT).turned;
                fit_homography(*data, view, &record(RIGHT).seen);
                return;
            }
            view = before;
        }
        for (int camera = 0; camera < CAMERAS; camera++) {
            views()[size_t(camera)].used = false;
            record(camera).reason = found.reason;
        }
    }

    void run() const {
        if (has(LEFT) && has(RIGHT)) {
            const std::string turned = record(RIGHT).turned ? record(RIGHT).reason : "";
            if (data->used(capture) && both({state->T_left_board[capture]}, turned)) {
                return;
            }
            const explanation left = alone(LEFT), right = alone(RIGHT);
            if (both({left.T_left_board, right.T_left_board}, turned)) {
                return;
            }
            if (left.right[LEFT] && right.right[RIGHT]) {
                disagreement(left, right);
                return;
            }
            one(LEFT, left);
            one(RIGHT, right);
        } else if (has(LEFT) || has(RIGHT)) {
            const int camera = has(LEFT) ? LEFT : RIGHT;
            one(camera, alone(camera));
        }
    }
};

// The set of used corners, to detect a change.
std::vector<char> used_pattern(const bundle &data) {
    std::vector<char> pattern;
    for (const auto &capture : data.captures) {
        for (const bundle_view &view : capture) {
            pattern.push_back(view.used);
            for (const bundle_corner &corner : view.corners) {
                pattern.push_back(view.used && corner.used);
            }
        }
    }
    return pattern;
}

}  // namespace

view_records inspect_views(bundle *data) {
    view_records records(data->captures.size());
    for (size_t i = 0; i < records.size(); i++) {
        for (int camera = 0; camera < data->cameras; camera++) {
            bundle_view &view = data->captures[i][size_t(camera)];
            view_record &record = records[i][size_t(camera)];
            view.used = false;
            if (view.empty()) {
                continue;
            }
            if (int(view.corners.size()) < MIN_CORNERS) {
                record.reason = "only " + std::to_string(view.corners.size()) + " corners visible";
            } else if (!fit_homography(*data, view, &record.seen)) {
                record.reason = "all corners are on one line";
            } else if (record.seen.mirrored &&
                       record.seen.misfit_px < GARBAGE * record.seen.extent_px) {
                record.reason = "its corners are numbered in mirrored order";
            } else {
                record.assessed = true;
                view.used = record.seen.misfit_px < GARBAGE * record.seen.extent_px;
            }
        }
    }
    return records;
}

double robust_scale(const bundle &data, const bundle_state &state) {
    std::vector<double> lengths;
    for_used_residuals(data, state, [&](const bundle_corner &corner, const double *residual_px) {
        lengths.push_back(std::hypot(residual_px[0], residual_px[1]) / corner.sigma_px);
    });
    return lengths.empty() ? 1 : std::max(1e-9, median_of(&lengths) / MEDIAN_RADIUS);
}

double blunder_limit(size_t count) {
    // The length of a two-dimensional gaussian exceeds L sigmas with probability exp(-L^2 / 2).
    return std::sqrt(2 * std::log(1e5 * double(std::max<size_t>(count, 1))));
}

bool assess(bundle *data, bundle_state *state, const board &target, double scale,
            view_records *records) {
    INVARIANT(records->size() == data->captures.size());
    INVARIANT(state->T_left_board.size() == data->captures.size());
    size_t count = 0;
    for (const auto &capture : data->captures) {
        count += capture[LEFT].corners.size() + capture[RIGHT].corners.size();
    }
    const std::vector<char> before = used_pattern(*data);
    const view_assessor assessor(*data, *state, scale, blunder_limit(count));
    for (size_t i = 0; i < data->captures.size(); i++) {
        trial{assessor, data, state, target, i, &(*records)[i]}.run();
    }
    return used_pattern(*data) != before;
}

}  // namespace calib
