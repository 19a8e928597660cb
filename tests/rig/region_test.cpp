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
        for (unsigned index = 0; index <= 0x64; index++) {
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
            enum { FRAMES = 40 };
            for (int i = 0; i < FRAMES; i++) {
                REQUIRE(rig_region_take(&bench.rig, &region, 0, &frame) == ERROR_OK);
                raw_image_release(&frame.image);
            }
            const double fps = FRAMES * 1e6 / double(frame.exposed_us - first_exposed_us);
            const uint64_t until_us = bench.now_us();
            REQUIRE(rig_region_end(&bench.rig, &region, false) == ERROR_OK);
            MESSAGE("side ", side, ": exposure ", applied_us, " us: ", fps,
                    " frames/s, first after ", first_us - begun_us, " us, end took ",
                    bench.now_us() - until_us, " us; black ", frame.black);
            CHECK(frame.exposure_us == applied_us);
        }
    }
}

TEST_CASE("a region is anywhere on the sensor of either side, and leaves no trace") {
    RigBench bench(small_profile(), "cylinder");
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
