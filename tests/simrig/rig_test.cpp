// SPDX-License-Identifier: Apache-2.0
// The rig's devices through the Verilated bridge, as a board sees them.
#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

#include "bridge_registers.h"
#include "tests/simrig/rig_harness.hpp"

using namespace rig_harness;

TEST_CASE("a sensor that is reset or sleeps within a row starts over") {
    Bench bench;
    bench.wake_sensors();
    CHECK(bench.write(kBridge, 0x08, 0x0100) == I2cStatus::kOk);
    for (int i = 0; i < 8; i++) {
        bench.rig.advance(bench.rig.now_us() + 1000.0 + 7 * i, 0);
        if (i % 2 == 0) {
            CHECK(bench.write(kLeft, 0x0D, 1) == I2cStatus::kOk);
            CHECK(bench.write(kLeft, 0x0D, 0) == I2cStatus::kOk);
        } else {
            CHECK(bench.write(kBridge, 0x48, 0x00FF) == I2cStatus::kOk);
            CHECK(bench.write(kBridge, 0x48, 0x00F3) == I2cStatus::kOk);
        }
        bench.set_window(kLeft, 64, 48, 21, 5);
        const simrig::PpiFrame frame = bench.capture(64, 48);
        CHECK(wrong_pixels(frame, 0) == 0);
    }
}

TEST_CASE("a camera whose frame was aborted passes frames when it is selected again") {
    Bench bench;
    bench.wake_sensors();
    CHECK(bench.write(kBridge, 0x08, 0x0100) == I2cStatus::kOk);
    for (int i = 0; i < 8; i++) {
        const auto choose = [&bench](int camera) {
            bench.set_window(camera == 0 ? kLeft : kRight, 128, 96, 21, 5);
            CHECK(bench.write(kBridge, BRIDGE_CAM_SELECT, uint16_t(camera)) == I2cStatus::kOk);
            bench.rig.advance(bench.rig.now_us() + 60 * kMs, 0);
            CHECK((bench.read(kBridge, BRIDGE_CAM_STATE) & BRIDGE_CAM_STATE_GATE_OPEN_MASK) != 0);
        };
        choose(1);
        bench.rig.arm_frame(128, 96);
        bench.rig.advance(bench.rig.now_us() + 500.0 + 117 * i, 0);
        bench.rig.cancel_frame();
        CHECK(bench.write(kBridge, 0x48, 0x00FF) == I2cStatus::kOk);
        CHECK(bench.write(kBridge, 0x48, 0x00F3) == I2cStatus::kOk);
        choose(0);
    }
}

TEST_CASE("servos follow the pulses of the Verilog") {
    simrig::RigSettings settings;
    for (simrig::ServoSettings &servo : settings.servo) {
        servo.repeatability_degrees = 0;
        servo.dead_band_us = 0;
    }
    Bench bench(settings);
    CHECK(bench.write(kBridge, 0x08, 0x0003) == I2cStatus::kOk);
    CHECK(bench.write(kBridge, 0x0E, 0x0000) != I2cStatus::kTimeout);
    CHECK(bench.write(kBridge, 0x10, uint16_t(1603.25 * 16)) == I2cStatus::kOk);
    for (int i = 0; i < 10; i++) {
        bench.rig.advance(bench.rig.now_us() + 100 * kMs, 0);
        CHECK(bench.read(kBridge, 0x00) == 0x5B1D);
        CHECK(bench.write(kBridge, 0x04, uint16_t(i)) == I2cStatus::kOk);  // feeds the watchdog
    }
    // Pulses are exact to a clock of 40 ns even though idle time runs in microseconds.
    CHECK(bench.rig.servo(0).last_pulse_us() == doctest::Approx(1603.25).epsilon(3e-5));
    CHECK(bench.rig.state(0).pan_deg == doctest::Approx(103.25 / 10.3).epsilon(1e-3));
    CHECK(std::abs(bench.rig.state(1).pan_deg) < 0.01);
}

