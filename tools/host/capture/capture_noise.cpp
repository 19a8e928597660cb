// SPDX-License-Identifier: Apache-2.0
#include "tools/host/capture/capture_noise.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "tools/host/capture/capture_plan.hpp"

namespace {

// A board moved if the mean of its corners varies by more than this part of a corner's noise: that
// of independent corners varies by less than a third, as there are 12 or more.
const double moved_share = 0.5;
const double moved_px = 0.005;  // less is rounding and light

struct place {
    double x_px, y_px;
};

/// Places of the corners that every frame shows, frame after frame.
std::vector<std::vector<place>> in_all(const std::vector<capture_still> &stills, size_t side) {
    std::map<int, size_t> seen;
    for (const capture_still &still : stills) {
        for (const calib::corner &corner : still[side].corners) {
            seen[corner.index]++;
        }
    }
    std::vector<std::vector<place>> frames;
    for (const capture_still &still : stills) {
        std::map<int, place> places;
        for (const calib::corner &corner : still[side].corners) {
            if (seen[corner.index] == stills.size()) {
                places[corner.index] = {corner.x_px, corner.y_px};
            }
        }
        frames.emplace_back();
        for (const auto &[index, at] : places) {
            frames.back().push_back(at);
        }
    }
    return frames;
}

/// Mean squares along one axis: of a corner about its mean place and the motion of all, and of that
/// motion. It is a two-way analysis of variance, frames by corners.
struct spread {
    double corner = 0, all = 0;
};

spread spread_along(const std::vector<std::vector<place>> &frames, double place::*axis) {
    const double count = double(frames.size()), corners = double(frames[0].size());
    std::vector<double> of_frame(frames.size()), of_corner(frames[0].size());
    double mean = 0;
    for (size_t f = 0; f < frames.size(); f++) {
        for (size_t i = 0; i < frames[f].size(); i++) {
            const double value = frames[f][i].*axis;
            of_frame[f] += value / corners;
            of_corner[i] += value / count;
            mean += value / count / corners;
        }
    }
    spread result;
    for (size_t f = 0; f < frames.size(); f++) {
        const double moved = of_frame[f] - mean;
        result.all += moved * moved / (count - 1);
        for (size_t i = 0; i < frames[f].size(); i++) {
            const double rest = frames[f][i].*axis - of_corner[i] - moved;
            result.corner += rest * rest / (count - 1) / (corners - 1);
        }
    }
    return result;
}

}  // namespace

bool capture_noise_of(const std::vector<capture_still> &stills, session_corner_noise *noise) {
    *noise = {};
    if (stills.size() < 2) {
        return false;
    }
    for (size_t side = 0; side < 2; side++) {
        const auto frames = in_all(stills, side);
        if (frames[0].size() < CAPTURE_CORNERS_MIN) {
            return false;
        }
        const spread x = spread_along(frames, &place::x_px), y = spread_along(frames, &place::y_px);
        noise->px[side] = std::sqrt(x.corner + y.corner);
        if (std::sqrt(x.all + y.all) > std::max(moved_share * noise->px[side], moved_px)) {
            return false;
        }
    }
    noise->frames = static_cast<uint32_t>(stills.size());
    return true;
}
