// SPDX-License-Identifier: Apache-2.0
// Play and creep of a pan servo, against what their numbers promise; without them it stands still.
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "tools/simrig/devices/servo.hpp"

using simrig::Servo;
using simrig::ServoSettings;

namespace {

constexpr double kSecondUs = 1e6, kPeriodUs = 20000;

ServoSettings exact() {
    ServoSettings settings;
    settings.repeatability_degrees = settings.dead_band_us = 0;
    return settings;
}

// Pulses for an angle during a second, by which the motor has arrived.
void turn_to(Servo &servo, double &time_us, double degrees) {
    const double end_us = time_us + kSecondUs;
    for (; time_us < end_us; time_us += kPeriodUs) {
        servo.edge(time_us, true);
        servo.edge(time_us + 1500 + 10.3 * degrees, false);
    }
}

}  // namespace

TEST_CASE("play: the horn lags by half of it, and a reversal within it does not move it") {
    for (const double play : {0.0, 0.4, 3.0}) {
        CAPTURE(play);
        ServoSettings settings = exact();
        settings.play_degrees = play;
        Servo servo(settings, 1);
        double time_us = 0;
        turn_to(servo, time_us, 10);
        CHECK(servo.angle_deg(time_us) == doctest::Approx(10 - play / 2));
        turn_to(servo, time_us, 10 - 0.9 * play);
        CHECK(servo.angle_deg(time_us) == doctest::Approx(10 - play / 2));
        turn_to(servo, time_us, -10);
        CHECK(servo.angle_deg(time_us) == doctest::Approx(-10 + play / 2));
        // What two approaches to one angle differ by is all of the play.
        turn_to(servo, time_us, 2);
        const double from_below = servo.angle_deg(time_us);
        turn_to(servo, time_us, 10);
        turn_to(servo, time_us, 2);
        CHECK(servo.angle_deg(time_us) - from_below == doctest::Approx(play));
    }
}

TEST_CASE("creep: exponential after each stop, with the sigma of the file, and no jump at a move") {
    ServoSettings settings = exact();
    settings.creep_degrees = 0.05;
    settings.creep_s = 20;
    Servo servo(settings, 3);
    double time_us = 0, square = 0, sum = 0;
    constexpr int kMoves = 2000;
    for (int i = 0; i < kMoves; i++) {
        const double degrees = i % 2 == 0 ? 5 : -5;
        turn_to(servo, time_us, degrees);
        Servo later = servo;
        // The move took 10 degrees / 316 degrees a second, so the first second is not yet over.
        CHECK(later.angle_deg(time_us) == doctest::Approx(degrees));
        const double ends = later.angle_deg(time_us + 1000 * kSecondUs) - degrees;
        square += ends * ends;
        sum += ends;
        Servo half = servo;
        const double after_20_s = half.angle_deg(time_us + 19.5 * kSecondUs) - degrees;
        CHECK(after_20_s == doctest::Approx(ends * (1 - std::exp(-1.0))).epsilon(1e-6));
        // Turned on after 20 s, it starts from where it crept to.
        time_us += 19.5 * kSecondUs;
        const double crept = servo.angle_deg(time_us);
        servo.edge(time_us, true);
        const double asked_us = time_us + 1500 + 10.3 * (degrees + 1);
        servo.edge(asked_us, false);
        CHECK(servo.angle_deg(asked_us) == doctest::Approx(crept).epsilon(1e-9));
    }
    CHECK(std::sqrt(square / kMoves) == doctest::Approx(0.05).epsilon(0.05));
    CHECK(std::abs(sum / kMoves) < 3 * 0.05 / std::sqrt(double(kMoves)));
}

TEST_CASE("creep comes in slips a second apart: most frames see a camera that stands still") {
    ServoSettings settings = exact();
    settings.creep_degrees = 0.05;
    Servo servo(settings, 5);
    double time_us = 0;
    turn_to(servo, time_us, 5);
    int changes = 0;
    double before = servo.angle_deg(time_us);
    for (int i = 0; i < 1000; i++) {
        time_us += 10000;
        const double now = servo.angle_deg(time_us);
        changes += now != before;
        before = now;
    }
    CHECK(changes == 10);
}

TEST_CASE("without play and creep the horn is exactly where it was commanded") {
    Servo servo(exact(), 7);
    double time_us = 0;
    for (const double degrees : {3.0, -7.0, 12.5}) {
        turn_to(servo, time_us, degrees);
        const double rest = servo.angle_deg(time_us);
        CHECK(rest == doctest::Approx(degrees));
        CHECK(servo.angle_deg(time_us + 1000 * kSecondUs) == rest);
        time_us += 1000 * kSecondUs;
    }
}

TEST_CASE("a jammed horn does not creep") {
    ServoSettings settings = exact();
    settings.creep_degrees = 1;
    Servo servo(settings, 9);
    double time_us = 0;
    turn_to(servo, time_us, 5);
    time_us += 10 * kSecondUs;
    const double then = servo.angle_deg(time_us);
    CHECK(then != doctest::Approx(5).epsilon(1e-4));
    servo.jam(time_us, true);
    CHECK(servo.angle_deg(time_us + 100 * kSecondUs) == then);
}