TEST_CASE("lens motors move at their speed, and the controller reports their positions") {
    simrig::RigSettings settings;
    for (simrig::LensSettings &lens : settings.lens) {
        for (simrig::LensMotorSettings &motor : lens.motor) {
            motor.settle_error_counts = motor.outlier_chance = 0;
        }
    }
    Bench bench(settings);
    const std::string move = "1Z600\n";
    bench.rig.serial().send(bench.rig.now_ps(), {move.begin(), move.end()});
    bench.rig.advance(bench.rig.now_us() + 1000 * kMs, 0);
    const double half_way = bench.rig.state(0).zoom;
    CHECK(half_way > 430);
    CHECK(half_way < 455);
    bench.rig.advance(bench.rig.now_us() + 1500 * kMs, 0);
    CHECK(std::abs(bench.rig.state(0).zoom - 600) <= 2.5);  // half the backlash
    const std::string ask = "1?\n";
    bench.rig.serial().send(bench.rig.now_ps(), {ask.begin(), ask.end()});
    CHECK(bench.rig.advance(bench.rig.now_us() + 500 * kMs, simrig::kWakeSerial) ==
          simrig::kWakeSerial);
    bench.rig.advance(bench.rig.now_us() + 100 * kMs, 0);
    const std::vector<uint8_t> bytes = bench.rig.serial().take(bench.rig.now_ps());
    const std::string text(bytes.begin(), bytes.end());
    int zoom = 0;
    CHECK(std::sscanf(text.c_str(), "V3LC 1\rZoom:%d", &zoom) == 1);
    CHECK(std::abs(zoom - 600) <= 5);
}

TEST_CASE("after days the rig works as in its first second, and time never stops") {
    for (const uint32_t begin_s : {0u, 5000u, 86400u, 890298u, 999999u}) {
        CAPTURE(begin_s);
        simrig::RigSettings settings;
        settings.begin_s = begin_s;
        for (simrig::LensSettings &lens : settings.lens) {
            for (simrig::LensMotorSettings &motor : lens.motor) {
                motor.drift_counts_per_h = 0.5;
                motor.outlier_chance = 0;
            }
        }
        Bench bench(settings);
        const double begin_us = begin_s * 1e6;
        CHECK(bench.rig.now_us() >= begin_us + 200);
        CHECK(bench.rig.now_us() < begin_us + 300);
        // Answers of the lens controller, at any fraction of a microsecond, awaited or not.
        for (int i = 1; i <= 40; i++) {
            const std::string ask = "1?\n";
            bench.rig.serial().send(bench.rig.now_ps(), {ask.begin(), ask.end()});
            const uint32_t wake = i % 2 == 0 ? uint32_t(simrig::kWakeSerial) : 0u;
            const double until_us = begin_us + i * 100 * kMs + i;
            CHECK(bench.rig.advance(until_us, wake) == wake);
            CHECK((wake != 0 || bench.rig.now_us() == until_us));
            CHECK(bench.rig.now_us() >= until_us - (wake != 0 ? 100 * kMs : 0.0));
            CHECK(bench.rig.now_us() <= until_us);
            bench.rig.advance(until_us, 0);
            const std::vector<uint8_t> bytes = bench.rig.serial().take(bench.rig.now_ps());
            const std::string text(bytes.begin(), bytes.end());
            CAPTURE(text);
            int iris = 0;
            CHECK(std::sscanf(text.c_str(), "V3LC 1\rZoom:%*d\rFocus:%*d\rIris:%d", &iris) == 1);
            CHECK(std::abs(iris - 850) <= 8);
        }
        bench.wake_sensors();
        bench.set_window(kLeft, 64, 48, 21, 5);
        CHECK(bench.write(kBridge, 0x08, 0x0100) == I2cStatus::kOk);
        bench.rig.advance(bench.rig.now_us() + 20 * kMs, 0);
        const simrig::PpiFrame frame = bench.capture(64, 48);
        CHECK_FALSE((frame.short_line || frame.short_frame || frame.long_frame));
        REQUIRE(frame.pixels.size() == 64 * 48);
        CHECK(frame.pixels[64 + 1] == pixel_of(0, 1, 1));
    }
}

