// SPDX-License-Identifier: Apache-2.0
#include "calib/zoom/zoom_robust.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/solve/robust.hpp"
#include "calib/solve/seed_pose.hpp"
#include "core/invariant.h"

namespace calib {

namespace {

const double MAX_WRONG_SHARE = 0.25;
const double ALLOWED_WRONG = 4;  // corners in any view
const size_t MIN_CORNERS = 4;
const double MEDIAN_LENGTH = 1.17741;  // median length of a two-dimensional Gaussian, in sigmas

std::string px_text(double px) {
    char text[40];
    std::snprintf(text, sizeof text, "%.2f px", px);
    return text;
}

double median_of(std::vector<double> values) {
    INVARIANT(!values.empty());
    const auto middle = values.begin() + long(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

class view_judge {
  public:
    view_judge(const zoom_problem &problem, const zoom_layout &layout,
               const zoom_estimate &estimate, double limit)
        : problem_(problem), layout_(layout), estimate_(estimate), limit_(limit) {}

    void judge(size_t capture, int camera, bundle_view *view,
               std::vector<zoom_rejection> *rejections) const {
        const posed_camera posed = fitted_camera(problem_, layout_, estimate_, capture, camera);
        std::vector<double> off_px;
        size_t wrong = 0;
        for (bundle_corner &corner : view->corners) {
            double r[2];
            const bool seen =
                zoom_residual(problem_, layout_, estimate_, posed, capture, camera, corner, r);
            off_px.push_back(seen ? std::hypot(r[0], r[1]) : INFINITY);
            corner.used = off_px.back() <= limit_ * corner.sigma_px;
            wrong += !corner.used;
        }
        const size_t count = view->corners.size();
        view->used = count >= MIN_CORNERS &&
                     double(wrong) <= std::max(ALLOWED_WRONG, MAX_WRONG_SHARE * double(count)) &&
                     count >= MIN_CORNERS + 2 * wrong;
        if (!view->used && count > 0) {
            rejections->push_back({capture, camera, -1, median_of(off_px),
                                   reason_of(capture, camera, *view, posed, median_of(off_px))});
        }
        for (size_t i = 0; i < count && view->used; i++) {
            if (!view->corners[i].used) {
                rejections->push_back({capture, camera, view->corners[i].index, off_px[i],
                                       "corner off by " + px_text(off_px[i])});
            }
        }
    }

  private:
    // Whether the corners are those of a board at any place, as this camera sees them.
    bool fits_alone(size_t capture, int camera, const bundle_view &view,
                    const posed_camera &posed) const {
        bundle alone = problem_.boards[problem_.captures[capture].board][size_t(camera)];
        alone.cameras = 1;
        bundle_state state;
        state.lens[LEFT] = posed.lens;
        both_views views;
        views[LEFT] = view;
        views[LEFT].used = true;
        for (bundle_corner &corner : views[LEFT].corners) {
            corner.used = true;
        }
        rigid pose = posed.T_camera_instrument *
                     estimate_.T_instrument_board[problem_.captures[capture].place];
        const double loss = fit_pose_either_way(alone, views, state, 3, &pose);
        return loss >= 0 && loss < 0.25 * limit_ * limit_;
    }

    std::string reason_of(size_t capture, int camera, const bundle_view &view,
                          const posed_camera &posed, double off_px) const {
        if (view.corners.size() < MIN_CORNERS) {
            return "too few corners";
        }
        if (!std::isfinite(off_px) || !fits_alone(capture, camera, view, posed)) {
            return "its corners are not those of this board: another board, or numbered wrongly";
        }
        return px_text(off_px) +
               " from where the other pictures show the board: the board, a camera or a lens "
               "moved, or it is another board";
    }

    const zoom_problem &problem_;
    const zoom_layout &layout_;
    const zoom_estimate &estimate_;
    const double limit_;
};

std::vector<bool> used_pattern(const zoom_problem &problem) {
    std::vector<bool> pattern;
    for (const zoom_problem::capture &capture : problem.captures) {
        for (const bundle_view &view : capture.view) {
            for (const bundle_corner &corner : view.corners) {
                pattern.push_back(view.used && corner.used);
            }
        }
    }
    return pattern;
}

}  // namespace

double zoom_robust_scale(const zoom_problem &problem, const zoom_layout &layout,
                         const zoom_estimate &estimate) {
    std::vector<double> lengths;
    for (size_t i = 0; i < problem.captures.size(); i++) {
        for (int camera = 0; camera < CAMERAS; camera++) {
            const bundle_view &view = problem.captures[i].view[size_t(camera)];
            const posed_camera posed = fitted_camera(problem, layout, estimate, i, camera);
            for (const bundle_corner &corner : view.corners) {
                double r[2];
                if (view.used && corner.used &&
                    zoom_residual(problem, layout, estimate, posed, i, camera, corner, r)) {
                    lengths.push_back(std::hypot(r[0], r[1]) / corner.sigma_px);
                }
            }
        }
    }
    return lengths.empty() ? 1 : median_of(lengths) / MEDIAN_LENGTH;
}

bool assess_zoom(zoom_problem *problem, const zoom_layout &layout, const zoom_estimate &estimate,
                 double scale, std::vector<zoom_rejection> *rejections) {
    const std::vector<bool> before = used_pattern(*problem);
    const view_judge judge(*problem, layout, estimate, blunder_limit(before.size()) * scale);
    rejections->clear();
    for (size_t i = 0; i < problem->captures.size(); i++) {
        for (int camera = 0; camera < CAMERAS; camera++) {
            judge.judge(i, camera, &problem->captures[i].view[size_t(camera)], rejections);
        }
    }
    return used_pattern(*problem) != before;
}

}  // namespace calib
