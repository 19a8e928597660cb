// SPDX-License-Identifier: Apache-2.0
// Pairs through the Verilated bridge: valid pairs, and those that must be rejected.
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "bench/rig_bench.hpp"

using rig_bench::RigBench;
using rig_bench::small_profile;

namespace {

constexpr double kBlackLevel = 42;
constexpr unsigned kBoth = 1u << RIG_LEFT | 1u << RIG_RIGHT;

void write_register(RigBench &bench, uint8_t address, uint8_t index, uint16_t value) {
    uint8_t bytes[] = {index, uint8_t(value >> 8), uint8_t(value)};
    const hal_i2c_message message = {bytes, sizeof bytes, address, false};
    size_t begun = 0;
    const hal_i2c &bus = bench.backend.i2c;
    REQUIRE(bus.operations->transfer(bus.self, &message, 1, bench.now_us() + 25000, &begun) ==
            ERROR_OK);
}

void send_to_lens(RigBench &bench, const std::string &text) {
    const hal_uart &uart = bench.backend.uart;
    REQUIRE(uart.operations->write(uart.self, text.data(), text.size(), bench.now_us()) ==
            ERROR_OK);
}

}  // namespace

TEST_CASE("a pair records when and how each frame was taken") {
    RigBench bench(small_profile(256, 192));
    INFO(bench.rig.last_error.text);
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    uint32_t applied_us = 0;
    REQUIRE(rig_exposure(&bench.rig, kBoth, 10000, &applied_us) == ERROR_OK);
    mt9t001_timing timing{};
    const mt9t001 &sensor = bench.rig.camera[RIG_LEFT].sensor;
    REQUIRE(mt9t001_timing_of(&sensor.window, sensor.shutter_rows, sensor.clock_hz, &timing) ==
            ERROR_OK);
    CHECK(std::abs(double(applied_us) - 10000) <= double(timing.row_ns) / 2000 + 1);
    ::pair pair{};
    const uint64_t begin_us = bench.now_us();
    REQUIRE_MESSAGE(bench.capture(pair, true) == ERROR_OK, bench.rig.last_error.text);
    const pair_frame &left = pair.frame[RIG_LEFT], &right = pair.frame[RIG_RIGHT];
    CHECK(pair.number == 1);
    CHECK(pair.checked);
    CHECK(pair.change_permille <= 2);
    CHECK(left.begin_us > begin_us + MT9T001_FRAMES_TO_SETTLE * timing.frame_us);
    CHECK(right.begin_us > left.end_us);
    CHECK(pair.skew_us == int64_t(right.begin_us - left.begin_us));
    CHECK(pair.skew_us < int64_t(4 * timing.frame_us + 20000));
    CHECK(right.sequence != left.sequence);
    for (const pair_frame &frame : pair.frame) {
        CHECK(frame.image.width_px == 256);
        CHECK(frame.image.height_px == 192);
        CHECK(frame.image.bits == 10);
        CHECK(frame.image.layout == RAW_BAYER_GRBG);
        CHECK(frame.exposure_us == applied_us);
        CHECK(frame.gain_q3 == 8);
        const double rows_us = 192 * double(timing.row_ns) / 1000;
        CHECK(double(frame.end_us - frame.begin_us) == doctest::Approx(rows_us).epsilon(0.005));
        for (int axis = 0; axis < LENS_AXES; axis++) {
            CHECK(std::abs(frame.before.lens[axis].position_q4 -
                           frame.after.lens[axis].position_q4) <= 3 * 16);
            CHECK(frame.before.lens[axis].sigma_q4 > 0);
            CHECK(frame.before.lens[axis].sigma_q4 < 16);
        }
        CHECK(std::abs(frame.before.lens[LENS_ZOOM].position_q4 / 16.0 - 300) <= 5);
        CHECK(std::abs(frame.before.lens[LENS_FOCUS].position_q4 / 16.0 - 560) <= 5);
        CHECK(std::abs(frame.before.lens[LENS_IRIS].position_q4 / 16.0 - 850) <= 5);
        CHECK(frame.before.pan_q4 == 0);
    }
    // The cameras see the same board from two positions: similar as a whole, but not pixel by
    // pixel.
    CHECK(bench.mean(left) == doctest::Approx(bench.mean(right)).epsilon(0.25));
    size_t differ = 0;
    for (size_t i = 0; i < 256u * 192u; i++) {
        differ += std::abs(int(left.image.data[i]) - int(right.image.data[i])) > 60;
    }
    CHECK(differ > 256 * 192 / 50);
}

