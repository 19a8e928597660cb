// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/render/motion.hpp"

#include <algorithm>

namespace world {
namespace {

constexpr int kMostMoments = 16;
// Between two moments an image may move and its blur may grow by this, and by this part of the
// blur's radius: what a box of that width adds to the pixel's own second moment is 6 % of it.
constexpr double kStepPx = 0.25, kStepPart = 0.1;
constexpr double kRowsStepPx = 0.05;
// The depths that are possible for a block.
constexpr double kNearestMm = 100, kFarthestMm = 1e6;

// Radius of the blur of a depth, positive beyond the focus.
double signed_blur_px(const Camera &camera, double z_mm) {
    const Optics &o = camera.optics;
    return 0.5 * o.pupil_diameter_mm * o.focal_px * (1 / o.focus_distance_mm - 1 / z_mm);
}

// By how much the image of what one camera sees at a pixel and a depth has moved in another's.
double moved_px(const Camera &from, const Camera &to, Vec2 pixel, double z_mm) {
    const Vec2 slopes = from.slopes_of(pixel);
    const Vec3 place = from.world_camera * Vec3{z_mm * slopes.x, z_mm * slopes.y, z_mm};
    return length(to.project_world(place) - pixel);
}

}  // namespace

double row_start_us(const FrameRequest &request, int row) {
    return request.start_time_us + row * request.row_time_us;
}

Motion::Motion(const Scene &scene, const RigCamera &rig_camera, const FrameRequest &request,
               int row_begin, int row_end)
    : scene_(scene), rig_camera_(rig_camera), request_(request) {
    const double begin = row_start_us(request, row_begin);
    shutter_us_ = row_start_us(request, row_end - 1) - begin;
    start_us_ = begin + 0.5 * shutter_us_;
    duration_us_ = shutter_us_ + request.exposure_us;
    const auto steps = static_cast<int>(sampled_.size()) - 1;
    const Mechanics first = request.mechanics(begin);
    for (int i = 0; i <= steps; i++) {
        const Mechanics there = request.mechanics(begin + duration_us_ * i / steps);
        stands_ = stands_ && there == first;
        sampled_[static_cast<std::size_t>(i)] = camera_at(rig_camera, there);
    }
}

double Motion::change_px(Vec2 pixel, const Depths &depths) const {
    double sum = 0;
    for (std::size_t i = 1; i < sampled_.size(); i++) {
        const Camera &from = sampled_[i - 1], &to = sampled_[i];
        double step = 0;
        for (const double z : {depths.near_mm, depths.far_mm}) {
            step = std::max({step, moved_px(from, to, pixel, z),
                             std::fabs(signed_blur_px(to, z) - signed_blur_px(from, z))});
        }
        sum += step;
    }
    return sum;
}

bool Motion::rows_alike() const {
    const Window &w = request_.window;
    double most = 0;
    for (const Vec2 part : {Vec2{0, 0}, Vec2{1, 0}, Vec2{0, 1}, Vec2{1, 1}}) {
        const Vec2 corner = {w.column + part.x * w.columns, w.row + part.y * w.rows};
        most = std::max(most, stands_ ? 0 : change_px(corner, {1000, kFarthestMm}));
    }
    return most * shutter_us_ <= kRowsStepPx * duration_us_;
}

Motion::Depths Motion::depths_of(const std::vector<Candidate> &candidates) {
    Depths depths = {kFarthestMm, kNearestMm};
    for (const Candidate &candidate : candidates) {
        depths.near_mm = std::min(depths.near_mm, candidate.z_near);
        depths.far_mm = std::max(depths.far_mm, candidate.z_far);
    }
    depths.near_mm = std::clamp(depths.near_mm, kNearestMm, kFarthestMm);
    depths.far_mm = std::clamp(depths.far_mm, depths.near_mm, kFarthestMm);
    return depths;
}

double Motion::least_blur_px(const std::vector<Candidate> &candidates) const {
    const Depths depths = depths_of(candidates);
    double least = 1e30;
    for (const Camera &camera : sampled_) {
        const double near_px = signed_blur_px(camera, depths.near_mm);
        const double far_px = signed_blur_px(camera, depths.far_mm);
        least = std::min(
            least, near_px * far_px <= 0 ? 0 : std::min(std::fabs(near_px), std::fabs(far_px)));
    }
    return least;
}

int Motion::moments(Vec2 pixel, const std::vector<Candidate> &candidates) const {
    if (stands_ || candidates.empty()) {
        return 1;
    }
    const double allowed = kStepPx + kStepPart * least_blur_px(candidates);
    const double change = change_px(pixel, depths_of(candidates));
    int count = 1;
    while (count < kMostMoments && change > count * allowed) {
        count *= 2;
    }
    return count;
}

std::vector<State> &Motion::states(int count) {
    std::vector<State> &states = states_[count];
    for (int i = static_cast<int>(states.size()); i < count; i++) {
        State state;
        const double time_us = start_us_ + request_.exposure_us * (i + 0.5) / count;
        state.camera = camera_at(rig_camera_, request_.mechanics(time_us));
        for (int channel = 0; channel < 3; channel++) {
            state.colour[channel] = state.camera.of_colour(channel);
        }
        for (const auto &object : scene_.objects) {
            state.object_camera.push_back(object->object_world * state.camera.world_camera);
        }
        states.push_back(std::move(state));
    }
    return states;
}

}  // namespace world
