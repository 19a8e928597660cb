// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/view.hpp"

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <vector>

#include "tools/simrig/render/picture.hpp"

namespace simrig {

namespace {

constexpr double kMaxZoom = 10;
constexpr double kWide = 300, kTele = 850;
const char *const kNames[] = {"left", "right"};

// An exposure that leaves two percent of the pixels close to saturation.
constexpr double kTrialUs = 500, kMinUs = 50, kMaxUs = 200000;
constexpr int kTrialSkip = 16;
constexpr double kBrightPart = 0.98, kBrightDn = 800;

double exposure_for(const world::Scene &scene, const world::Rig &rig, world::Side side,
                    world::FrameRequest request) {
    request.window.skip_x = request.window.skip_y = kTrialSkip;
    const double black_dn = rig.of(side).sensor.black_level_dn;
    request.exposure_us = kTrialUs;
    // Twice: a dark trial is mostly noise, and a bright one is clipped at 1023.
    for (int round = 0; round < 3; round++) {
        std::vector<uint16_t> pixels = world::render(scene, rig, side, request).pixels;
        const auto bright = pixels.begin() + long(kBrightPart * double(pixels.size() - 1));
        std::nth_element(pixels.begin(), bright, pixels.end());
        const double factor = (kBrightDn - black_dn) / std::max(*bright - black_dn, 1.0);
        request.exposure_us = std::clamp(request.exposure_us * factor, kMinUs, kMaxUs);
    }
    return request.exposure_us;
}

void write_text(const std::string &path, const std::string &text) {
    std::ofstream file(path);
    file << text;
    file.close();
    if (!file) {
        throw std::runtime_error("cannot write " + path);
    }
}

}  // namespace

View view_at(const world::Rig &rig, double zoom, double focus_mm) {
    View view;
    for (size_t side = 0; side < view.mechanics.size(); side++) {
        const world::RigCamera &camera = rig.of(world::Side(side));
        world::Mechanics &mechanics = view.mechanics[side];
        mechanics.pan_rad = camera.pan_rad;
        mechanics.zoom = kWide + (kTele - kWide) * (zoom - 1) / (kMaxZoom - 1);
        mechanics.focus = world::focus_position_for(camera.lens, mechanics.zoom, focus_mm);
        mechanics.iris = kTele;
    }
    return view;
}

void write_view(const world::Scene &scene, const world::Rig &rig, const View &view,
                const std::string &prefix, const std::function<void(int)> &done) {
    const auto report = [&done](int files) {
        if (done) {
            done(files);
        }
    };
    write_text(prefix + "rig.svg", rig_drawing(scene, rig, view));
    for (size_t side = 0; side < view.mechanics.size(); side++) {
        report(int(side) + 1);
        world::FrameRequest request;
        request.mechanics = [&view, side](double) { return view.mechanics[side]; };
        request.seed = view.seed;
        request.threads = view.threads;
        request.exposure_us = exposure_for(scene, rig, world::Side(side), request);
        const world::Frame frame = world::render(scene, rig, world::Side(side), request);
        world::write_png(prefix + kNames[side] + ".png",
                         world::developed(frame, rig.of(world::Side(side)).sensor, 1));
    }
    report(kViewFiles);
}

}  // namespace simrig