TEST_CASE("exposure and gain are in force in the first pair after them") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    uint32_t applied_us = 0;
    uint16_t applied_q3 = 0;
    ::pair pair{};
    double light[2] = {0, 0};
    const struct {
        uint32_t exposure_us;
        uint16_t gain_q3;
    } steps[] = {{2000, 8}, {1000, 8}, {1000, 16}, {4000, 8}, {500, 64}};
    for (const auto &step : steps) {
        REQUIRE(rig_exposure(&bench.rig, kBoth, step.exposure_us, &applied_us) == ERROR_OK);
        REQUIRE(rig_gain(&bench.rig, kBoth, step.gain_q3, &applied_q3) == ERROR_OK);
        CHECK(applied_q3 == step.gain_q3);
        REQUIRE(bench.capture(pair) == ERROR_OK);
        for (int side = 0; side < RIG_SIDES; side++) {
            const double part = double(applied_us) * applied_q3;
            const double seen = (bench.mean(pair.frame[side]) - kBlackLevel) / part;
            light[side] = light[side] == 0 ? seen : light[side];
            CAPTURE(step.exposure_us);
            CAPTURE(step.gain_q3);
            CHECK(seen == doctest::Approx(light[side]).epsilon(0.06));
        }
    }
    // One side only.
    REQUIRE(rig_gain(&bench.rig, 1u << RIG_RIGHT, 8, &applied_q3) == ERROR_OK);
    REQUIRE(bench.capture(pair) == ERROR_OK);
    CHECK(pair.frame[RIG_LEFT].gain_q3 == 64);
    CHECK(pair.frame[RIG_RIGHT].gain_q3 == 8);
}

TEST_CASE("the left camera waits for a right one that still shows what it was set to before") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    uint32_t applied_us = 0;
    ::pair pair{};
    REQUIRE(rig_exposure(&bench.rig, 1u << RIG_RIGHT, 5000000, &applied_us) == ERROR_OK);
    REQUIRE(rig_exposure(&bench.rig, kBoth, 10000, &applied_us) == ERROR_OK);
    REQUIRE_MESSAGE(bench.capture(pair) == ERROR_OK, bench.rig.last_error.text);
    CHECK(pair.skew_us < 100000);
}

TEST_CASE("another window is in force in the first pair after it") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    ::pair pair{};
    const struct {
        uint16_t width_px, height_px;
        uint8_t skip;
    } windows[] = {{256, 192, 1}, {256, 192, 2}, {64, 48, 1}, {512, 96, 4}};
    for (const auto &window : windows) {
        REQUIRE(rig_window(&bench.rig, window.width_px, window.height_px, window.skip) == ERROR_OK);
        REQUIRE(bench.capture(pair) == ERROR_OK);
        CHECK(pair.frame[RIG_LEFT].image.width_px == window.width_px / window.skip);
        CHECK(pair.frame[RIG_RIGHT].image.height_px == window.height_px / window.skip);
        CHECK(double(pair.frame[RIG_LEFT].exposure_us) == doctest::Approx(20000).epsilon(0.002));
    }
    CHECK(rig_window(&bench.rig, 2050, 96, 1) == ERROR_RANGE);
    CHECK(rig_window(&bench.rig, 128, 95, 1) == ERROR_RANGE);
    CHECK(bench.rig.state == RIG_READY);
}

TEST_CASE("no frame was exposed while its camera turned or its lens moved") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    uint32_t applied_us = 0;
    REQUIRE(rig_exposure(&bench.rig, kBoth, 1000000, &applied_us) == ERROR_OK);
    bench.rig.profile.skew_limit_us = 3000000;
    constexpr uint64_t kReading_us = 200000;  // the last readings of a lens that has arrived
    ::pair pair{};
    for (int i = 0; i < 4; i++) {
        CAPTURE(i);
        REQUIRE(bench.idle_ms(4000 + uint64_t(i) * 170) == ERROR_OK);
        const bool turns = i % 2 == 0;
        const int error = turns ? rig_pan_both(&bench.rig, 20000 * (i + 1), -20000 * (i + 1))
                                : rig_lens_move_to(&bench.rig, kBoth, LENS_ZOOM, 320 + 10 * i);
        REQUIRE_MESSAGE(error == ERROR_OK, bench.rig.last_error.text);
        const uint64_t rested_us = bench.now_us() - (turns ? 0 : kReading_us);
        REQUIRE_MESSAGE(bench.capture(pair) == ERROR_OK, bench.rig.last_error.text);
        for (const pair_frame &frame : pair.frame) {
            CHECK(frame.begin_us >= rested_us + frame.exposure_us);
        }
    }
}

