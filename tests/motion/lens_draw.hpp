// SPDX-License-Identifier: Apache-2.0
/// Random lenses and moves, and checks of where a move ended.
#ifndef VERGENCE_TESTS_MOTION_LENS_DRAW_HPP
#define VERGENCE_TESTS_MOTION_LENS_DRAW_HPP

#include <doctest/doctest.h>

#include <cstdlib>

#include "lens_bench.hpp"
#include "synthetic/seed.hpp"

namespace motion {

using simrig::LensAxis;
using simrig::LensMotorSettings;

constexpr unsigned kLeft = 1, kRight = 2, kBoth = 3;

inline uint64_t draws(uint64_t default_value) {
    const char *text = std::getenv("VERGENCE_DRAWS");
    return text != nullptr ? std::strtoull(text, nullptr, 0) : default_value;
}

inline double between(simrig::Noise &noise, double low, double high) {
    return low + (high - low) * noise.uniform();
}

inline LensMotorSettings any_motor(simrig::Noise &noise) {
    LensMotorSettings motor;
    motor.counts_per_s = between(noise, kSlowest, 220);
    motor.start_ms = between(noise, 0, 60);
    motor.backlash_counts = between(noise, 0, 8);
    motor.min_step_counts = between(noise, 0, 2);
    motor.read_noise_counts = between(noise, 0, 1.5);
    motor.outlier_chance = between(noise, 0, 0.01);
    motor.settle_error_counts = between(noise, 0, 0.7);
    motor.drift_counts_per_h = between(noise, -20, 20);
    return motor;
}

// Two lenses with their own motors, and a move.
struct Draw {
    std::array<LensWorld::Motors, 2> motors;
    std::array<LensWorld::Positions, 2> positions;
    unsigned sides;
    lens_axis axis;
    int32_t target;
    double warm_us;  // time since power-up, in which the potentiometers have drifted

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
        if (noise.chance(0.2)) {  // the ends are also possible
            target = noise.chance(0.5) ? 300 : 850;
        }
        warm_us = between(noise, 0, 1800e6);
    }
    bool has(unsigned side) const { return (sides >> side & 1) != 0; }
};

// Offset of the ring from where a motor at `target`, approached from above, would put it, as far as
// the potentiometer shows.
inline double error_counts(const Draw &draw, LensWorld &world, unsigned side) {
    const LensMotorSettings &motor = draw.motors[side][draw.axis];
    const double drift = simrig::drift_counts(motor, world.now_us());
    const double ring = world.controller.motor(side, LensAxis(draw.axis)).ring(world.now_us());
    return ring + drift - motor.backlash_counts / 2 - draw.target;
}

// Its limit after an arrival: the tolerance, what the noise of the median of three readings hides,
// and the play next to the upper limit, where there is no room for an approach from above.
inline double allowed_counts(const Draw &draw, const LensWorld &world, unsigned side) {
    const LensMotorSettings &motor = draw.motors[side][draw.axis];
    const double drift = std::abs(simrig::drift_counts(motor, world.now_us()));
    const bool room = draw.target <= 850 - kBacklash - 2 * kTolerance - drift;
    const bool end = draw.target - drift < 300 || draw.target + drift > 850;
    return kTolerance + 1 + 3 * motor.read_noise_counts + (room ? 0 : motor.backlash_counts) +
           (end || !room ? drift : 0);
}

inline void check_arrival(const Draw &draw, LensWorld &world) {
    for (unsigned side = 0; side < 2; side++) {
        if (draw.has(side)) {
            INFO("side " << side << ", target " << draw.target);
            CHECK(std::abs(error_counts(draw, world, side)) <= allowed_counts(draw, world, side));
        }
    }
}

inline double ring(LensWorld &world, unsigned side, lens_axis axis) {
    return world.controller.motor(side, LensAxis(axis)).ring(world.now_us());
}

// A rig moves at most by what its controller corrects while stopping.
inline void check_rest(LensWorld &world, double allowed = 1) {
    std::array<std::array<double, simrig::kLensAxes>, 2> before{};
    for (int pass = 0; pass < 2; pass++) {
        for (unsigned side = 0; side < 2; side++) {
            for (unsigned axis = 0; axis < simrig::kLensAxes; axis++) {
                const double now = ring(world, side, lens_axis(axis));
                CHECK((pass == 0 || std::abs(now - before[side][axis]) <= allowed));
                before[side][axis] = now;
            }
        }
        world.advance(world.now_us() + 2e6);
    }
}

inline uint64_t limit_us(const LensRig &lenses, const Draw &draw) {
    return lens_move_limit_us(&lenses.rig.profile, draw.axis, 550 + 20);
}

}  // namespace motion

#endif
