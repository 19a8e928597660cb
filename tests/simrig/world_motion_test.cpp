// SPDX-License-Identifier: Apache-2.0
// Frames of a camera that moves.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <vector>

#include "tests/simrig/world_harness.hpp"

using namespace world_harness;

namespace {

// Root of the mean squared difference of two frames, and the same of means over 8 x 8 pixels of
// one colour.
std::array<double, 2> differences(const std::vector<double> &a, const std::vector<double> &b,
                                  int columns, int rows) {
    double one = 0, of_blocks = 0;
    for (int top = 0; top < rows; top += 16) {
        for (int left = 0; left < columns; left += 16) {
            for (int colour = 0; colour < 4; colour++) {
                double sum = 0;
                for (int i = 0; i < 64; i++) {
                    const int y = top + 2 * (i / 8) + colour / 2;
                    const int x = left + 2 * (i % 8) + colour % 2;
                    const auto at = static_cast<std::size_t>(y * columns + x);
                    const double off = a[at] - b[at];
                    one += off * off;
                    sum += off / 64;
                }
                of_blocks += 64 * sum * sum;
            }
        }
    }
    return {std::sqrt(one / (columns * rows)), std::sqrt(of_blocks / (columns * rows))};
}

std::vector<double> pixels_of(const world::Scene &scene, const world::Rig &rig,
                              const world::FrameRequest &request) {
    const world::Frame frame = world::render(scene, rig, world::Side::kLeft, request);
    return {frame.pixels.begin(), frame.pixels.end()};
}

}  // namespace

TEST_CASE("a frame of a moving lens is the mean of the states that it passed through") {
    const world::Scene scene = world::load_scene(file("scenes/cylinder.yaml"));
    const world::Rig rig = world::load_rig(file("rigs/default.yaml"));
    struct Case {
        const char *name;
        world::Mechanics from, to;  // at the beginning and at the end of 12 ms
    };
    const auto at = [&](double zoom, double focus_mm, double iris, double pan_rad) {
        world::Mechanics m = straight(rig, zoom, focus_mm, iris);
        m.pan_rad = pan_rad;
        return m;
    };
    const double pan = 0.06;
    const Case cases[] = {
        {"focus, far from sharp", at(460, 900, 850, pan), at(460, 940, 850, pan)},
        {"focus, through sharp", at(460, 1720, 850, pan), at(460, 1880, 850, pan)},
        {"iris", at(460, 1300, 850, pan), at(460, 1300, 780, pan)},
        {"zoom", at(460, 1800, 700, pan), at(470, 1800, 700, pan)},
        {"pan", at(460, 1800, 700, pan), at(460, 1800, 700, pan + 0.01)},
    };
    for (const Case &c : cases) {
        world::FrameRequest request;
        request.window = {784, 656, 64, 64, 1, 1, 1, 1};
        request.row_time_us = 1;  // all rows see the same
        request.exposure_us = 10000;
        request.mechanics = [&](double time_us) {
            const double part = time_us / 12000;
            const auto mix = [part](double a, double b) { return a + part * (b - a); };
            world::Mechanics m = c.from;
            m.pan_rad = mix(c.from.pan_rad, c.to.pan_rad);
            m.zoom = mix(c.from.zoom, c.to.zoom);
            m.focus = mix(c.from.focus, c.to.focus);
            m.iris = mix(c.from.iris, c.to.iris);
            return m;
        };
        const std::vector<double> moving = pixels_of(scene, rig, request);
        constexpr int kStates = 24;
        std::vector<double> mean(moving.size(), 0.0);
        std::vector<double> still[2];
        for (int i = 0; i < kStates; i++) {
            world::FrameRequest one = request;
            const double middle_us = request.exposure_us * (i + 0.5) / kStates + 32;
            one.mechanics = [&](double) { return request.mechanics(middle_us); };
            one.frame = 100 + static_cast<std::uint64_t>(i);
            const std::vector<double> pixels = pixels_of(scene, rig, one);
            for (std::size_t n = 0; n < mean.size(); n++) {
                mean[n] += pixels[n] / kStates;
            }
            if (i == kStates / 2) {
                still[0] = pixels;
                one.frame = 1000;
                still[1] = pixels_of(scene, rig, one);
            }
        }
        const auto noise = differences(still[0], still[1], 64, 64);
        const auto off = differences(moving, mean, 64, 64);
        const double expected = std::sqrt(0.5 * (1 + 1.0 / kStates));
        MESSAGE(std::string(c.name)
                << ": " << off[0] / (expected * noise[0]) << " of the noise, of means "
                << off[1] / (expected * noise[1]));
        CHECK(off[0] < 1.2 * expected * noise[0]);
        CHECK(off[1] < 2 * expected * noise[1]);
    }
}
