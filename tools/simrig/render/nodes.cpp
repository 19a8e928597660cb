// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/render/nodes.hpp"

#include <algorithm>
#include <cmath>

namespace world {
namespace {

// A disk of this many pitches passes no wave that the cubic would not follow.
constexpr double kBlurPitches = 2;
constexpr int kClosestPitch = 4, kWidestPitch = 8;
constexpr int kRaysPerPixel = 4;

// Catmull and Rom: places -1, 0, 1, 2 for a place between 0 and 1. It adds no blur of its own.
std::array<double, 4> cubic_weights(double t) {
    return {0.5 * t * (-1 + t * (2 - t)), 0.5 * (2 + t * t * (-5 + 3 * t)),
            0.5 * t * (1 + t * (4 - 3 * t)), 0.5 * t * t * (t - 1)};
}

}  // namespace

Nodes::Nodes(const Scene &scene, const RigCamera &rig_camera, const FrameRequest &request,
             std::function<View(Vec2 pixel)> view_at, std::uint64_t key)
    : scene_(scene),
      rig_camera_(rig_camera),
      request_(request),
      view_at_(std::move(view_at)),
      key_(key) {}

int Nodes::pitch_for(double blur_px) {
    int pitch = kWidestPitch;
    while (pitch >= kClosestPitch && blur_px < kBlurPitches * pitch) {
        pitch /= 2;
    }
    return pitch >= kClosestPitch ? pitch : 0;
}

double Nodes::luminance(Vec2 pixel, int channel, int pitch) {
    const Vec2 at = (1.0 / pitch) * pixel;
    const Vec2 first = {std::floor(at.x), std::floor(at.y)};
    const std::array<double, 4> across = cubic_weights(at.x - first.x);
    const std::array<double, 4> down = cubic_weights(at.y - first.y);
    double sum = 0;
    for (int j = 0; j < 4; j++) {
        for (int i = 0; i < 4; i++) {
            sum += down[static_cast<std::size_t>(j)] * across[static_cast<std::size_t>(i)] *
                   node(pitch, static_cast<int>(first.x) + i - 1, static_cast<int>(first.y) + j - 1)
                       .channel[channel];
        }
    }
    return std::max(sum, 0.0);
}

const Colour &Nodes::node(int pitch, int column, int row) {
    const std::uint64_t place = (static_cast<std::uint64_t>(pitch) << 48) |
                                (static_cast<std::uint64_t>(column + 4096) << 24) |
                                static_cast<std::uint64_t>(row + 4096);
    const auto known = nodes_.find(place);
    if (known != nodes_.end()) {
        return known->second;
    }
    return nodes_.emplace(place, seen(pitch, column * pitch, row * pitch)).first->second;
}

Colour Nodes::seen(int pitch, int x, int y) {
    const int row = std::clamp(y - request_.window.row, 0, request_.window.output_rows() - 1);
    Motion &motion =
        rows_.try_emplace(row, scene_, rig_camera_, request_, row, row + 1).first->second;
    const Vec2 pixel = {static_cast<double>(x), static_cast<double>(y)};
    const View view = view_at_(pixel);
    const auto look = [&](State &state) {
        find_candidates(scene_, state.object_camera,
                        beam_of(state.camera, pixel, pixel, view.with_spot->reach() - 0.5),
                        state.candidates);
    };
    look(motion.states(1)[0]);
    std::vector<State> &states =
        motion.states(motion.moments(pixel, motion.states(1)[0].candidates));
    std::vector<PixelMoment> moments(states.size());
    for (std::size_t i = 0; i < states.size(); i++) {
        look(states[i]);
        moments[i].view = pixel_view(states[i].camera, pixel, states[i].camera.slopes_of(pixel));
        moments[i].candidates = &states[i].candidates;
    }
    PixelTask task;
    task.moments = &moments;
    task.key = mixed(mixed(key_, 3), static_cast<std::uint64_t>(y + 4096) << 32 |
                                         static_cast<std::uint64_t>(x + 4096));
    // The more pixels share a node the less may it be off.
    return area_luminance(view, task, kRaysPerPixel * pitch * pitch);
}

}  // namespace world
