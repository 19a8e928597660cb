// SPDX-License-Identifier: Apache-2.0
#include "tests/study/zoom/trial.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <stdexcept>

#include "stereo/geometry/geometry.h"

namespace zoom_study {

double cpu_s() {
    return double(std::clock()) / CLOCKS_PER_SEC;
}

double Sample::rms() const {
    double sum = 0;
    for (const double value : values_) {
        sum += value * value;
    }
    return values_.empty() ? 0 : std::sqrt(sum / double(values_.size()));
}

double Sample::quantile(double part) const {
    std::vector<double> sizes;
    for (const double value : values_) {
        sizes.push_back(std::fabs(value));
    }
    std::sort(sizes.begin(), sizes.end());
    return sizes.empty() ? 0
                         : sizes[std::min(sizes.size() - 1, size_t(part * double(sizes.size())))];
}

double Sample::share_within(double limit) const {
    const auto count = std::count_if(values_.begin(), values_.end(),
                                     [=](double value) { return std::fabs(value) <= limit; });
    return values_.empty() ? 0 : double(count) / double(values_.size());
}

Moment moment_of(StudyRig &rig) {
    Moment moment;
    moment.state = rig.read();
    for (int side = 0; side < 2; side++) {
        moment.truth[side] = rig.camera(side);
    }
    return moment;
}

void zoom_both(StudyRig &rig, double focal_mm) {
    for (int side = 0; side < 2; side++) {
        const world::RigCamera &camera = rig.world().camera[side];
        const double counts = zoom_study::zoom_of_focal(camera, focal_mm);
        rig.set_lens(side, counts,
                     std::round(world::focus_position_for(camera.lens, counts, kDepthMm)));
    }
}

void move_about(StudyRig &rig, simrig::Noise &noise) {
    const auto uniform = [&noise](double low, double high) {
        return low + (high - low) * noise.uniform();
    };
    rig.wait(uniform(0, 6 * 3600));
    rig.turn(uniform(-0.15, 0.25), uniform(-0.25, 0.15));
    for (int side = 0; side < 2; side++) {
        rig.set_lens(side, uniform(310, 840), uniform(400, 800));
    }
    rig.turn(zoom_study::toe_in_rad(0, kDepthMm), zoom_study::toe_in_rad(1, kDepthMm));
}

namespace {

bool sees(const world::Camera &camera, const world::Vec3 &point, double noise_px,
          simrig::Noise &noise, double px[2]) {
    if ((world::inverse(camera.world_camera) * point).z < 100) {
        return false;
    }
    const world::Vec2 at = camera.project_world(point);
    px[0] = at.x + noise_px * noise.gauss();
    px[1] = at.y + noise_px * noise.gauss();
    return at.x > 4 && at.y > 4 && at.x < 2043 && at.y < 1531;
}

}  // namespace

std::vector<adjust_track> tracks_of(const std::vector<const Moment *> &moments, int first_state,
                                    double noise_px, int count, simrig::Noise &noise) {
    std::vector<adjust_track> tracks;
    const world::Camera &narrow = moments.back()->truth[0];
    for (int attempt = 0; attempt < 100 * count && int(tracks.size()) < count; attempt++) {
        const double z = kDepthMm - 150 + 300 * noise.uniform();
        const world::Vec2 slopes =
            narrow.slopes_of({2047 * noise.uniform(), 1535 * noise.uniform()});
        const world::Vec3 point = narrow.world_camera * world::Vec3{slopes.x * z, slopes.y * z, z};
        adjust_track track = {};
        track.sigma_px = noise_px;
        bool seen = true;
        for (size_t i = 0; i < moments.size(); i++) {
            for (int side = 0; side < 2; side++) {
                track.view[track.count] = adjust_view(first_state + int(i), side);
                seen = sees(moments[i]->truth[side], point, noise_px, noise,
                            track.pixel_px[track.count++]) &&
                       seen;
            }
        }
        if (seen) {
            tracks.push_back(track);
        }
    }
    return tracks;
}

namespace {

constexpr double kMiddle[2] = {1023.5, 767.5};

// Depth along the left camera's axis at which two views see a true point; its error.
double depth_error(const Moment &moment, const camera_view view[2], double column, double row,
                   double depth_mm) {
    const world::Camera &left = moment.truth[0];
    const world::Vec2 slopes = left.slopes_of({column, row});
    const world::Vec3 point =
        left.world_camera * world::Vec3{slopes.x * depth_mm, slopes.y * depth_mm, depth_mm};
    double ray[2][3], offset[3], seen[3];
    for (int side = 0; side < 2; side++) {
        const world::Vec2 at = moment.truth[side].project_world(point);
        const double px[2] = {at.x, at.y};
        if (!camera_view_ray(&view[side], px, ray[side])) {
            throw std::runtime_error("a view has no ray");
        }
    }
    geometry_midpoint middle;
    if (!geometry_rays_midpoint(view[0].position_mm, ray[0], view[1].position_mm, ray[1],
                                &middle)) {
        throw std::runtime_error("rays do not meet");
    }
    for (int i = 0; i < 3; i++) {
        offset[i] = middle.point_mm[i] - view[0].position_mm[i];
    }
    geometry_rotate_back(view[0].R_instrument_camera, offset, seen);
    return seen[2] - depth_mm;
}

}  // namespace

double depth_sigma_mm(const adjustment &adjustment, int state) {
    double gradient[ADJUST_TERMS_MAX];
    if (!adjustment_depth_gradient(&adjustment, state, kMiddle, kDepthMm, gradient)) {
        throw std::runtime_error("no gradient of depth");
    }
    return adjust_posterior_sigma(&adjustment, gradient);
}

void judge(const Moment &moment, const adjustment &adjustment, int state, simrig::Noise &noise,
           bool says, Result &result, double scale_sigma) {
    Sample rows;
    for (adjust_track &track : tracks_of({&moment}, state, 0, 200, noise)) {
        double residual_px = 0, derivative[2 * VIEW_TERMS];
        if (adjustment_track_epipolar(&adjustment, &track, &residual_px, derivative)) {
            rows.add(residual_px);
        }
    }
    result.rows_px.add(rows.quantile(0.5));
    const camera_view *view = &adjustment.view[adjust_view(state, 0)];
    const double sigma_mm = std::hypot(depth_sigma_mm(adjustment, state), scale_sigma * kDepthMm);
    const double error_mm = depth_error(moment, view, kMiddle[0], kMiddle[1], kDepthMm);
    result.depth_mm.add(error_mm);
    result.sigma_mm.add(sigma_mm);
    result.z.add(error_mm / sigma_mm);
    result.before_mm.add(depth_error(moment, &adjustment.nominal[adjust_view(state, 0)], kMiddle[0],
                                     kMiddle[1], kDepthMm));
    // Of a body of 100 mm: how much of its relief is wrong.
    result.relief.add((depth_error(moment, view, kMiddle[0], kMiddle[1], kDepthMm + 50) -
                       depth_error(moment, view, kMiddle[0], kMiddle[1], kDepthMm - 50)) /
                      100);
    result.trials++;
    result.calibrate += says;
    const bool beyond = std::fabs(error_mm) > 4 * sigma_mm;
    result.beyond += beyond;
    result.unsaid += beyond && !says;
}

BoardSeen board_of(const Moment &moment, double scale, double noise_px, simrig::Noise &noise) {
    BoardSeen board;
    const world::Mat3 turn = world::rotation_about({0, 1, 0}, 0.4);
    for (int i = 0; i < 70; i++) {
        const double x = (i % 10 - 4.5) * 24, y = (i / 10 - 3.0) * 24;
        const world::Vec3 point = moment.truth[0].world_camera * world::Vec3{0, 0, kDepthMm - 10} +
                                  turn * world::Vec3{scale * x, scale * y, 0};
        for (int side = 0; side < 2; side++) {
            target_observation observation = {side, int(board.points.size()), {}};
            if (sees(moment.truth[side], point, noise_px, noise, observation.pixel_px)) {
                board.observations.push_back(observation);
            }
        }
        board.points.push_back({x, y, 0});
    }
    return board;
}

adjustment begin(const zoom_calibration &calibration, const std::vector<zoom_state> &states,
                 Memory &memory) {
    adjustment adjustment;
    if (adjustment_begin(&calibration, states.data(), int(states.size()), &memory.pool,
                         &adjustment) != 0) {
        throw std::runtime_error("no memory");
    }
    return adjustment;
}

}  // namespace zoom_study
