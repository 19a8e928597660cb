// SPDX-License-Identifier: Apache-2.0
// Lens moves against the simulated controller and its motors: play, noise, outliers, drift, jams,
// and lines that lose, change or delay bytes. Random; a failure is replayed with VERGENCE_SEED.
#include <doctest/doctest.h>

#include <cstdio>

#include "lens_bench.hpp"
#include "synthetic/seed.hpp"

using namespace motion;
using simrig::LensAxis;
using simrig::LensMotorSettings;

namespace {

constexpr unsigned kLeft = 1, kRight = 2, kBoth = 3;

uint64_t draws(uint64_t usual) {
    const char *text = std::getenv("VERGENCE_DRAWS");
    return text != nullptr ? std::strtoull(text, nullptr, 0) : usual;
}

double between(simrig::Noise &noise, double low, double high) {
    return low + (high - low) * noise.uniform();
}

LensMotorSettings any_motor(simrig::Noise &noise) {
    LensMotorSettings motor;
    motor.counts_per_s = between(noise, kSlowest, 220);
    motor.start_ms = between(noise, 0, 60);
    motor.backlash_counts = between(noise, 0, 8);
    motor.least_step_counts = between(noise, 0, 2);
    motor.read_noise_counts = between(noise, 0, 1.5);
    motor.outlier_chance = between(noise, 0, 0.01);
    motor.settle_error_counts = between(noise, 0, 0.7);
    motor.drift_counts_per_h = between(noise, -20, 20);
    return motor;
}

// Two lenses with motors of their own, and a move.
struct Draw {
    std::array<LensWorld::Motors, 2> motors;
    std::array<LensWorld::Positions, 2> positions;
    unsigned sides;
    lens_axis axis;
    int32_t target;
    double warm_us;  // since the start; the potentiometers have drifted

    explicit Draw(simrig::Noise &noise) {
        for (size_t side = 0; side < 2; side++) {
            for (size_t i = 0; i < simrig::kLensAxes; i++) {
                motors[side][i] = any_motor(noise);
                positions[side][i] = between(noise, 300, 850);
            }
        }
        sides = 1 + unsigned(noise.next() % 3);
        axis = lens_axis(noise.next() % 3);
        target = 300 + int32_t(noise.next() % 551);
        if (noise.chance(0.2)) {  // the ends are places like others
            target = noise.chance(0.5) ? 300 : 850;
        }
        warm_us = between(noise, 0, 1800e6);
    }
    bool has(unsigned side) const { return (sides >> side & 1) != 0; }
};

// By how much the ring is beside where a motor at `target`, come from below, would have it, as far
// as the potentiometer can tell.
double error_counts(const Draw &draw, LensWorld &world, unsigned side) {
    const LensMotorSettings &motor = draw.motors[side][draw.axis];
    const double drift = motor.drift_counts_per_h * world.now_us() / 3.6e9;
    const double ring = world.controller.motor(side, LensAxis(draw.axis)).ring(world.now_us());
    return ring + drift + motor.backlash_counts / 2 - draw.target;
}

// What that may be after an arrival: the tolerance, what the noise of the middle one of three
// readings hides, and the play next to the lower limit, where there is no room to come from below.
double allowed_counts(const Draw &draw, const LensWorld &world, unsigned side) {
    const LensMotorSettings &motor = draw.motors[side][draw.axis];
    const double drift = std::abs(motor.drift_counts_per_h) * world.now_us() / 3.6e9;
    const bool room = draw.target >= 300 + kBacklash + 2 * kTolerance + drift;
    const bool end = draw.target - drift < 300 || draw.target + drift > 850;
    return kTolerance + 0.5 + 3 * motor.read_noise_counts + (room ? 0 : motor.backlash_counts) +
           (end || !room ? drift : 0);
}

void check_arrival(const Draw &draw, LensWorld &world) {
    for (unsigned side = 0; side < 2; side++) {
        if (draw.has(side)) {
            INFO("side " << side << ", target " << draw.target);
            CHECK(std::abs(error_counts(draw, world, side)) <= allowed_counts(draw, world, side));
        }
    }
}

double ring(LensWorld &world, unsigned side, lens_axis axis) {
    return world.controller.motor(side, LensAxis(axis)).ring(world.now_us());
}

// Nothing of a rig moves by more than what its controller corrects as it comes to rest.
void check_rest(LensWorld &world) {
    std::array<std::array<double, simrig::kLensAxes>, 2> before{};
    for (int pass = 0; pass < 2; pass++) {
        for (unsigned side = 0; side < 2; side++) {
            for (unsigned axis = 0; axis < simrig::kLensAxes; axis++) {
                const double now = ring(world, side, lens_axis(axis));
                CHECK((pass == 0 || std::abs(now - before[side][axis]) <= 1));
                before[side][axis] = now;
            }
        }
        world.advance(world.now_us() + 2e6);
    }
}

uint64_t limit_us(const LensRig &lenses, const Draw &draw) {
    return lens_move_limit_us(&lenses.rig.profile, draw.axis, 550 + 20);
}

}  // namespace

TEST_CASE("a lens arrives, from below, wherever it stood") {
    const uint64_t seed = synthetic::test_seed();
    for (uint64_t i = 0; i < draws(1500); i++) {
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        simrig::Noise noise(seed + i);
        const Draw draw(noise);
        LensWorld world(draw.motors, draw.positions, noise.next());
        world.advance(draw.warm_us);
        LensRig lenses(world);
        REQUIRE(lenses.open() == ERROR_OK);
        const double begin_us = world.now_us();
        INFO("target " << draw.target << " sides " << draw.sides << " axis " << draw.axis);
        const int error = lenses.go(draw.sides, draw.axis, draw.target);
        INFO(lenses.rig.trouble.text);
        REQUIRE(error == ERROR_OK);
        check_arrival(draw, world);
        CHECK(world.now_us() - begin_us <= double(limit_us(lenses, draw)));
        CHECK(lenses.longest_silence_us <= 100000);
        CHECK(!lenses.went_back);
        check_rest(world);
        // Once more to the same place.
        REQUIRE(lenses.go(draw.sides, draw.axis, draw.target) == ERROR_OK);
        check_arrival(draw, world);
    }
}
