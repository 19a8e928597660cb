// SPDX-License-Identifier: Apache-2.0
// Regions of one sensor on the simulated rig: fast frames anywhere, and everything as before
// afterwards.
#include <doctest/doctest.h>

#include <map>
#include <string>
#include <vector>

#include "bench/rig_bench.hpp"
#include "rig/rig_region.h"

using rig_bench::RigBench;
using rig_bench::small_profile;

namespace {

// The registers that the sensor's data sheet describes.
constexpr unsigned kIndices[] = {0x00, 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0x09, 0x0A,
                                 0x0B, 0x0C, 0x0D, 0x1E, 0x20, 0x22, 0x23, 0x2B, 0x2C, 0x2D, 0x2E,
                                 0x32, 0x35, 0x49, 0x5F, 0x60, 0x61, 0x62, 0x63, 0x64};

struct Registers {
    std::map<unsigned, uint16_t> sensor[RIG_SIDES];
    uint16_t expect_width = 0, expect_height = 0, control = 0;
    bool operator==(const Registers &other) const {
        return sensor[0] == other.sensor[0] && sensor[1] == other.sensor[1] &&
               expect_width == other.expect_width && expect_height == other.expect_height &&
               control == other.control;
    }
};

Registers registers_of(RigBench &bench) {
    Registers found;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        for (const unsigned index : kIndices) {
            uint16_t value = 0;
            REQUIRE(mt9t001_read(&bench.rig.camera[side].sensor, uint8_t(index), &value) ==
                    ERROR_OK);
            found.sensor[side][index] = value;
        }
    }
    fpga_bridge *bridge = &bench.rig.bridge;
    REQUIRE(fpga_bridge_read(bridge, BRIDGE_EXPECT_WIDTH, &found.expect_width) == ERROR_OK);
    REQUIRE(fpga_bridge_read(bridge, BRIDGE_EXPECT_HEIGHT, &found.expect_height) == ERROR_OK);
    REQUIRE(fpga_bridge_read(bridge, BRIDGE_CTRL, &found.control) == ERROR_OK);
    return found;
}

}  // namespace

TEST_CASE("a region of 100 x 100 px gives several hundred frames a second") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    for (const uint32_t exposure_us : {500u, 5000u}) {
        for (unsigned side = 0; side < RIG_SIDES; side++) {
            const rig_rectangle where = {974, 718, 100, 100};
            rig_region region{};
            const uint64_t begun_us = bench.now_us();
            REQUIRE(rig_region_begin(&bench.rig, &region, side, &where, 1) == ERROR_OK);
            uint32_t applied_us = 0;
            REQUIRE(rig_region_exposure(&bench.rig, &region, exposure_us, &applied_us) == ERROR_OK);
            rig_region_frame frame{};
            REQUIRE(rig_region_take(&bench.rig, &region, 0, &frame) == ERROR_OK);
            raw_image_release(&frame.image);
            const uint64_t first_us = bench.now_us();
            const uint64_t first_exposed_us = frame.exposed_us;
            const int frames = 10;
            for (int i = 0; i < frames; i++) {
                REQUIRE(rig_region_take(&bench.rig, &region, 0, &frame) == ERROR_OK);
                raw_image_release(&frame.image);
            }
            const double fps = frames * 1e6 / double(frame.exposed_us - first_exposed_us);
            const uint64_t until_us = bench.now_us();
            REQUIRE(rig_region_end(&bench.rig, &region, false) == ERROR_OK);
            MESSAGE("side ", side, ": exposure ", applied_us, " us: ", fps,
                    " frames/s, first after ", first_us - begun_us, " us, end took ",
                    bench.now_us() - until_us, " us; black ", frame.black);
            CHECK(frame.exposure_us == applied_us);
            CHECK(fps > (exposure_us < 1000 ? 300 : 100));
        }
    }
}

