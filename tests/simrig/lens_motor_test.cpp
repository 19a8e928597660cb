// SPDX-License-Identifier: Apache-2.0
// A lens motor whose controller closes its loop on the potentiometer: drift moves the ring, play
// stays between motor and ring, and the reading at rest is what was commanded.
#include "tools/simrig/devices/lens_motor.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>

using simrig::LensMotor;
using simrig::LensMotorSettings;

namespace {

constexpr double kSecondUs = 1e6, kHourUs = 3600e6;

LensMotorSettings exact() {
    LensMotorSettings settings;
    settings.backlash_counts = settings.min_step_counts = settings.read_noise_counts = 0;
    settings.outlier_chance = settings.settle_error_counts = 0;
    return settings;
}

// Long after a move to `counts` that begins at `time_us`.
double ring_after(LensMotor &motor, double time_us, double counts) {
    motor.go(time_us, counts);
    return motor.ring(time_us + 20 * kSecondUs);
}

}  // namespace

TEST_CASE("drift of N counts moves the ring by N, and the reading stays the command") {
    for (const double drift : {-5.0, 0.0, 3.0}) {
        LensMotorSettings settings = exact();
        settings.drift_counts = drift;
        LensMotor motor(settings, 500, 1);
        CHECK(ring_after(motor, kSecondUs, 600) == doctest::Approx(600 - drift));
        CHECK(motor.read(30 * kSecondUs) == 600);
    }
    LensMotorSettings settings = exact();
    settings.drift_counts_per_h = 2;
    LensMotor motor(settings, 500, 1);
    const double cold = ring_after(motor, 0, 600);
    // Six hours of the initial drift in the end; 1 - exp(-1/6) of it after the first.
    const double first = 12 * (1 - std::exp(-1 / 6.0));
    CHECK(ring_after(motor, kHourUs, 600) == doctest::Approx(cold - first).epsilon(1e-4));
    CHECK(motor.read(kHourUs + 20 * kSecondUs) == 600);
    CHECK(ring_after(motor, 1000 * kHourUs, 600) == doctest::Approx(cold - 12).epsilon(1e-4));
    // At rest nothing moves: the reading drifts.
    LensMotor resting(settings, 500, 1);
    CHECK(resting.ring(1000 * kHourUs) == 500);
    CHECK(resting.read(1000 * kHourUs) == 512);
}

TEST_CASE("play stays between motor and ring, whatever drifts") {
    LensMotorSettings settings = exact();
    settings.backlash_counts = 6;
    settings.drift_counts = 2;
    LensMotor motor(settings, 500, 1);
    CHECK(ring_after(motor, 0, 600) == doctest::Approx(600 - 2 - 3));
    CHECK(ring_after(motor, 30 * kSecondUs, 550) == doctest::Approx(550 - 2 + 3));
    CHECK(motor.read(60 * kSecondUs) == 550);
    // Within the play the motor moves and the ring does not.
    CHECK(ring_after(motor, 60 * kSecondUs, 554) == doctest::Approx(551));
    CHECK(motor.read(90 * kSecondUs) == 554);
}

TEST_CASE("at rest the reading is the command within the dead zone") {
    LensMotorSettings settings = exact();
    settings.min_step_counts = 2;
    settings.settle_error_counts = 0.7;
    settings.drift_counts = 4;
    LensMotor motor(settings, 500, 7);
    double time_us = 0, square = 0;
    constexpr int kMoves = 400;
    for (int i = 0; i < kMoves; i++) {
        const double command = i % 2 == 0 ? 600 : 450;
        const double error = ring_after(motor, time_us, command) + 4 - command;
        time_us += 30 * kSecondUs;
        REQUIRE(std::abs(error) <= 2);
        REQUIRE(std::abs(motor.read(time_us) - command) <= 2);
        square += error * error;
    }
    CHECK(std::sqrt(square / kMoves) == doctest::Approx(0.7).epsilon(0.15));
    // An error within the dead zone starts nothing.
    const double before = motor.ring(time_us);
    CHECK(ring_after(motor, time_us, before + 4 + 1.9) == before);
    CHECK(ring_after(motor, time_us + 30 * kSecondUs, before + 4 + 6) > before + 3.9);
}

TEST_CASE("a stepper counts its steps: drift has no effect") {
    LensMotorSettings settings = exact();
    settings.drift_counts = 5;
    LensMotor motor(settings, 500, 1);
    motor.step_to(0, 600);
    CHECK(motor.ring(20 * kSecondUs) == 600);
}