TEST_CASE("a clock that stops or starts while all rest is reported without extra delay") {
    Bench bench;
    bench.wake_sensors();
    CHECK(bench.write(kBridge, 0x08, 0x0100) == I2cStatus::kOk);
    const auto lost = [&bench] { return (bench.read(kBridge, 0x09) >> 3) & 3; };
    const auto pass = [&bench](double duration_us) {
        bench.rig.advance(bench.rig.now_us() + duration_us, 0);
    };
    pass(1000);
    CHECK(lost() == 0);
    for (const double rest_us : {3000.0, 17123.4, 1e6}) {
        CAPTURE(rest_us);
        pass(rest_us);
        CHECK(lost() == 0);
        const auto plug = [&bench, rest_us](int camera, bool silent) {
            bench.rig.wires().at(bench.rig.now_ps() + uint64_t(rest_us) * 1000000 / 2,
                                 [&bench, camera, silent] {
                                     simrig::SensorFaults faults;
                                     faults.silent = silent;
                                     bench.rig.sensor(camera).set_faults(faults);
                                 });
        };
        CHECK(bench.write(kBridge, 0x0A, 0x0008) == I2cStatus::kOk);
        CHECK(bench.write(kBridge, 0x0B, 0x0008) == I2cStatus::kOk);
        const double silent_us = bench.rig.now_us() + rest_us / 2;
        plug(1, true);
        CHECK(bench.rig.advance(silent_us + 10 * kMs, simrig::kWakeGpio) == simrig::kWakeGpio);
        CHECK(bench.rig.now_us() > silent_us + 50);
        CHECK(bench.rig.now_us() < silent_us + 210);
        CHECK(bench.write(kBridge, 0x0B, 0) == I2cStatus::kOk);
        bench.rig.take_irq_edges();
        CHECK(lost() == 2);
        plug(1, false);
        pass(rest_us / 2 + 250);
        CHECK(lost() == 0);
        plug(0, true);
        pass(rest_us);
        CHECK(lost() == 1);
        pass(rest_us);
        CHECK(lost() == 1);
        plug(0, false);
        pass(rest_us);
    }
}

TEST_CASE("the first pulse of another width is as exact as the others") {
    simrig::RigSettings settings;
    settings.servo[0].repeatability_degrees = 0;
    Bench bench(settings);
    CHECK(bench.write(kBridge, 0x08, 0x0001) == I2cStatus::kOk);
    bench.rig.advance(bench.rig.now_us() + 200 * kMs, 0);
    // The servo follows the first pulse, and keeps to it within its dead band.
    for (const double width_us : {1515.25, 1502.5, 1487.75, 1500.0}) {
        CHECK(bench.write(kBridge, 0x10, uint16_t(width_us * 16)) == I2cStatus::kOk);
        bench.rig.advance(bench.rig.now_us() + 200 * kMs, 0);
        CHECK(std::abs(bench.rig.state(0).pan_deg - (width_us - 1500) / 10.3) < 0.01);
    }
}

TEST_CASE("a rig warms up exponentially, and one without the number never does") {
    simrig::RigSettings settings;
    settings.warm_up_h = 0.05;
    settings.begin_s = 5000;
    Bench bench(settings);
    CHECK(bench.rig.state(0).warm == 0);
    bench.rig.advance(5000e6 + 180e6 + 1, 0);
    CHECK(bench.rig.state(0).warm == doctest::Approx(1 - std::exp(-1.0)).epsilon(1e-6));
    CHECK(bench.rig.state(1).warm == bench.rig.state(0).warm);
    Bench cold;
    cold.rig.advance(180e6, 0);
    CHECK(cold.rig.state(0).warm == 0);
}