TEST_CASE("a region is anywhere on the sensor of either side, and leaves no trace") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    uint32_t applied_us = 0;
    uint16_t applied_q3 = 0;
    REQUIRE(rig_exposure(&bench.rig, 1, 3000, &applied_us) == ERROR_OK);
    REQUIRE(rig_exposure(&bench.rig, 2, 7000, &applied_us) == ERROR_OK);
    REQUIRE(rig_gain(&bench.rig, 2, 24, &applied_q3) == ERROR_OK);
    const Registers before = registers_of(bench);
    const mt9t001 sensors[] = {bench.rig.camera[0].sensor, bench.rig.camera[1].sensor};
    const rig_rectangle corners[] = {
        {0, 0, 64, 48},       {2048 - 64, 0, 64, 48}, {0, 1536 - 48, 64, 48},
        {1984, 1488, 64, 48}, {0, 0, 2048, 48},       {990, 700, 18, 1536 - 700},
    };
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const uint32_t exposure_us = bench.rig.camera[side].exposure_us;
        for (const rig_rectangle &where : corners) {
            CAPTURE(side);
            CAPTURE(where.column_px);
            CAPTURE(where.row_px);
            rig_region region{};
            REQUIRE(rig_region_begin(&bench.rig, &region, side, &where, 1) == ERROR_OK);
            Registers during = registers_of(bench);
            CHECK(during.sensor[1 - side] == before.sensor[1 - side]);
            std::map<unsigned, uint16_t> &own = during.sensor[side];
            CHECK(own[0x01] == 20 + where.row_px);
            CHECK(own[0x02] == 32 + where.column_px);
            CHECK(own[0x03] == where.height_px - 1);
            CHECK(own[0x04] == where.width_px - 1);
            CHECK(own[0x05] == 21);
            CHECK(own[0x06] == 3);
            rig_region_frame frame{};
            const uint64_t asked_us = bench.now_us();
            REQUIRE(rig_region_take(&bench.rig, &region, asked_us, &frame) == ERROR_OK);
            CHECK(frame.image.width_px == where.width_px);
            CHECK(frame.image.height_px == where.height_px);
            CHECK(frame.black == 42);
            CHECK(frame.gain_q3 == bench.rig.camera[side].gain_q3);
            CHECK(frame.exposure_us == doctest::Approx(exposure_us).epsilon(0.01));
            CHECK(frame.exposed_us >= asked_us + frame.exposure_us / 2);
            CHECK(frame.exposed_us <= bench.now_us());
            raw_image_release(&frame.image);
            REQUIRE(rig_region_gain(&bench.rig, &region, 16, &applied_q3) == ERROR_OK);
            REQUIRE(rig_region_exposure(&bench.rig, &region, 900, &applied_us) == ERROR_OK);
            REQUIRE(rig_region_end(&bench.rig, &region, false) == ERROR_OK);
            CHECK(registers_of(bench) == before);
            CHECK(bench.rig.camera[side].sensor.shutter_rows == sensors[side].shutter_rows);
            CHECK(bench.rig.camera[side].exposure_us == exposure_us);
            CHECK(bench.rig.format.width_px == 128);
        }
    }
    ::pair pair{};
    CHECK(bench.capture(pair) == ERROR_OK);
}

TEST_CASE("a cancelled region leaves no trace, whenever it is cancelled") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    uint32_t applied_us = 0;
    REQUIRE(rig_exposure(&bench.rig, 3, 3000, &applied_us) == ERROR_OK);
    const Registers before = registers_of(bench);
    const rig_rectangle where = {400, 300, 64, 48};
    int cancelled = 0;
    for (int allowed = 0;; allowed++) {
        CAPTURE(allowed);
        int asked = 0;
        // From then on until the region has ended.
        bench.keep_going = [&] { return asked++ < allowed; };
        rig_region region{};
        rig_region_frame frame{};
        int error = rig_region_begin(&bench.rig, &region, RIG_RIGHT, &where, 1);
        for (int i = 0; i < 2 && error == ERROR_OK; i++) {
            error = rig_region_take(&bench.rig, &region, 0, &frame);
            raw_image_release(&frame.image);
        }
        const bool as_asked = error == ERROR_OK || error == ERROR_CANCELLED;
        CHECK(as_asked);
        CHECK(rig_region_end(&bench.rig, &region, false) == ERROR_OK);
        CHECK(bench.rig.state == RIG_READY);
        CHECK(registers_of(bench) == before);
        if (error == ERROR_OK) {
            break;
        }
        cancelled++;
    }
    CHECK(cancelled >= 3);
    bench.keep_going = [] { return true; };
    ::pair pair{};
    CHECK(bench.capture(pair) == ERROR_OK);
}

TEST_CASE("a region outside the sensor is rejected with the limits") {
    RigBench bench;
    rig_region region{};
    const rig_rectangle good = {0, 0, 64, 48};
    CHECK(rig_region_begin(&bench.rig, &region, RIG_LEFT, &good, 1) == ERROR_NOT_READY);
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    const Registers before = registers_of(bench);
    for (const rig_rectangle &where :
         {rig_rectangle{1990, 0, 64, 48}, rig_rectangle{0, 1490, 64, 48},
          rig_rectangle{1, 0, 64, 48}, rig_rectangle{0, 0, 63, 48}, rig_rectangle{0, 0, 64, 0},
          rig_rectangle{65534, 65534, 64, 48}, rig_rectangle{0, 0, 65534, 65534}}) {
        CHECK(rig_region_begin(&bench.rig, &region, RIG_LEFT, &where, 1) == ERROR_RANGE);
        CHECK(std::string(bench.rig.rejected.text).find("2048 x 1536 px") != std::string::npos);
        CHECK(rig_region_end(&bench.rig, &region, false) == ERROR_OK);
    }
    CHECK(rig_region_begin(&bench.rig, &region, RIG_LEFT, &good, 3) == ERROR_RANGE);
    CHECK(registers_of(bench) == before);
    CHECK(bench.rig.state == RIG_READY);
    // The whole field, every eighth pixel: for the exposure.
    const rig_rectangle all = {0, 0, 2048, 1536};
    rig_region_frame frame{};
    REQUIRE(rig_region_begin(&bench.rig, &region, RIG_LEFT, &all, 8) == ERROR_OK);
    REQUIRE(rig_region_take(&bench.rig, &region, 0, &frame) == ERROR_OK);
    CHECK(frame.image.width_px == 256);
    CHECK(frame.image.height_px == 192);
    raw_image_release(&frame.image);
    REQUIRE(rig_region_end(&bench.rig, &region, false) == ERROR_OK);
    CHECK(registers_of(bench) == before);
}

