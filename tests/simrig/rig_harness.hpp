// SPDX-License-Identifier: Apache-2.0
/// A board with minimal drivers, and sensors whose pixels are a formula of their position.
#ifndef VERGENCE_TESTS_SIMRIG_RIG_HARNESS_HPP
#define VERGENCE_TESTS_SIMRIG_RIG_HARNESS_HPP

#include <doctest/doctest.h>

#include <cstdint>
#include <vector>

#include "tools/simrig/rig/rig.hpp"

namespace rig_harness {

using simrig::I2cMessage;
using simrig::I2cStatus;

constexpr uint8_t kBridge = 0x2C, kLeft = 0x5C, kRight = 0x5E;
constexpr double kMs = 1000;

inline uint16_t pixel_of(int camera, unsigned row, unsigned column) {
    return uint16_t((row * 37u + column * 11u + unsigned(camera) * 501u) & 0x3FFu);
}

// A board with minimal drivers.
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
              I2cStatus::kOk);  // reset released, clocks and outputs on
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

inline uint64_t wrong_pixels(const simrig::PpiFrame &frame, int camera) {
    uint64_t wrong = 0;
    for (unsigned row = 0; row < frame.rows; row++) {
        for (unsigned column = 0; column < frame.columns; column++) {
            wrong +=
                frame.pixels[size_t(row) * frame.columns + column] != pixel_of(camera, row, column);
        }
    }
    return wrong;
}

}  // namespace rig_harness

#endif
