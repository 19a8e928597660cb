// SPDX-License-Identifier: Apache-2.0
// Autofocus on the simulated rig: it ends in focus, whatever fails or is cancelled leaves rings at
// rest and the camera as it was. Random; replay a failure with VERGENCE_SEED.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

#include "bench/rig_bench.hpp"
#include "rig/auto/autofocus.h"
#include "synthetic/seed.hpp"

using rig_bench::Fault;
using rig_bench::Port;
using rig_bench::RigBench;
using rig_bench::small_profile;

namespace {

constexpr rig_rectangle kRegion = {984, 732, 64, 64};
// Squares of a few dozen pixels in ambient light: quick to render, and sharp only in focus.
constexpr const char *kScene =
    "room: {origin_mm: [125, 0, 1800], tilt_deg: 0}\n"
    "lights: []\n"
    "ambient: [600, 600, 600]\n"
    "floor_ambient: [600, 600, 600]\n"
    "bounce_lux: 0\n"
    "materials:\n"
    "  - print: {kind: board, contrast: 0, colours: [[0.8, 0.8, 0.8], [0.05, 0.05, 0.05]],"
    " board: {columns: 100, rows: 70, square_mm: 8}}\n"
    "objects:\n"
    "  - sheet: {name: board, material: print, position_mm: [0, 0, 0], size_mm: [1200, 900]}\n";

struct Bench : RigBench {
    scratch folder;
    Bench() : RigBench(small_profile()) { control("scene " + folder.write("scene.yaml", kScene)); }
};

// Of the region: the ring's position that is sharp, and where the ring is.
struct Truth {
    double sharp = 0, ring = 0, blur_px = 0;
};

Truth truth_of(RigBench &bench, unsigned side) {
    char command[80];
    std::snprintf(command, sizeof command, "sharp %s %d %d %d %d", rig_side_names[side],
                  kRegion.column_px, kRegion.row_px, kRegion.width_px, kRegion.height_px);
    const std::string answer = bench.control(command);
    const auto value = [&](const char *line, const char *name) {
        size_t at = answer.find(line);
        at = at == std::string::npos ? at : answer.find(name, at);
        REQUIRE_MESSAGE(at != std::string::npos, answer);
        return std::atof(answer.c_str() + at + std::string(name).size());
    };
    return {value("median:", " focus: "), value("focus: ", "focus: "),
            value("median:", "blur_px: ")};
}

// At 3.5x on a board 1.8 m away, out of focus.
void aim(RigBench &bench) {
    uint32_t applied_us = 0;
    REQUIRE_MESSAGE(rig_bringup(&bench.rig) == ERROR_OK, bench.rig.last_error.text);
    REQUIRE(rig_pan_both(&bench.rig, 62308, -57107) == ERROR_OK);
    REQUIRE(rig_lens_move_to(&bench.rig, 3, LENS_ZOOM, 450) == ERROR_OK);
    REQUIRE(rig_lens_move_to(&bench.rig, 3, LENS_FOCUS, 700) == ERROR_OK);
    REQUIRE(rig_lens_move_to(&bench.rig, 3, LENS_IRIS, 700) == ERROR_OK);
    REQUIRE(rig_exposure(&bench.rig, 3, 20000, &applied_us) == ERROR_OK);
}

struct Settings {
    hal_camera_format format;
    uint32_t exposure_us;
    uint16_t gain_q3;
    mt9t001_window window;

    explicit Settings(const RigBench &bench, unsigned side)
        : format(bench.rig.format),
          exposure_us(bench.rig.camera[side].exposure_us),
          gain_q3(bench.rig.camera[side].gain_q3),
          window(bench.rig.camera[side].sensor.window) {}
};

void check_same(const Settings &a, const Settings &b) {
    CHECK(a.format.width_px == b.format.width_px);
    CHECK(a.format.height_px == b.format.height_px);
    CHECK(a.exposure_us == b.exposure_us);
    CHECK(a.gain_q3 == b.gain_q3);
    CHECK(a.window.column_px == b.window.column_px);
    CHECK(a.window.width_px == b.window.width_px);
    CHECK(a.window.hblank_clocks == b.window.hblank_clocks);
}

bool is_at_rest(RigBench &bench, unsigned side) {
    const double before = truth_of(bench, side).ring;
    bench.advance_ms(200);
    return std::abs(truth_of(bench, side).ring - before) < 0.01;
}

rig_autofocus_options small_region() {
    rig_autofocus_options options{};
    options.region_px = kRegion;
    return options;
}

}  // namespace