TEST_CASE("exposure and gain may stay after a region") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    const mt9t001_window window = bench.rig.camera[RIG_LEFT].sensor.window;
    const rig_rectangle where = {400, 300, 64, 48};
    rig_region region{};
    uint32_t applied_us = 0;
    uint16_t applied_q3 = 0;
    REQUIRE(rig_region_begin(&bench.rig, &region, RIG_LEFT, &where, 1) == ERROR_OK);
    REQUIRE(rig_region_exposure(&bench.rig, &region, 6000, &applied_us) == ERROR_OK);
    REQUIRE(rig_region_gain(&bench.rig, &region, 32, &applied_q3) == ERROR_OK);
    REQUIRE(rig_region_end(&bench.rig, &region, true) == ERROR_OK);
    CHECK(bench.rig.camera[RIG_LEFT].exposure_us == doctest::Approx(6000).epsilon(0.01));
    CHECK(bench.rig.camera[RIG_LEFT].gain_q3 == 32);
    CHECK(bench.rig.camera[RIG_LEFT].sensor.window.column_px == window.column_px);
    CHECK(bench.rig.camera[RIG_LEFT].sensor.window.vblank_rows == window.vblank_rows);
    ::pair pair{};
    REQUIRE(bench.capture(pair) == ERROR_OK);
    CHECK(pair.frame[RIG_LEFT].gain_q3 == 32);
    CHECK(pair.frame[RIG_LEFT].image.width_px == 128);
}

TEST_CASE("a camera that falls silent during a region makes the rig safe; a bring-up restores it") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    const Registers before = registers_of(bench);
    const rig_rectangle where = {400, 300, 64, 48};
    rig_region region{};
    rig_region_frame frame{};
    REQUIRE(rig_region_begin(&bench.rig, &region, RIG_RIGHT, &where, 1) == ERROR_OK);
    REQUIRE(rig_region_take(&bench.rig, &region, 0, &frame) == ERROR_OK);
    raw_image_release(&frame.image);
    bench.control("fault camera right silent");
    CHECK(rig_region_take(&bench.rig, &region, 0, &frame) == ERROR_TIMEOUT);
    const std::string text = bench.rig.last_error.text;
    CHECK_MESSAGE(text.find("right camera: ") == 0, text);
    CHECK(text.find('\n') == std::string::npos);
    CHECK(bench.rig.state == RIG_SAFE);
    CHECK(rig_region_end(&bench.rig, &region, false) == ERROR_OK);
    CHECK(bench.rig.last_error.text == text);
    bench.control("fault camera right ok");
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    CHECK(registers_of(bench) == before);
}

TEST_CASE("the light changes in the frames that were exposed then") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    const rig_rectangle where = {974, 718, 100, 100};
    rig_region region{};
    uint32_t exposure_us = 0;
    REQUIRE(rig_region_begin(&bench.rig, &region, RIG_LEFT, &where, 1) == ERROR_OK);
    REQUIRE(rig_region_exposure(&bench.rig, &region, 8000, &exposure_us) == ERROR_OK);
    const auto taken = [&](uint64_t *exposed_us) {
        rig_region_frame frame{};
        REQUIRE(rig_region_take(&bench.rig, &region, 0, &frame) == ERROR_OK);
        pair_frame as_pair{};
        as_pair.image = frame.image;
        const double mean = bench.mean(as_pair) - frame.black;
        raw_image_release(&frame.image);
        *exposed_us = frame.exposed_us;
        return mean;
    };
    uint64_t exposed_us = 0;
    const double bright = taken(&exposed_us);
    REQUIRE(bright > 20);
    bench.control("light 0");
    const uint64_t dark_us = bench.now_us();
    int dark = 0;
    for (int i = 0; i < 6; i++) {
        const double mean = taken(&exposed_us);
        CAPTURE(mean);
        // The rows around the middle one are read up to 0.6 ms before and after. The simulated rig
        // does not divide an exposure in which the light changes.
        if (exposed_us + exposure_us / 2 + 600 < dark_us) {
            CHECK(mean > 0.9 * bright);
        } else if (exposed_us > dark_us + exposure_us / 2 + 600) {
            CHECK(mean < 0.1 * bright);
            dark++;
        }
    }
    CHECK(dark >= 3);
    CHECK(rig_region_end(&bench.rig, &region, false) == ERROR_OK);
}
