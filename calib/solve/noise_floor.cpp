// SPDX-License-Identifier: Apache-2.0
#include "calib/solve/noise_floor.hpp"

#include <algorithm>
#include <cmath>

#include "calib/solve/robust.hpp"
#include "core/invariant.h"

namespace calib {

namespace {

const double EXPLAINED = 1.3;  // ratio of residuals to expected noise up to which there is no floor
const int HALVINGS = 40;

template <class Bundle, class Call>
void for_all_corners(Bundle &data, const Call &call) {
    for (size_t i = 0; i < data.captures.size(); i++) {
        for (int camera = 0; camera < CAMERAS; camera++) {
            for (auto &corner : data.captures[i][size_t(camera)].corners) {
                call(i, camera, corner);
            }
        }
    }
}

struct measured {
    double length_px, given_px;
};

// Median length in standard deviations, over that of gaussian noise.
double scale_of(const std::vector<measured> &all, double floor_px) {
    std::vector<double> lengths;
    lengths.reserve(all.size());
    for (const measured &one : all) {
        lengths.push_back(one.length_px / std::hypot(one.given_px, floor_px));
    }
    INVARIANT(!lengths.empty() && floor_px >= 0);
    const auto middle = lengths.begin() + long(lengths.size() / 2);
    std::nth_element(lengths.begin(), middle, lengths.end());
    return *middle / std::sqrt(2 * std::log(2.0));
}

}  // namespace

noise_floor::noise_floor(const bundle &data) {
    for_all_corners(data, [&](size_t, int, const bundle_corner &corner) {
        given_px_.push_back(corner.sigma_px);
    });
}

void noise_floor::update(const bundle_state &state, double freedom_share, bundle *data) {
    INVARIANT(freedom_share > 0 && freedom_share <= 1);
    std::vector<measured> all;
    size_t place = 0;
    double longest_px = 0;
    for_all_corners(*data, [&](size_t i, int camera, const bundle_corner &corner) {
        const double given_px = given_px_[place++];
        double residual[2];
        if (data->captures[i][size_t(camera)].used && corner.used &&
            corner_residual(*data, camera, corner, state, state.T_left_board[i], residual)) {
            const double length_px =
                std::hypot(residual[0], residual[1]) / std::sqrt(freedom_share);
            all.push_back({length_px, given_px});
            longest_px = std::max(longest_px, length_px);
        }
    });
    INVARIANT(place == given_px_.size());
    double min = 0, max = 0;
    ratio_ = all.empty() ? 1 : scale_of(all, 0);
    if (ratio_ > EXPLAINED) {
        max = longest_px;
        for (int k = 0; k < HALVINGS; k++) {
            const double middle = (min + max) / 2;
            (scale_of(all, middle) > 1 ? min : max) = middle;
        }
    }
    floor_px_ = max;
    INVARIANT(floor_px_ >= 0 && min <= max);
    place = 0;
    for_all_corners(*data, [&](size_t, int, bundle_corner &corner) {
        corner.sigma_px = std::hypot(given_px_[place++], floor_px_);
    });
}

}  // namespace calib
