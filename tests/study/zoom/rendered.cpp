// SPDX-License-Identifier: Apache-2.0
#include "tests/study/zoom/rendered.hpp"

#include <cmath>
#include <stdexcept>

#include "stereo/zoom/wide_pair.h"
#include "tests/study/zoom/rendered_board.hpp"
#include "tools/simrig/render/frame.hpp"

namespace zoom_study {
namespace {

constexpr int kWidth = world::kArrayColumns, kHeight = world::kArrayRows;

const world::Scene &cylinder() {
    static const world::Scene scene =
        world::load_scene(std::string(SIMRIG_FILES) + "/scenes/cylinder.yaml");
    return scene;
}

// Developed as the daemon does.
std::vector<uint8_t> grey_of(StudyRig &rig, int side, uint64_t frame_number) {
    world::FrameRequest request;
    const world::Mechanics still = rig.mechanics(side);
    request.mechanics = [still](double) { return still; };
    const double n = rig.camera(side).optics.f_number;
    request.exposure_us = 3000 * n * n;
    request.frame = frame_number;
    return develop_grey(world::render(cylinder(), rig.world(), world::Side(side), request));
}

// Finds corners and matches as `adjust_pair` does, before and after it has corrected `adjustment`.
double matching_seconds(const adjust_picture &picture, const adjustment &before,
                        const adjustment &after, Memory &memory) {
    const double begin_s = cpu_s();
    sparse_picture corners[2];
    std::vector<sparse_pair> pairs(SPARSE_LEFT_MAX);
    if (sparse_picture_make(&picture.grey[0], SPARSE_LEFT_MAX, &memory.pool, &corners[0]) != 0 ||
        sparse_picture_make(&picture.grey[1], SPARSE_RIGHT_MAX, &memory.pool, &corners[1]) != 0) {
        throw std::runtime_error("a pair has no corners");
    }
    for (const adjustment *adjustment : {&before, &after}) {
        adjust_expectation expectation = {&picture, adjustment, 3.0 * corners[1].factor};
        (void)sparse_match(&corners[0], &corners[1], adjust_expect, adjust_expect_serve,
                           &expectation, &memory.pool, pairs.data());
    }
    return cpu_s() - begin_s;
}

adjust_picture picture_of(RenderedPair &pair, int state) {
    adjust_picture picture = {};
    picture.axes = pair.moment.state;
    picture.state = state;
    picture.depth_near_mm = 800;
    picture.depth_far_mm = INFINITY;
    for (int side = 0; side < 2; side++) {
        picture.grey[side] = {pair.grey[side].data(), kWidth, kHeight, kWidth};
        picture.window[side] = {0, 0, 1};
    }
    return picture;
}

}  // namespace

RenderedPair render_pair(StudyRig &rig, simrig::Noise &noise) {
    RenderedPair pair;
    pair.moment = moment_of(rig);
    for (int side = 0; side < 2; side++) {
        pair.grey[side] = grey_of(rig, side, noise.next() % 1000000);
    }
    return pair;
}

void try_rendered(const zoom_calibration &calibration, RenderedPair &pair, simrig::Noise &noise,
                  Rendered &result) {
    const zoom_state &state = pair.moment.state;
    const adjust_picture picture = picture_of(pair, 0);
    Memory memory(adjustment_need_bytes(1) + adjust_pair_need_bytes(kWidth, kHeight));
    adjustment adjustment = begin(calibration, {state}, memory);
    adjust_report report;
    const double begin_s = cpu_s();
    if (adjust_pair(&picture, &memory.pool, &adjustment, &report) != 0) {
        throw std::runtime_error("a pair cannot be adjusted");
    }
    const double seconds = cpu_s() - begin_s;
    Memory again(adjustment_need_bytes(1) + adjust_pair_need_bytes(kWidth, kHeight));
    const struct adjustment before = begin(calibration, {state}, again);
    result.seconds.add(seconds);
    result.refining_seconds.add(seconds - matching_seconds(picture, before, adjustment, again));
    result.matches.add(report.matches);
    result.used.add(report.used);
    result.noise_px.add(report.noise_px);
    judge(pair.moment, adjustment, 0, noise, report.health == ADJUST_CALIBRATE, result.frames);
}

void try_rendered_wide_pair(const zoom_calibration &calibration, RenderedPair &wide,
                            RenderedPair &narrow, simrig::Noise &noise, RenderedWidePair &result) {
    const adjust_picture pictures[2] = {picture_of(wide, 0), picture_of(narrow, 1)};
    Memory memory(adjustment_need_bytes(2) + wide_pair_need_bytes(kWidth, kHeight));
    adjustment adjustment = begin(calibration, {wide.moment.state, narrow.moment.state}, memory);
    wide_pair_report report;
    const double begin_s = cpu_s();
    if (wide_pair_adjust(pictures, &memory.pool, &adjustment, &report) != 0) {
        throw std::runtime_error("two pairs cannot be adjusted");
    }
    result.seconds.add(cpu_s() - begin_s);
    result.carried.add(report.carried);
    result.carried_px.add(report.carried_px);
    judge(wide.moment, adjustment, 0, noise, report.pair[0].health == ADJUST_CALIBRATE,
          result.wide);
    judge(narrow.moment, adjustment, 1, noise, report.pair[1].health == ADJUST_CALIBRATE,
          result.narrow);
}

}  // namespace zoom_study
