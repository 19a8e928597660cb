// SPDX-License-Identifier: Apache-2.0
#include "calib/solve/solve_input.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/invariant.h"

namespace calib {

namespace {

const double SIGMA_UNKNOWN_PX = 0.1;

std::string check_view(const observations &seen, const board_view &view, int camera) {
    int last = -1;
    for (const corner &one : view.corners) {
        if (one.index <= last || one.index >= seen.target.corner_count()) {
            return "corner numbers are not ascending or outside the board";
        }
        last = one.index;
        const double margin =
            std::max(seen.width_px[size_t(camera)], seen.height_px[size_t(camera)]);
        if (!std::isfinite(one.x_px) || !std::isfinite(one.y_px) || !std::isfinite(one.sigma_px) ||
            std::fabs(one.x_px) > 2 * margin || std::fabs(one.y_px) > 2 * margin) {
            return "a corner is far outside its image";
        }
    }
    return "";
}

// Any total order of the contents of two positions will do.
int compare_views(const board_view &a, const board_view &b) {
    if (a.corners.size() != b.corners.size()) {
        return a.corners.size() < b.corners.size() ? -1 : 1;
    }
    for (size_t i = 0; i < a.corners.size(); i++) {
        const double left[3] = {double(a.corners[i].index), a.corners[i].x_px, a.corners[i].y_px};
        const double right[3] = {double(b.corners[i].index), b.corners[i].x_px, b.corners[i].y_px};
        for (int k = 0; k < 3; k++) {
            if (left[k] != right[k]) {
                return left[k] < right[k] ? -1 : 1;
            }
        }
    }
    return 0;
}

// Sorted by image content before names: the same pictures give the same bytes, whatever their
// names.
bool is_before(const capture &a, const capture &b) {
    for (size_t camera = 0; camera < CAMERAS; camera++) {
        const int order = compare_views(a.view[camera], b.view[camera]);
        if (order != 0) {
            return order < 0;
        }
    }
    return a.name < b.name;
}

bool is_valid_board(const board &target) {
    return target.columns >= 2 && target.rows >= 2 && target.columns <= 255 && target.rows <= 255 &&
           target.square_mm > 0 && std::isfinite(target.square_mm);
}

}  // namespace

std::string check_observations(const observations &seen) {
    if (!is_valid_board(seen.target)) {
        return "the board needs 2 to 255 inner corners each way and a square larger than 0 mm";
    }
    if (seen.cameras < 1 || seen.cameras > CAMERAS) {
        return "one or two cameras can be calibrated";
    }
    for (int camera = 0; camera < seen.cameras; camera++) {
        const int width = seen.width_px[size_t(camera)], height = seen.height_px[size_t(camera)];
        if (width < 1 || height < 1 || width > LENS_SIDE_MAX_PX || height > LENS_SIDE_MAX_PX) {
            return "the image size is not known";
        }
        for (const capture &one : seen.captures) {
            const std::string fault = check_view(seen, one.view[size_t(camera)], camera);
            if (!fault.empty()) {
                return one.name[size_t(camera)] + ": " + fault;
            }
        }
    }
    return "";
}

ordered_bundle order_observations(const observations &seen) {
    ordered_bundle result;
    result.caller.resize(seen.captures.size());
    std::iota(result.caller.begin(), result.caller.end(), size_t(0));
    std::stable_sort(result.caller.begin(), result.caller.end(), [&](size_t a, size_t b) {
        return is_before(seen.captures[a], seen.captures[b]);
    });
    bundle &data = result.data;
    data.cameras = seen.cameras;
    INVARIANT(data.cameras == 1 || data.cameras == CAMERAS);
    data.points = make_board_points(seen.target, data.half_mm);
    for (int camera = 0; camera < seen.cameras; camera++) {
        data.frame[camera] =
            make_lens_frame(seen.width_px[size_t(camera)], seen.height_px[size_t(camera)]);
    }
    for (const size_t place : result.caller) {
        data.captures.emplace_back();
        for (int camera = 0; camera < seen.cameras; camera++) {
            const board_view &from = seen.captures[place].view[size_t(camera)];
            bundle_view &view = data.captures.back()[size_t(camera)];
            view.overexposed = from.overexposed();
            for (const corner &one : from.corners) {
                const double sigma_px = one.sigma_px > 0 ? one.sigma_px : SIGMA_UNKNOWN_PX;
                view.corners.push_back({one.index, one.x_px, one.y_px, sigma_px, true});
            }
        }
    }
    INVARIANT(data.captures.size() == seen.captures.size());
    return result;
}

}  // namespace calib
