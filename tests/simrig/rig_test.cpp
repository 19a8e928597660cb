// SPDX-License-Identifier: Apache-2.0
// The rig's devices through the Verilated bridge, as a board sees them.
#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

#include "bridge_registers.h"
#include "tests/simrig/rig_harness.hpp"

using namespace rig_harness;

TEST_CASE("bridge and sensors answer, each under its address") {
    Bench bench;
    CHECK(bench.read(kBridge, 0x00) == 0x5B1D);
    bench.wake_sensors();
    CHECK(bench.read(kLeft, 0x00) == 0x1621);
    CHECK(bench.read(kRight, 0x00) == 0x1621);
    CHECK(bench.write(kLeft, 0x03, 99) == I2cStatus::kOk);
    CHECK(bench.read(kLeft, 0x03) == 99);
    CHECK(bench.read(kRight, 0x03) == 1535);
    CHECK(bench.read(0x11, 0x00) == -1);
}

TEST_CASE("frames come through camera select and passthrough bit for bit") {
    Bench bench;
    bench.wake_sensors();
    for (uint8_t address : {kLeft, kRight}) {
        bench.set_window(address, 128, 96, 21, 5);
    }
    CHECK(bench.write(kBridge, 0x08, 0x0100) == I2cStatus::kOk);
    for (int camera : {0, 1, 0, 1}) {
        CHECK(bench.write(kBridge, 0x20, uint16_t(camera)) == I2cStatus::kOk);
        bench.rig.advance(bench.rig.now_us() + 60 * kMs, 0);
        const simrig::PpiFrame frame = bench.capture(128, 96);
        CHECK(!frame.short_line);
        CHECK(!frame.short_frame);
        CHECK(!frame.long_frame);
        CHECK(wrong_pixels(frame, camera) == 0);
    }
}

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

TEST_CASE("a window other than armed is reported") {
    Bench bench;
    bench.wake_sensors();
    bench.set_window(kLeft, 64, 48, 21, 5);
    CHECK(bench.write(kBridge, 0x08, 0x0100) == I2cStatus::kOk);
    bench.rig.advance(bench.rig.now_us() + 20 * kMs, 0);
    CHECK(bench.capture(66, 48).short_line);
    CHECK(bench.capture(64, 50).short_frame);
    CHECK(bench.capture(64, 40).long_frame);
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
