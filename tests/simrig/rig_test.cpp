// SPDX-License-Identifier: Apache-2.0
// The rig's devices through the Verilated bridge: what a board sees of them.
#include "tools/simrig/rig/rig.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

namespace {

using simrig::I2cMessage;
using simrig::I2cStatus;

constexpr uint8_t kBridge = 0x2C, kLeft = 0x5C, kRight = 0x5E;
constexpr double kMs = 1000;

uint16_t pixel_of(int camera, unsigned row, unsigned column) {
    return uint16_t((row * 37u + column * 11u + unsigned(camera) * 501u) & 0x3FFu);
}

// A board with drivers in a few lines.
struct Bench {
    simrig::Rig rig;
    std::vector<simrig::SensorFrame> sent;

    explicit Bench(simrig::RigSettings settings = {})
        : rig(settings, [this](int camera, const simrig::SensorFrame &frame, double,
                               const std::function<simrig::CameraState(double)> &) {
              sent.push_back(frame);
              std::vector<uint16_t> pixels;
              for (unsigned row = 0; row < frame.rows; row++) {
                  for (unsigned column = 0; column < frame.columns; column++) {
                      pixels.push_back(pixel_of(camera, row, column));
                  }
              }
              return pixels;
          }) {
        rig.advance(rig.now_us() + 200, 0);  // the bridge clears its branches after a reset
    }

    I2cStatus write(uint8_t address, uint8_t index, uint16_t value) {
        std::vector<I2cMessage> messages = {
            {address, false, {index, uint8_t(value >> 8), uint8_t(value)}}};
        return rig.i2c(400000, messages).status;
    }
    int read(uint8_t address, uint8_t index) {
        std::vector<I2cMessage> messages = {{address, false, {index}},
                                            {address, true, std::vector<uint8_t>(2)}};
        if (rig.i2c(400000, messages).status != I2cStatus::kOk) {
            return -1;
        }
        return messages[1].bytes[0] << 8 | messages[1].bytes[1];
    }
    void wake_sensors() {
        CHECK(write(kBridge, 0x56, 1) == I2cStatus::kOk);  // router
        CHECK(write(kBridge, 0x48, 0x00F3) ==
              I2cStatus::kOk);  // out of reset, clocks and outputs on
    }
    void set_window(uint8_t address, unsigned columns, unsigned rows, unsigned hblank,
                    unsigned vblank) {
        CHECK(write(address, 0x03, uint16_t(rows - 1)) == I2cStatus::kOk);
        CHECK(write(address, 0x04, uint16_t(columns - 1)) == I2cStatus::kOk);
        CHECK(write(address, 0x05, uint16_t(hblank)) == I2cStatus::kOk);
        CHECK(write(address, 0x06, uint16_t(vblank)) == I2cStatus::kOk);
        CHECK(write(address, 0x09, uint16_t(rows)) == I2cStatus::kOk);
    }
    simrig::PpiFrame capture(unsigned columns, unsigned rows) {
        rig.arm_frame(columns, rows);
        REQUIRE(rig.wait_frame(rig.now_us() + 500 * kMs));
        return rig.take_frame();
    }
};

uint64_t wrong_pixels(const simrig::PpiFrame &frame, int camera) {
    uint64_t wrong = 0;
    for (unsigned row = 0; row < frame.rows; row++) {
        for (unsigned column = 0; column < frame.columns; column++) {
            wrong +=
                frame.pixels[size_t(row) * frame.columns + column] != pixel_of(camera, row, column);
        }
    }
    return wrong;
}

}  // namespace

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

TEST_CASE("a window other than armed is told") {
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

TEST_CASE("lens motors move at their speed, and the controller tells where they are") {
    simrig::RigSettings settings;
    for (simrig::LensSettings &lens : settings.lens) {
        for (simrig::LensMotorSettings &motor : lens.motor) {
            motor.settle_error_counts = motor.outlier_chance = 0;
        }
    }
    Bench bench(settings);
    const std::string move = "1Z600\n";
    bench.rig.serial().send(bench.rig.now_us(), {move.begin(), move.end()});
    bench.rig.advance(bench.rig.now_us() + 1000 * kMs, 0);
    const double half_way = bench.rig.state(0).zoom;
    CHECK(half_way > 430);
    CHECK(half_way < 455);
    bench.rig.advance(bench.rig.now_us() + 1500 * kMs, 0);
    CHECK(std::abs(bench.rig.state(0).zoom - 600) <= 2.5);  // half the backlash
    const std::string ask = "1?\n";
    bench.rig.serial().send(bench.rig.now_us(), {ask.begin(), ask.end()});
    CHECK(bench.rig.advance(bench.rig.now_us() + 500 * kMs, simrig::kWakeSerial) ==
          simrig::kWakeSerial);
    bench.rig.advance(bench.rig.now_us() + 100 * kMs, 0);
    const std::vector<uint8_t> bytes = bench.rig.serial().take(bench.rig.now_us());
    const std::string text(bytes.begin(), bytes.end());
    int zoom = 0;
    CHECK(std::sscanf(text.c_str(), "V3LC 1\rZoom:%d", &zoom) == 1);
    CHECK(std::abs(zoom - 600) <= 5);
}

// Pixels and blanking as stated beside the datasheet's table in the sensor's timing model.
TEST_CASE("frame rates of the sensor's datasheet, as the bridge measures them") {
    struct Row {
        unsigned columns, rows, hblank, vblank;
        double fps;
    };
    constexpr Row kRows[] = {{2048, 1536, 142, 25, 12.0},
                             {1600, 1200, 21, 25, 20},
                             {1280, 1024, 21, 25, 27},
                             {1024, 768, 21, 25, 43},
                             {640, 480, 21, 25, 93}};
    for (const Row &row : kRows) {
        simrig::Mt9t001 sensor([](const simrig::SensorFrame &frame, double) {
            return std::vector<uint16_t>(size_t(frame.rows) * frame.columns, 0);
        });
        sensor.write(0x03, uint16_t(row.rows - 1));
        sensor.write(0x04, uint16_t(row.columns - 1));
        sensor.write(0x05, uint16_t(row.hblank));
        sensor.write(0x06, uint16_t(row.vblank));
        sensor.write(0x09, uint16_t(row.rows));
        const double period_us = 1 / 48.0;
        sensor.skip(200000000, period_us);
        const double fps = 48e6 / double(simrig::Mt9t001::frame_clocks(sensor.frame()));
        CAPTURE(row.columns);
        CHECK(std::abs(fps / row.fps - 1) <= 0.02);
    }
}