TEST_CASE("a lens that moves meanwhile makes it no pair") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    ::pair pair{};
    bool sent = false;
    bench.keep_going = [&bench, &sent] {
        // Waits for the first frame: the positions before it have then been read.
        if (!sent && bench.rig.health[RIG_PART_RIGHT_LENS].uses >= 2) {
            sent = true;
            send_to_lens(bench, "2F700\n");
        }
        return true;
    };
    CHECK(bench.capture(pair) == ERROR_MOVED);
    CHECK(sent);
    CHECK(bench.rig.last_error.part == RIG_PART_RIGHT_LENS);
    const std::string text = bench.rig.last_error.text;
    CHECK_MESSAGE(text.rfind("right lens: its focus moved from 5", 0) == 0, text);
    const pair_frame &right = pair.frame[RIG_RIGHT];
    CHECK(right.after.lens[LENS_FOCUS].position_q4 >
          right.before.lens[LENS_FOCUS].position_q4 + 4 * 16);
    CHECK(bench.rig.state == RIG_READY);
    CHECK(bench.rig.pairs == 0);
    bench.keep_going = [] { return true; };
    CHECK(bench.idle_ms(2000) == ERROR_OK);
    CHECK(bench.capture(pair) == ERROR_OK);
}

TEST_CASE("a camera that turns meanwhile makes it no pair") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    REQUIRE(rig_pan_both(&bench.rig, 69289, -69289) == ERROR_OK);
    ::pair pair{};
    REQUIRE(bench.capture(pair) == ERROR_OK);
    for (int side = 0; side < RIG_SIDES; side++) {
        uint16_t width_q4 = 0;
        REQUIRE(servo_width_q4(&bench.rig.profile.servo[side], side == RIG_LEFT ? 69289 : -69289,
                               &width_q4) == ERROR_OK);
        CHECK(pair.frame[side].before.pan_q4 == width_q4);
        CHECK(pair.frame[side].after.pan_q4 == width_q4);
    }
    const uint32_t frames = bench.rig.health[RIG_PART_LEFT_CAMERA].uses;
    bool turned = false;
    bench.keep_going = [&] {
        if (!turned && bench.rig.health[RIG_PART_LEFT_CAMERA].uses > frames) {
            turned = true;
            write_register(bench, BRIDGE_I2C_ADDRESS, BRIDGE_SERVO1_TARGET_Q4, 24000);
        }
        return true;
    };
    CHECK(bench.capture(pair) == ERROR_MOVED);
    CHECK(turned);
    CHECK(bench.rig.last_error.part == RIG_PART_RIGHT_SERVO);
    CHECK(bench.rig.state == RIG_READY);
}

TEST_CASE("a scene that moves meanwhile is found when it is looked for") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    ::pair pair{};
    REQUIRE_MESSAGE(bench.capture(pair, true) == ERROR_OK, bench.rig.last_error.text);
    const uint32_t frames = bench.rig.health[RIG_PART_LEFT_CAMERA].uses;
    bool moved = false;
    bench.keep_going = [&] {
        if (!moved && bench.rig.health[RIG_PART_LEFT_CAMERA].uses > frames) {
            moved = true;
            bench.control("move board 15 0 0");
        }
        return true;
    };
    CHECK(bench.capture(pair, true) == ERROR_MOVED);
    CHECK(moved);
    CHECK(pair.checked);
    CHECK(pair.change_permille > 20);
    CHECK(bench.rig.last_error.part == RIG_PART_LEFT_CAMERA);
    CHECK(std::string(bench.rig.last_error.text).find("flicker") == std::string::npos);
    CHECK(bench.capture(pair, true) == ERROR_OK);
    // An exposure below half a period of the mains may see nothing but its lamps flicker.
    bench.rig.camera[RIG_LEFT].exposure_us = 6500;
    CHECK(pair_check_change(&bench.rig, RIG_LEFT, 3) == ERROR_MOVED);
    const std::string text = bench.rig.last_error.text;
    CHECK_MESSAGE(text.find("flicker in exposures below 10000 us") != std::string::npos, text);
}

