// SPDX-License-Identifier: Apache-2.0
// Accuracy and duration of lens moves with the motors of rigs/default.yaml: VERGENCE_DRAWS moves of
// both lenses at once, of one, and small ones. Source of the figures in firmware/rig/lens_move.h.
#include <doctest/doctest.h>

#include <cstdio>
#include <cstdlib>

#include "lens_bench.hpp"
#include "synthetic/seed.hpp"

using namespace motion;

namespace {

uint64_t draws(uint64_t default_value) {
    const char *text = std::getenv("VERGENCE_DRAWS");
    return text != nullptr ? std::strtoull(text, nullptr, 0) : default_value;
}

double part(std::vector<double> &values, double share) {
    std::sort(values.begin(), values.end());
    return values[size_t(share * double(values.size() - 1))];
}

struct Figures {
    std::vector<double> error;      // error of the ring, approached from above, counts
    std::vector<double> seconds;    // duration of the call
    std::vector<double> over;       // `seconds` minus the travel time at the motor's own speed
    std::vector<double> read_back;  // rig_lens_read against the motor
};

Figures run(unsigned sides, int32_t furthest, uint64_t seed) {
    // As in the rig file: zoom, focus, iris.
    std::array<LensWorld::Motors, 2> motors;
    for (LensWorld::Motors &side : motors) {
        const double speed[] = {200, 150, 180};
        for (size_t axis = 0; axis < side.size(); axis++) {
            side[axis].counts_per_s = speed[axis];
            side[axis].drift_counts_per_h = 0.5;
        }
    }
    simrig::Noise noise(seed);
    LensWorld world(motors, {{{300, 560, 850}, {300, 560, 850}}}, noise.next());
    LensRig lenses(world);
    REQUIRE(lenses.open() == ERROR_OK);
    int32_t at[LENS_AXES] = {300, 560, 850};
    Figures figures;
    for (uint64_t i = 0; i < draws(400); i++) {
        const lens_axis axis = lens_axis(noise.next() % 2);
        const int32_t step = int32_t(noise.next() % uint64_t(2 * furthest + 1)) - furthest;
        const int32_t target = std::clamp(at[axis] + step, 320, 840);
        const double begin_us = world.now_us();
        REQUIRE((furthest == 0 ? lenses.go_again(sides, axis, target)
                               : lenses.go(sides, axis, target)) == ERROR_OK);
        const double took_s = (world.now_us() - begin_us) * 1e-6;
        figures.seconds.push_back(took_s);
        figures.over.push_back(took_s -
                               std::abs(target - at[axis]) / motors[0][size_t(axis)].counts_per_s);
        at[axis] = target;
        for (unsigned side = 0; side < 2; side++) {
            if ((sides >> side & 1) == 0) {
                continue;
            }
            simrig::LensMotor &motor = world.controller.motor(side, simrig::LensAxis(axis));
            const double ring = motor.ring(world.now_us());
            const double drift = 0.5 * world.now_us() / 3.6e9;
            figures.error.push_back(std::abs(ring - 2 + drift - target));
            int32_t positions[LENS_AXES];
            REQUIRE(rig_lens_read(&lenses.rig, side, positions) == ERROR_OK);
            figures.read_back.push_back(std::abs(positions[axis] - drift - ring + 2));
        }
    }
    return figures;
}

void row(const char *name, unsigned sides, int32_t furthest, uint64_t seed) {
    Figures figures = run(sides, furthest, seed);
    char text[200];
    std::snprintf(text, sizeof text,
                  "%-22s %4.2f %4.2f %4.2f   %4.2f %4.2f %4.2f   %5.2f %5.2f %5.2f   %4.2f %4.2f "
                  "%4.2f",
                  name, part(figures.error, 0.5), part(figures.error, 0.99), part(figures.error, 1),
                  part(figures.read_back, 0.5), part(figures.read_back, 0.99),
                  part(figures.read_back, 1), part(figures.seconds, 0.5),
                  part(figures.seconds, 0.99), part(figures.seconds, 1), part(figures.over, 0.5),
                  part(figures.over, 0.99), part(figures.over, 1));
    MESSAGE(text);
    CHECK(part(figures.error, 0.5) < 1);
    CHECK(part(figures.error, 0.99) < 3);
    CHECK(part(figures.over, 0.5) < 3);
}

}  // namespace

TEST_CASE("arrival with the motors of the default rig") {
    const uint64_t seed = synthetic::test_seed();
    MESSAGE("seed " << seed << ", moves a row " << draws(400));
    MESSAGE(
        "each p50 p99 max:      error, counts    read back, c.    seconds             beyond the "
        "way");
    row("one lens, up to 540", 1, 540, seed);
    row("both lenses, up to 540", 3, 540, seed + 1);
    row("one lens, up to 20", 1, 20, seed + 2);
    row("both lenses, up to 20", 3, 20, seed + 3);
    row("one lens, again", 1, 0, seed + 4);
    row("both lenses, again", 3, 0, seed + 5);
}
