// SPDX-License-Identifier: Apache-2.0
#include "tests/zoom/rendered.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "stereo/zoom/refine_pair.h"
#include "tools/simrig/render/frame.hpp"

namespace zoom_study {
namespace {

constexpr int kWidth = world::kArrayColumns / 2, kHeight = world::kArrayRows / 2;

const world::Scene &cylinder() {
    static const world::Scene scene =
        world::load_scene(std::string(SIMRIG_FILES) + "/scenes/cylinder.yaml");
    return scene;
}

// Means of the mosaic's four, in 8 bits, exposed so that most of the picture is below white.
std::vector<uint8_t> grey_of(StudyRig &rig, int side, uint64_t frame_number) {
    world::FrameRequest request;
    const world::Mechanics still = rig.mechanics(side);
    request.mechanics = [still](double) { return still; };
    const double n = rig.camera(side).optics.f_number;
    request.exposure_us = 3000 * n * n;
    request.frame = frame_number;
    const world::Frame frame = world::render(cylinder(), rig.world(), world::Side(side), request);
    std::vector<uint8_t> grey(size_t(kWidth) * kHeight);
    for (int y = 0; y < kHeight; y++) {
        for (int x = 0; x < kWidth; x++) {
            const uint16_t *at =
                &frame.pixels[size_t(2 * y) * size_t(frame.columns) + size_t(2 * x)];
            const int sum = at[0] + at[1] + at[frame.columns] + at[frame.columns + 1];
            grey[size_t(y) * kWidth + size_t(x)] = uint8_t(std::clamp((sum - 4 * 42) / 15, 0, 255));
        }
    }
    return grey;
}

}  // namespace

void try_rendered(const zoom_calibration &calibration, StudyRig &rig, simrig::Noise &noise,
                  Rendered &result) {
    const Moment moment = moment_of(rig);
    std::vector<uint8_t> grey[2];
    refine_picture picture = {};
    picture.axes = moment.state;
    picture.depth_near_mm = 800;
    picture.depth_far_mm = INFINITY;
    for (int side = 0; side < 2; side++) {
        grey[side] = grey_of(rig, side, noise.next() % 1000000);
        picture.grey[side] = {grey[side].data(), kWidth, kHeight, kWidth};
        // The middle of a mosaic's four is half a pixel further.
        picture.window[side] = {1, 1, 2};
    }
    Memory memory(self_calibration_need_bytes(1) + refine_pair_need_bytes(kWidth, kHeight));
    self_calibration self = begin(calibration, {moment.state}, memory);
    refine_report report;
    const double begin_s = cpu_s();
    if (refine_pair(&picture, &memory.pool, &self, &report) != 0) {
        throw std::runtime_error("a pair cannot be refined");
    }
    result.seconds.add(cpu_s() - begin_s);
    result.matches.add(report.matches);
    result.used.add(report.used);
    result.noise_px.add(report.noise_px);
    judge(moment, self, 0, noise, report.health != REFINE_GOOD, result.frames);
}

}  // namespace zoom_study