TEST_CASE("frames too far apart are rejected") {
    rig_profile profile = small_profile();
    profile.skew_limit_us = 1000;
    RigBench bench(profile);
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    ::pair pair{};
    CHECK(bench.capture(pair) == ERROR_MOVED);
    CHECK(pair.skew_us > 1000);
    const std::string text = bench.rig.last_error.text;
    CHECK_MESSAGE(text.find("allowed: 1 ms") != std::string::npos, text);
}

TEST_CASE("frames of a wrong size are refused, by the bridge's counts too") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    ::pair pair{};
    write_register(bench, 0x5C, 0x04, 123);  // columns
    bench.advance_ms(200);
    CHECK(bench.capture(pair) == ERROR_FRAME);
    CHECK(bench.rig.last_error.part == RIG_PART_LEFT_CAMERA);
    const std::string text = bench.rig.last_error.text;
    CHECK_MESSAGE(text.find("wrong length") != std::string::npos, text);
    CHECK(bench.rig.state == RIG_READY);
    CHECK(rig_check(&bench.rig) == ERROR_VERIFY);
    CHECK(bench.rig.last_error.part == RIG_PART_LEFT_SENSOR);
    write_register(bench, 0x5C, 0x04, 127);
    write_register(bench, 0x5E, 0x03, 89);  // rows
    bench.advance_ms(200);
    CHECK(bench.capture(pair) == ERROR_FRAME);
    CHECK(bench.rig.last_error.part == RIG_PART_RIGHT_CAMERA);
    write_register(bench, 0x5E, 0x03, 95);
    bench.advance_ms(200);
    CHECK(bench.capture(pair) == ERROR_OK);
}

TEST_CASE("frames of a wrong size are refused when the bridge's counts can count no further") {
    constexpr uint16_t kFull = 255;
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    ::pair pair{};
    fpga_bridge_camera seen{};
    write_register(bench, 0x5C, 0x04, 123);  // columns
    bench.advance_ms(200);
    for (int i = 0; i < 10 && seen.short_lines < kFull; i++) {
        REQUIRE(bench.capture(pair) == ERROR_FRAME);
        REQUIRE(fpga_bridge_camera_read(&bench.rig.bridge, RIG_LEFT, &seen) == ERROR_OK);
    }
    REQUIRE(seen.short_lines == kFull);
    CHECK(bench.capture(pair) == ERROR_FRAME);
    CHECK(bench.rig.last_error.part == RIG_PART_LEFT_CAMERA);
    CHECK(bench.rig.state == RIG_READY);
    write_register(bench, 0x5C, 0x04, 127);
    bench.advance_ms(200);
    CHECK_MESSAGE(bench.capture(pair) == ERROR_OK, bench.rig.last_error.text);
}

TEST_CASE("a camera that falls silent is named within two seconds, and the rig is safe") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    ::pair pair{};
    bench.control("fault camera right silent");
    const uint64_t begin_us = bench.now_us();
    CHECK(bench.capture(pair) == ERROR_TIMEOUT);
    CHECK(bench.now_us() - begin_us < 2000000);
    CHECK(bench.rig.last_error.part == RIG_PART_RIGHT_CAMERA);
    CHECK(bench.rig.state == RIG_SAFE);
    CHECK(bench.capture(pair) == ERROR_NOT_READY);
    bench.control("fault camera right ok");
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    CHECK(bench.capture(pair) == ERROR_OK);
}

TEST_CASE("a capture can be cancelled at any time, and the next one works") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    ::pair pair{};
    uint64_t all = 0;
    bench.keep_going = [&all] { return ++all > 0; };
    REQUIRE_MESSAGE(bench.capture(pair, true) == ERROR_OK, bench.rig.last_error.text);
    for (uint64_t last = 0; last < all; last += 1 + all / 6) {
        uint64_t asked = 0;
        bench.keep_going = [&asked, last] { return asked++ < last; };
        const uint64_t begin_us = bench.now_us();
        CAPTURE(last);
        CHECK(bench.capture(pair, true) == ERROR_CANCELLED);
        CHECK(bench.now_us() - begin_us < 2000000);
        CHECK(bench.rig.state == RIG_READY);
    }
    bench.keep_going = [] { return true; };
    CHECK(bench.capture(pair, true) == ERROR_OK);
    CHECK(pair.number == 2);
}

TEST_CASE("what is not brought up takes no pair") {
    RigBench bench;
    ::pair pair{};
    CHECK(bench.capture(pair) == ERROR_NOT_READY);
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    CHECK(pair.number == 0);
    CHECK(rig_safe(&bench.rig) == ERROR_OK);
    CHECK(bench.capture(pair) == ERROR_NOT_READY);
}