TEST_CASE("both lenses end in focus, and everything else is as before") {
    Bench bench;
    aim(bench);
    const Settings before[] = {Settings(bench, RIG_LEFT), Settings(bench, RIG_RIGHT)};
    const rig_autofocus_options options = small_region();
    const uint64_t begin_us = bench.now_us();
    REQUIRE_MESSAGE(rig_autofocus(&bench.rig, 3, &options) == ERROR_OK, bench.rig.last_error.text);
    MESSAGE("both lenses: " << double(bench.now_us() - begin_us) * 1e-6 << " s");
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const rig_focus &focus = bench.rig.camera[side].focus;
        const Truth truth = truth_of(bench, side);
        CAPTURE(side);
        MESSAGE("ring " << truth.ring << ", sharp at " << truth.sharp << ", " << focus.frames
                        << " frames, blur " << truth.blur_px << " px, reported "
                        << focus.search.result.blur_px);
        CHECK(focus.done);
        CHECK(focus.search.result.verdict == FOCUS_FOCUSED);
        CHECK(std::abs(truth.ring - truth.sharp) <= 2.5);
        CHECK(focus.frames <= 250);
        CHECK(is_at_rest(bench, side));
        check_same(before[side], Settings(bench, side));
    }
    // It was learned: at once near it.
    REQUIRE(rig_lens_move_to(&bench.rig, 1, LENS_FOCUS, 400) == ERROR_OK);
    REQUIRE(rig_autofocus(&bench.rig, 1, &options) == ERROR_OK);
    const Truth truth = truth_of(bench, RIG_LEFT);
    CHECK(bench.rig.camera[RIG_LEFT].focus.was_expected);
    CHECK(bench.rig.camera[RIG_LEFT].focus.search.result.verdict == FOCUS_FOCUSED);
    CHECK(std::abs(truth.ring - truth.sharp) <= 2.5);
}

TEST_CASE("cancelled at any moment, rings rest and the camera is as before") {
    const uint64_t seed = synthetic::test_seed();
    std::mt19937_64 random(seed);
    Bench bench;
    aim(bench);
    const Settings before[] = {Settings(bench, RIG_LEFT), Settings(bench, RIG_RIGHT)};
    const rig_autofocus_options options = small_region();
    for (int i = 0; i < 2; i++) {
        const uint64_t stop_us = bench.now_us() + 50000 + random() % 8000000;
        bench.keep_going = [&] { return bench.now_us() < stop_us; };
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        CHECK(rig_autofocus(&bench.rig, 3, &options) == ERROR_CANCELLED);
        bench.keep_going = [] { return true; };
        CHECK(bench.rig.state == RIG_READY);
        for (unsigned side = 0; side < RIG_SIDES; side++) {
            CHECK(is_at_rest(bench, side));
            check_same(before[side], Settings(bench, side));
            CHECK(!bench.rig.camera[side].focus.done);
        }
    }
}

TEST_CASE("a call that fails in mid-search, once or for ever") {
    const uint64_t seed = synthetic::test_seed();
    std::mt19937_64 random(seed);
    Bench bench;
    aim(bench);
    const rig_autofocus_options options = small_region();
    const Fault kinds[] = {
        {Port::kI2c, 0, false, ERROR_I2C_NACK},
        {Port::kI2c, 0, true, ERROR_DEVICE},
        {Port::kCamera, 0, true, ERROR_DEVICE},
        {Port::kUart, 0, true, ERROR_DEVICE},
    };
    for (Fault fault : kinds) {
        bench.faulty.fail({});
        if (bench.rig.state != RIG_READY) {
            aim(bench);
        }
        // FaultyPorts counts from here.
        fault.call = 5 + random() % (fault.port == Port::kCamera ? 20 : 300);
        CAPTURE(seed);
        CAPTURE(int(fault.port));
        CAPTURE(fault.call);
        bench.faulty.fail(fault);
        const int error = rig_autofocus(&bench.rig, 1, &options);
        const bool failed = bench.faulty.failed_us() != 0;
        bench.faulty.fail({});
        CHECK(failed);
        CHECK((error != ERROR_OK || !fault.for_ever));
        // Nothing stops a lens whose line has gone: it ends its way.
        bench.advance_ms(fault.port == Port::kUart ? 5000 : 0);
        CHECK(is_at_rest(bench, RIG_LEFT));
    }
}

TEST_CASE("a lens that jams in mid-sweep is reported as such") {
    Bench bench;
    aim(bench);
    bench.control("fault lens left focus jam");
    const rig_autofocus_options options = small_region();
    CHECK(rig_autofocus(&bench.rig, 1, &options) == ERROR_JAMMED);
    CHECK(bench.rig.camera[RIG_LEFT].focus.search.result.verdict == FOCUS_LENS_JAMMED);
    CHECK(bench.rig.last_error.part == RIG_PART_LEFT_LENS);
    CHECK(is_at_rest(bench, RIG_LEFT));
}

TEST_CASE("a lens that jams while the other one is searched ends both") {
    Bench bench;
    aim(bench);
    const Settings before(bench, RIG_RIGHT);
    bench.control("fault lens right focus jam");
    const rig_autofocus_options options = small_region();
    CHECK(rig_autofocus(&bench.rig, 3, &options) == ERROR_JAMMED);
    CHECK(bench.rig.camera[RIG_RIGHT].focus.search.result.verdict == FOCUS_LENS_JAMMED);
    CHECK(bench.rig.camera[RIG_LEFT].focus.search.result.verdict != FOCUS_LENS_JAMMED);
    CHECK(!bench.rig.camera[RIG_LEFT].focus.done);
    CHECK(bench.rig.last_error.part == RIG_PART_RIGHT_LENS);
    CHECK(is_at_rest(bench, RIG_LEFT));
    CHECK(is_at_rest(bench, RIG_RIGHT));
    check_same(before, Settings(bench, RIG_RIGHT));
}
