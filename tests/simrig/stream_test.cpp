// SPDX-License-Identifier: Apache-2.0
// Frames through the Verilated bridge: their times and their pixels.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/simrig/rig_harness.hpp"

using namespace rig_harness;

namespace {

uint32_t frame_time_us(Bench &bench) {
    const int high = bench.read(kBridge, 0x45), low = bench.read(kBridge, 0x46);
    REQUIRE(high >= 0);
    REQUIRE(low >= 0);
    return uint32_t(high) << 16 | uint32_t(low);
}

// A row of the table: the window on the array, blanking, thinning, and frames a second.
struct Row {
    unsigned columns, rows, hblank, vblank, bin;
    double fps;
};

struct Measured {
    double row_us, fps;
};

// The row's time from what the port sees of a frame, the frame's from the bridge's own register.
Measured measure(const Row &row) {
    Bench bench;
    bench.wake_sensors();
    bench.set_window(kLeft, row.columns, row.rows, row.hblank, row.vblank);
    const uint16_t thinned = uint16_t((row.bin - 1) * 0x11);
    CHECK(bench.write(kLeft, 0x22, thinned) == I2cStatus::kOk);
    CHECK(bench.write(kLeft, 0x23, thinned) == I2cStatus::kOk);
    CHECK(bench.write(kLeft, 0x09, 20) == I2cStatus::kOk);
    CHECK(bench.write(kBridge, 0x08, 0x0100) == I2cStatus::kOk);
    bench.rig.advance(bench.rig.now_us() + 400 * kMs, 0);
    const unsigned columns = row.columns / row.bin, rows = row.rows / row.bin;
    const simrig::PpiFrame frame = bench.capture(columns, rows);
    CHECK(!frame.short_line);
    CHECK(!frame.short_frame);
    CHECK(!frame.long_frame);
    const uint32_t first_us = frame_time_us(bench);
    bench.rig.arm_frame(columns, rows);
    uint32_t next_us = first_us;
    for (int i = 0; i < 200 && next_us == first_us; i++) {
        bench.rig.advance(bench.rig.now_us() + kMs, 0);
        next_us = frame_time_us(bench);
    }
    bench.rig.cancel_frame();
    const simrig::SensorFrame &sent = bench.sent.back();
    const double model_us = sent.row_us * (sent.rows + sent.blank_rows);
    // Frames may have passed between the two captured ones.
    const double frames = std::round((next_us - first_us) / model_us);
    return {double(frame.end_ps - frame.begin_ps) * 1e-6 / rows,
            frames * 1e6 / (next_us - first_us)};
}

void set_thinning(Bench &bench, uint8_t address, unsigned skip, unsigned bin) {
    const auto mode = uint16_t((bin - 1) << 4 | (skip - 1));
    CHECK(bench.write(address, 0x22, mode) == I2cStatus::kOk);
    CHECK(bench.write(address, 0x23, mode) == I2cStatus::kOk);
}

}  // namespace

// Blanking as stated next to the datasheet's table in the sensor's timing model; the last ones were
// measured on a camera with this sensor.
TEST_CASE("rows and frames take the time that the sensor's table says") {
    constexpr Row kRows[] = {{2048, 1536, 142, 25, 1, 12}, {640, 480, 21, 25, 1, 93},
                             {320, 240, 142, 25, 1, 217},  {100, 100, 142, 25, 1, 623},
                             {320, 240, 21, 3, 1, 277},    {128, 128, 21, 3, 1, 702},
                             {100, 100, 21, 3, 1, 903},    {2048, 1536, 21, 3, 2, 35.65}};
    for (const Row &row : kRows) {
        const Measured measured = measure(row);
        CAPTURE(row.columns);
        CAPTURE(row.hblank);
        CAPTURE(measured.fps);
        CHECK(std::fabs(measured.fps / row.fps - 1) <= 0.02);
        // Clocks of a row besides its pixels: 331 + 38, when binning in twos 673 + 22.
        const unsigned overhead = row.bin == 1 ? 369 : 695;
        // No row is shorter than 511.
        const double row_us = std::max(row.columns / row.bin + overhead + row.hblank, 511u) / 48.0;
        CHECK(std::fabs(measured.row_us / row_us - 1) <= 0.02);
    }
}

TEST_CASE("both cameras' frames pass bit for bit, for any window, skipping and binning") {
    Bench bench;
    bench.wake_sensors();
    CHECK(bench.write(kBridge, 0x08, 0x0100) == I2cStatus::kOk);
    struct Way {
        unsigned columns, rows, skip, bin;
    };
    for (const Way &way : {Way{128, 96, 1, 1}, Way{64, 200, 1, 1}, Way{256, 192, 2, 1},
                           Way{256, 128, 2, 2}, Way{512, 384, 4, 2}}) {
        for (const uint8_t address : {kLeft, kRight}) {
            bench.set_window(address, way.columns, way.rows, 30, 7);
            set_thinning(bench, address, way.skip, way.bin);
        }
        for (const int camera : {0, 1, 0, 0, 1}) {
            CHECK(bench.write(kBridge, 0x20, uint16_t(camera)) == I2cStatus::kOk);
            bench.rig.advance(bench.rig.now_us() + 30 * kMs, 0);
            const simrig::PpiFrame frame =
                bench.capture(way.columns / way.skip, way.rows / way.skip);
            CHECK(!frame.short_line);
            CHECK(!frame.short_frame);
            CHECK(!frame.long_frame);
            CHECK(wrong_pixels(frame, camera) == 0);
        }
    }
    // No switch had to be forced, and no line or frame was of a wrong size but where the window
    // changed.
    CHECK((bench.read(kBridge, 0x21) & 0x60) == 0);
}
