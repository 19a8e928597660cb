// SPDX-License-Identifier: Apache-2.0
// The sensor's driver with the simulated sensor, through the Verilated bridge.
#include <doctest/doctest.h>

#include "bench/rig_bench.hpp"

using rig_bench::RigBench;

namespace {

uint16_t read_register(mt9t001 &sensor, uint8_t index) {
    uint16_t value = 0;
    REQUIRE(mt9t001_read(&sensor, index, &value) == ERROR_OK);
    return value;
}

void write_raw(RigBench &bench, uint8_t index, uint16_t value) {
    uint8_t bytes[] = {index, uint8_t(value >> 8), uint8_t(value)};
    const hal_i2c_message message = {bytes, sizeof bytes, 0x5C, false};
    size_t begun = 0;
    const hal_i2c &bus = bench.backend.i2c;
    REQUIRE(bus.operations->transfer(bus.self, &message, 1, bench.now_us() + 25000, &begun) ==
            ERROR_OK);
}

}  // namespace

TEST_CASE("windows, exposure and gain are in the registers that the datasheet has for them") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    mt9t001 &sensor = bench.rig.camera[RIG_LEFT].sensor;
    CHECK(read_register(sensor, 0x00) == 0x1621);
    mt9t001_window window{};
    REQUIRE(mt9t001_centred_window(1024, 768, 2, 2, &window) == ERROR_OK);
    window.hblank_clocks = 300;
    window.vblank_rows = 40;
    REQUIRE(mt9t001_set_window(&sensor, &window) == ERROR_OK);
    CHECK(read_register(sensor, 0x01) == 20 + 384);
    CHECK(read_register(sensor, 0x02) == 32 + 512);
    CHECK(read_register(sensor, 0x03) == 767);
    CHECK(read_register(sensor, 0x04) == 1023);
    CHECK(read_register(sensor, 0x05) == 300);
    CHECK(read_register(sensor, 0x06) == 40);
    // Skip in the low bits, binning from bit 4 on; rows and columns alike.
    CHECK(read_register(sensor, 0x22) == 0x11);
    CHECK(read_register(sensor, 0x23) == 0x11);
    window.bin = 1;
    REQUIRE(mt9t001_set_window(&sensor, &window) == ERROR_OK);
    CHECK(read_register(sensor, 0x22) == 0x01);
    CHECK(read_register(sensor, 0x07) == 0x0002);  // no longer frozen
    REQUIRE(mt9t001_set_shutter(&sensor, 0x2BEEF) == ERROR_OK);
    CHECK(read_register(sensor, 0x08) == 2);
    CHECK(read_register(sensor, 0x09) == 0xBEEF);
    REQUIRE(mt9t001_set_gain(&sensor, 80) == ERROR_OK);
    for (uint8_t index = 0x2B; index <= 0x2E; index++) {
        CHECK(read_register(sensor, index) == 0x0260);
    }
    CHECK(sensor.counts.failures == 0);
    CHECK(sensor.counts.mismatches == 0);
    CHECK(mt9t001_check(&sensor) == ERROR_OK);
    CHECK(read_register(bench.rig.camera[RIG_RIGHT].sensor, 0x22) == 0);
}

TEST_CASE("a check distinguishes a wrong register from a restarted sensor") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    mt9t001 &sensor = bench.rig.camera[RIG_LEFT].sensor;
    write_raw(bench, 0x09, 77);
    CHECK(mt9t001_check(&sensor) == ERROR_VERIFY);
    REQUIRE(mt9t001_set_shutter(&sensor, 78) == ERROR_OK);
    CHECK(mt9t001_check(&sensor) == ERROR_OK);
    write_raw(bench, 0x0D, 1);
    write_raw(bench, 0x0D, 0);
    CHECK(mt9t001_check(&sensor) == ERROR_RESTARTED);
}

