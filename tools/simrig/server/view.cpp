// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/view.hpp"

#include <fstream>
#include <stdexcept>

#include "tools/simrig/world/picture.hpp"

namespace simrig {

namespace {

constexpr double kMostZoom = 10;
constexpr double kWide = 300, kTele = 850;
const char *const kNames[] = {"left", "right"};

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
        mechanics.zoom = kWide + (kTele - kWide) * (zoom - 1) / (kMostZoom - 1);
        mechanics.focus = world::focus_position_for(camera.lens, mechanics.zoom, focus_mm);
        mechanics.iris = kTele;
    }
    return view;
}

void write_view(const world::Scene &scene, const world::Rig &rig, const View &view,
                const std::string &prefix, const std::function<void(int)> &done) {
    const auto tell = [&done](int files) {
        if (done) {
            done(files);
        }
    };
    write_text(prefix + "rig.svg", rig_drawing(scene, rig, view));
    for (size_t side = 0; side < view.mechanics.size(); side++) {
        tell(int(side) + 1);
        world::FrameRequest request;
        request.mechanics = [&view, side](double) { return view.mechanics[side]; };
        request.seed = view.seed;
        request.threads = view.threads;
        const world::Frame frame = world::render(scene, rig, world::Side(side), request);
        world::write_png(prefix + kNames[side] + ".png",
                         world::developed(frame, rig.of(world::Side(side)).sensor, 1));
    }
    tell(kViewFiles);
}

}  // namespace simrig
