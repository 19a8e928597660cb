// SPDX-License-Identifier: Apache-2.0
// Frames through the Verilated bridge: their times, their pixels, and that the rig's short
// cuts (a camera's clock runs only for watched frames) change nothing that is tested here.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/simrig/rig_harness.hpp"

using namespace rig_harness;

namespace {

simrig::RigSettings every_clock() {
    simrig::RigSettings settings;
    settings.every_clock = true;
    return settings;
}

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

struct Reported {
    std::vector<simrig::PpiFrame> frames;
    std::vector<int> registers;
    double pulse_us[2];
};

// The same session with either rig.
Reported session(const simrig::RigSettings &settings) {
    Bench bench(settings);
    bench.wake_sensors();
    for (const uint8_t address : {kLeft, kRight}) {
        bench.set_window(address, 128, 96, 21, 25);
    }
    CHECK(bench.write(kBridge, 0x10, uint16_t(1612.5 * 16)) == I2cStatus::kOk);
    CHECK(bench.write(kBridge, 0x08, 0x0103) == I2cStatus::kOk);
    Reported reported;
    for (const uint16_t camera : std::vector<uint16_t>{0, 1, 1, 0}) {
        CHECK(bench.write(kBridge, 0x20, camera) == I2cStatus::kOk);
        reported.frames.push_back(bench.capture(128, 96));
        bench.rig.advance(bench.rig.now_us() + 10 * kMs, 0);
    }
    // State, what is selected, both cameras' counts and flags, pulse widths, errors of I2C; not:
    // how many frames were seen, their period, the pixel clock, left against right.
    for (const uint8_t index :
         std::vector<uint8_t>{0x08, 0x09, 0x0A, 0x11, 0x19, 0x20, 0x21, 0x31, 0x32, 0x35, 0x36,
                              0x39, 0x3A, 0x3D, 0x3E, 0x48, 0x50, 0x51, 0x52, 0x53, 0x54}) {
        reported.registers.push_back(bench.read(kBridge, uint8_t(index)));
    }
    for (int servo = 0; servo < 2; servo++) {
        reported.pulse_us[servo] = bench.rig.servo(servo).last_pulse_us();
    }
    return reported;
}

}  // namespace

// Blanking as stated next to the datasheet's table in the sensor's timing model; the last ones were
// measured on a camera with this sensor.
TEST_CASE("rows and frames take the time that the sensor's table says") {
    constexpr Row kRows[] = {
        {2048, 1536, 142, 25, 1, 12}, {1600, 1200, 21, 25, 1, 20},   {1280, 1024, 21, 25, 1, 27},
        {1024, 768, 21, 25, 1, 43},   {640, 480, 21, 25, 1, 93},     {320, 240, 142, 25, 1, 217},
        {200, 200, 142, 25, 1, 299},  {128, 128, 142, 25, 1, 488},   {100, 100, 142, 25, 1, 623},
        {320, 240, 21, 3, 1, 277},    {200, 200, 21, 3, 1, 399},     {128, 128, 21, 3, 1, 702},
        {100, 100, 21, 3, 1, 903},    {2048, 1536, 21, 3, 2, 35.65}, {2048, 1536, 1024, 3, 1, 9.0}};
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

TEST_CASE("a camera that is not watched is never reported as lost") {
    Bench bench;
    bench.wake_sensors();
    CHECK(bench.write(kBridge, 0x08, 0x0100) == I2cStatus::kOk);
    bench.rig.advance(bench.rig.now_us() + 10 * kMs, 0);
    CHECK(bench.write(kBridge, 0x0A, 0xFFFF) == I2cStatus::kOk);
    bench.rig.advance(bench.rig.now_us() + 100 * kMs, 0);
    constexpr int kCameraLost = 1 << 3;
    CHECK((bench.read(kBridge, 0x0A) & kCameraLost) == 0);
}

TEST_CASE("the short cuts change nothing but counts of unwatched frames") {
    const Reported all = session(every_clock());
    const Reported some = session({});
    REQUIRE(all.registers.size() == some.registers.size());
    for (size_t i = 0; i < all.registers.size(); i++) {
        CAPTURE(i);
        CHECK(all.registers[i] == some.registers[i]);
    }
    REQUIRE(all.frames.size() == some.frames.size());
    for (size_t i = 0; i < all.frames.size(); i++) {
        CAPTURE(i);
        CHECK(all.frames[i].pixels == some.frames[i].pixels);
        // To two clocks of the pixels, by which synchronisers differ from run to run.
        CHECK(std::fabs(double(all.frames[i].begin_ps) - double(some.frames[i].begin_ps)) < 50000);
        CHECK(all.frames[i].short_line == some.frames[i].short_line);
        CHECK(all.frames[i].short_frame == some.frames[i].short_frame);
        CHECK(all.frames[i].long_frame == some.frames[i].long_frame);
    }
    CHECK(all.pulse_us[0] == some.pulse_us[0]);
    CHECK(all.pulse_us[1] == some.pulse_us[1]);
}