TEST_CASE("a change that fails half way is taken back") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    mt9t001 &sensor = bench.rig.camera[RIG_LEFT].sensor;
    const mt9t001_window before = sensor.window;
    mt9t001_window window{};
    REQUIRE(mt9t001_centred_window(640, 480, 1, 1, &window) == ERROR_OK);
    // One transfer after the other fails with an error that is not retried.
    for (uint64_t first = 0; first < 6; first++) {
        bench.faulty.fail({rig_bench::Port::kI2c, first, false, ERROR_DEVICE});
        CHECK(mt9t001_set_window(&sensor, &window) == ERROR_DEVICE);
        CHECK(sensor.window.width_px == before.width_px);
        bench.faulty.fail({});
        CHECK(mt9t001_check(&sensor) == ERROR_OK);
    }
    CHECK(mt9t001_set_window(&sensor, &window) == ERROR_OK);
    CHECK(mt9t001_check(&sensor) == ERROR_OK);
}

TEST_CASE("a transfer that the adapter lost once is made good, of sensor and bridge") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    mt9t001 &sensor = bench.rig.camera[RIG_LEFT].sensor;
    const uint32_t rows = sensor.shutter_rows;
    for (uint64_t call = 0; call < 3; call++) {
        bench.faulty.fail({rig_bench::Port::kI2c, call, false, ERROR_IO});
        CHECK(mt9t001_set_shutter(&sensor, rows + 1 + uint32_t(call)) == ERROR_OK);
        CHECK(bench.faulty.failed_us() != 0);
        bench.faulty.fail({});
        CHECK(mt9t001_check(&sensor) == ERROR_OK);
    }
    uint16_t value = 0;
    bench.faulty.fail({rig_bench::Port::kI2c, 0, false, ERROR_IO});
    CHECK(fpga_bridge_read(&bench.rig.bridge, BRIDGE_ID, &value) == ERROR_OK);
    CHECK(value == fpga_bridge_register(BRIDGE_ID)->reset);
    // A word that must not be accepted twice is not sent twice, as the bus may have seen all of it.
    bench.faulty.fail({rig_bench::Port::kI2c, 0, false, ERROR_IO});
    CHECK(fpga_bridge_start(&bench.rig.bridge, BRIDGE_IRQ_TEST, 1) == ERROR_IO);
    CHECK(bench.faulty.calls(rig_bench::Port::kI2c) == 1);
    // A lasting fault is reported after a few attempts.
    bench.faulty.fail({rig_bench::Port::kI2c, 0, true, ERROR_IO});
    CHECK(fpga_bridge_read(&bench.rig.bridge, BRIDGE_ID, &value) == ERROR_IO);
    CHECK(mt9t001_check(&sensor) == ERROR_IO);
    CHECK(bench.faulty.calls(rig_bench::Port::kI2c) == 8);
    bench.faulty.fail({});
}

TEST_CASE("after a change whose taking back failed too, the next one writes all") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    mt9t001 &sensor = bench.rig.camera[RIG_LEFT].sensor;
    mt9t001_window window{};
    REQUIRE(mt9t001_centred_window(640, 480, 1, 1, &window) == ERROR_OK);
    for (uint64_t first = 1; first < 5; first++) {
        CAPTURE(first);
        // The bus fails in the middle of a change, and recovers.
        bench.faulty.fail({rig_bench::Port::kI2c, first, true, ERROR_DEVICE});
        CHECK(mt9t001_set_window(&sensor, &window) == ERROR_DEVICE);
        bench.faulty.fail({});
        const uint32_t rows = sensor.shutter_rows + 1;
        REQUIRE(mt9t001_set_shutter(&sensor, rows) == ERROR_OK);
        CHECK(sensor.shutter_rows == rows);
        CHECK(mt9t001_check(&sensor) == ERROR_OK);
        // Then differences are sufficient again: freeze, one word, unfreeze.
        REQUIRE(mt9t001_set_shutter(&sensor, rows - 1) == ERROR_OK);
        CHECK(bench.faulty.calls(rig_bench::Port::kI2c) > 3);
        bench.faulty.fail({});
        REQUIRE(mt9t001_set_shutter(&sensor, rows) == ERROR_OK);
        CHECK(bench.faulty.calls(rig_bench::Port::kI2c) == 3);
    }
}
