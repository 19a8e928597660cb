// SPDX-License-Identifier: Apache-2.0
// The driver's typed access: every register of the map with its range, every function, and
// arguments that must be rejected without a transfer.
#include <doctest/doctest.h>

#include <vector>

#include "bench/driver_rig.hpp"
#include "bench/servo_checker.hpp"
#include "device/fpga_bridge_camera.h"
#include "device/fpga_bridge_event.h"
#include "device/fpga_bridge_sensor.h"
#include "device/fpga_bridge_servo.h"

namespace {

using hdl::kMs;
using hdl::kUs;

bool has_codes(const bridge_register &row) {
    return row.index == BRIDGE_CAM_SELECT || row.index == BRIDGE_WDG ||
           row.index == BRIDGE_PATTERN_KIND || row.index == BRIDGE_BRANCH_CTRL;
}

// Writes one value, which is in the register's range, and checks it.
void write_one(hdl::DriverRig &rig, const bridge_register &row, uint16_t value) {
    INFO("register " << int(row.index) << ", value " << value);
    const auto before = rig.world.peek(row.index);
    const bool locked = (row.flags & BRIDGE_UNLOCK_ONLY) != 0;
    const int error = locked ? fpga_bridge_write_unlocked(&rig.driver, row.index, value)
                             : fpga_bridge_write(&rig.driver, row.index, value);
    const bool known =
        error == ERROR_OK || (error == ERROR_REFUSED && (has_codes(row) || value == 0));
    CHECK(known);
    const auto after = rig.world.peek(row.index);
    REQUIRE(before);
    REQUIRE(after);
    const unsigned kept = error == ERROR_OK ? value : *before & row.stored_mask;
    CHECK((*after & row.stored_mask) == kept);
    uint16_t seen = 0;
    CHECK(fpga_bridge_read(&rig.driver, row.index, &seen) == ERROR_OK);
    CHECK((seen & row.stored_mask) == kept);
}

// A servo's pulses are required while `during` runs.
template <typename During>
size_t pulses_during(hdl::DriverRig &rig, int servo, During during) {
    const size_t before = rig.world.bridge.servos().pulses(servo).size();
    during();
    rig.bus.wait(70 * kMs);
    return rig.world.bridge.servos().pulses(servo).size() - before;
}

}  // namespace

TEST_CASE("every register: what its row allows is written, the rest is refused unsent") {
    const uint64_t seed = synthetic::test_seed();
    INFO("seed " << seed);
    hdl::DriverRig rig(seed, 1000);
    hdl::Random random(seed);
    REQUIRE(rig.world.poke(BRIDGE_UNLOCK, 0));
    for (const bridge_register &row : bridge_registers) {
        if (row.stored_mask == 0) {
            continue;
        }
        for (uint64_t i = 0; i < hdl::draws(3) + 2; i++) {
            const auto drawn = uint16_t(random.between(row.min, row.max));
            auto value = uint16_t((i == 0 ? row.min : i == 1 ? row.max : drawn) & row.stored_mask);
            value = value < row.min ? row.min : value;
            write_one(rig, row, value);
        }
        rig.counted();
        const auto refused = [&](unsigned value) {
            CHECK(fpga_bridge_write(&rig.driver, row.index, uint16_t(value)) == ERROR_RANGE);
        };
        if (row.min > 0) {
            refused(row.min - 1u);
        }
        if (row.max < UINT16_MAX) {
            refused(row.max + 1u);
        }
        for (unsigned bit = 1; bit < 0x10000; bit <<= 1) {
            if ((row.stored_mask & bit) == 0) {
                refused(row.min | bit);
            }
        }
        CHECK(rig.counted() == "");
    }
    CHECK(rig.world.peek(BRIDGE_UNLOCK) == 0);
}

TEST_CASE("every index: what its register cannot do is refused unsent") {
    hdl::DriverRig rig;
    for (unsigned i = 0; i < 256; i++) {
        const auto index = uint8_t(i);
        INFO("index " << i);
        const bridge_register *row = fpga_bridge_register(index);
        const unsigned flags = row == nullptr ? 0 : row->flags;
        uint16_t words[FPGA_BRIDGE_BLOCK_WORDS] = {};
        fpga_bridge *driver = &rig.driver;
        if ((flags & BRIDGE_READ) == 0) {
            CHECK(fpga_bridge_read(driver, index, words) == ERROR_ARGUMENT);
            CHECK(fpga_bridge_touch(driver, index, words) == ERROR_ARGUMENT);
        }
        if ((flags & BRIDGE_WRITE) == 0 || row->stored_mask == 0) {
            CHECK(fpga_bridge_write(driver, index, 0) == ERROR_ARGUMENT);
            CHECK(fpga_bridge_update(driver, index, 1, 1) == ERROR_ARGUMENT);
        }
        if ((flags & BRIDGE_WRITE) == 0 || row->clear_mask == 0) {
            CHECK(fpga_bridge_clear(driver, index, 0) == ERROR_ARGUMENT);
        } else {
            CHECK(fpga_bridge_clear(driver, index, uint16_t(~row->clear_mask)) == ERROR_RANGE);
        }
        if ((flags & BRIDGE_WRITE) == 0 || row->pulse_mask == 0 || row->stored_mask != 0) {
            CHECK(fpga_bridge_start(driver, index, 0) == ERROR_ARGUMENT);
        } else {
            CHECK(fpga_bridge_start(driver, index, uint16_t(~row->pulse_mask)) == ERROR_RANGE);
        }
        CHECK(fpga_bridge_read_block(driver, index, 0, words) == ERROR_ARGUMENT);
        CHECK(fpga_bridge_read_block(driver, index, 9, words) == ERROR_ARGUMENT);
    }
    CHECK(fpga_bridge_update(&rig.driver, BRIDGE_CTRL, 1, 2) == ERROR_RANGE);
    CHECK(rig.counted() == "");
}

TEST_CASE("arguments of the typed functions are refused unsent") {
    hdl::DriverRig rig;
    fpga_bridge *driver = &rig.driver;
    fpga_bridge_servo servo;
    fpga_bridge_camera camera;
    const fpga_bridge_sensor_lines lines = {4, 0, 0, 0};
    CHECK(fpga_bridge_servo_read(driver, 2, &servo) == ERROR_ARGUMENT);
    CHECK(fpga_bridge_servo_aim(driver, 2, 24000) == ERROR_ARGUMENT);
    CHECK(fpga_bridge_servo_aim(driver, 0, 9599) == ERROR_RANGE);
    CHECK(fpga_bridge_servo_aim(driver, 1, 38401) == ERROR_RANGE);
    CHECK(fpga_bridge_servo_slew(driver, 1, 2048) == ERROR_RANGE);
    CHECK(fpga_bridge_servo_safe(driver, 1, 38401) == ERROR_RANGE);
    CHECK(fpga_bridge_servo_limits(driver, 2, 9600, 38400) == ERROR_ARGUMENT);
    CHECK(fpga_bridge_servo_enable(driver, ~0u, true) == ERROR_ARGUMENT);
    CHECK(fpga_bridge_camera_read(driver, 2, &camera) == ERROR_ARGUMENT);
    CHECK(fpga_bridge_camera_select(driver, 4) == ERROR_RANGE);
    CHECK(fpga_bridge_camera_switch_limit(driver, 0) == ERROR_RANGE);
    CHECK(fpga_bridge_camera_switch_limit(driver, 256) == ERROR_RANGE);
    CHECK(fpga_bridge_camera_ppi_mode(driver, 2) == ERROR_RANGE);
    CHECK(fpga_bridge_camera_expect(driver, 4096, 0) == ERROR_RANGE);
    CHECK(fpga_bridge_sensor_drive(driver, &lines) == ERROR_RANGE);
    CHECK(fpga_bridge_sensor_route(driver, true, 4) == ERROR_RANGE);
    CHECK(fpga_bridge_sensor_bus_clear(driver, 4) == ERROR_RANGE);
    CHECK(fpga_bridge_event_enable(driver, 0x100) == ERROR_RANGE);
    CHECK(fpga_bridge_watchdog_set(driver, 1000, 4) == ERROR_RANGE);
    CHECK(rig.counted() == "");
    driver->caps = 0;
    const fpga_bridge_pattern pattern = {64, 48, 16, 2, 0, 1};
    CHECK(fpga_bridge_camera_select(driver, 1) == ERROR_UNSUPPORTED);
    CHECK(fpga_bridge_camera_select(driver, 2) == ERROR_UNSUPPORTED);
    CHECK(fpga_bridge_camera_pattern(driver, &pattern) == ERROR_UNSUPPORTED);
    CHECK(fpga_bridge_camera_ppi_mode(driver, 0x100) == ERROR_UNSUPPORTED);
    CHECK(fpga_bridge_camera_read(driver, 1, &camera) == ERROR_UNSUPPORTED);
    CHECK(fpga_bridge_sensor_route(driver, true, 0) == ERROR_UNSUPPORTED);
    CHECK(fpga_bridge_sensor_bus_clear(driver, 1) == ERROR_UNSUPPORTED);
    CHECK(rig.counted() == "");
}

TEST_CASE("servos and watchdog") {
    hdl::DriverRig rig;
    fpga_bridge *driver = &rig.driver;
    REQUIRE(fpga_bridge_soft_reset(driver) == ERROR_OK);
    CHECK(fpga_bridge_servo_limits(driver, 0, 16000, 32000) == ERROR_OK);
    CHECK(fpga_bridge_servo_slew(driver, 0, 2047) == ERROR_OK);
    CHECK(fpga_bridge_servo_safe(driver, 0, 23040) == ERROR_OK);
    CHECK(fpga_bridge_servo_aim(driver, 0, 24800) == ERROR_OK);
    CHECK(fpga_bridge_write_unlocked(driver, BRIDGE_SERVO_PERIOD_US, 15000) == ERROR_OK);
    CHECK(fpga_bridge_watchdog_set(driver, 200, BRIDGE_WDG_ACTION_IS_OFF) == ERROR_OK);
    const size_t pulses = pulses_during(
        rig, 0, [&] { CHECK(fpga_bridge_servo_enable(driver, 0, true) == ERROR_OK); });
    CHECK(pulses >= 3);
    fpga_bridge_servo servo{};
    CHECK(fpga_bridge_servo_read(driver, 0, &servo) == ERROR_OK);
    CHECK(servo.target_q4 == 24800);
    CHECK(servo.actual_q4 == 24800);
    CHECK(servo.min_q4 == 16000);
    CHECK(servo.max_q4 == 32000);
    CHECK(servo.safe_q4 == 23040);
    CHECK(servo.slew_q4 == 2047);
    CHECK(servo.pulses >= 3);
    CHECK(pulses_during(rig, 1, [] {}) == 0);
    CHECK(fpga_bridge_watchdog_feed(driver) == ERROR_OK);
    rig.bus.wait(150 * kMs);
    CHECK(fpga_bridge_watchdog_feed(driver) == ERROR_OK);
    rig.bus.wait(150 * kMs);
    CHECK((*rig.world.peek(BRIDGE_WDG) & BRIDGE_WDG_FIRED_MASK) == 0);
    rig.bus.wait(150 * kMs);
    CHECK((*rig.world.peek(BRIDGE_WDG) & BRIDGE_WDG_FIRED_MASK) != 0);
    CHECK(pulses_during(rig, 0, [] {}) == 0);
    CHECK(fpga_bridge_clear(driver, BRIDGE_WDG, BRIDGE_WDG_FIRED_MASK) == ERROR_OK);
    CHECK(rig.world.peek(BRIDGE_WDG) == BRIDGE_WDG_ACTION_IS_OFF);
    CHECK(fpga_bridge_watchdog_set(driver, 0, BRIDGE_WDG_ACTION_IS_HOLD) == ERROR_OK);
    CHECK(rig.world.peek(BRIDGE_WDG_MS) == 0);
    CHECK(fpga_bridge_servo_enable(driver, 0, false) == ERROR_OK);
    CHECK(rig.world.bridge.servos().faults().empty());
}

TEST_CASE("cameras and pattern") {
    hdl::DriverRig rig;
    fpga_bridge *driver = &rig.driver;
    const fpga_bridge_pattern pattern = {64, 48, 16, 2, BRIDGE_PATTERN_KIND_IS_PRBS, 0x155};
    CHECK(fpga_bridge_camera_pattern(driver, &pattern) == ERROR_OK);
    CHECK(fpga_bridge_camera_ppi_mode(driver, BRIDGE_PPI_MODE_TAG_MASK) == ERROR_OK);
    CHECK(fpga_bridge_camera_expect(driver, 2048, 1536) == ERROR_OK);
    CHECK(fpga_bridge_camera_switch_limit(driver, 5) == ERROR_OK);
    REQUIRE(rig.world.poke(BRIDGE_CAM_SELECT, 0xFF00));  // alternating
    CHECK(fpga_bridge_camera_select(driver, BRIDGE_CAM_SELECT_SOURCE_IS_PATTERN) == ERROR_OK);
    CHECK(rig.world.peek(BRIDGE_CAM_SELECT) == 0xFE02);
    CHECK(fpga_bridge_camera_stream(driver, true) == ERROR_OK);
    rig.bus.wait(70 * kMs);
    fpga_bridge_source source{};
    CHECK(fpga_bridge_camera_source(driver, &source) == ERROR_OK);
    CHECK(source.active == BRIDGE_CAM_STATE_ACTIVE_IS_PATTERN);
    CHECK_FALSE(source.switching);
    fpga_bridge_camera camera{};
    CHECK(fpga_bridge_camera_read(driver, 1, &camera) == ERROR_OK);
    CHECK(camera.frames == 0);
    CHECK(rig.driver.bus.counts.repeats == 0);
}

TEST_CASE("events, sensors' lines and branches") {
    hdl::DriverRig rig;
    fpga_bridge *driver = &rig.driver;
    uint16_t word = 0;
    CHECK(fpga_bridge_event_take(driver, &word) == ERROR_OK);  // the event that prepare() caused
    CHECK(word == 0x82);
    CHECK(fpga_bridge_event_enable(driver, BRIDGE_IRQ_STATUS_SWITCHED_MASK) == ERROR_OK);
    CHECK(fpga_bridge_event_test(driver, BRIDGE_IRQ_STATUS_SWITCHED_MASK) == ERROR_OK);
    rig.bus.wait(5 * kUs);
    CHECK(rig.world.bridge.out().irq == 1);
    CHECK(fpga_bridge_event_status(driver, &word) == ERROR_OK);
    CHECK((word & BRIDGE_STATUS_IRQ_LINE_MASK) != 0);
    CHECK(fpga_bridge_event_take(driver, &word) == ERROR_OK);
    CHECK(word == BRIDGE_IRQ_STATUS_SWITCHED_MASK);
    rig.bus.wait(5 * kUs);
    CHECK(rig.world.bridge.out().irq == 0);
    const fpga_bridge_sensor_lines lines = {3, 1, 2, 3};
    CHECK(fpga_bridge_sensor_drive(driver, &lines) == ERROR_OK);
    CHECK(rig.world.peek(BRIDGE_SENSOR) == 0xE7);
    fpga_bridge_sensor_bus state{};
    CHECK(fpga_bridge_sensor_bus_clear(driver, 3) == ERROR_OK);
    rig.bus.wait(200 * kUs);
    CHECK(fpga_bridge_sensor_bus_read(driver, &state) == ERROR_OK);
    CHECK_FALSE(state.clear_busy);
    CHECK(state.branch_sda == 3);
    CHECK(state.branch_scl == 3);
    CHECK(fpga_bridge_sensor_route(driver, false, BRIDGE_BRANCH_CTRL_BYPASS_IS_NONE) == ERROR_OK);
    CHECK(rig.world.peek(BRIDGE_BRANCH_CTRL) == 0);
    CHECK(rig.driver.bus.counts.repeats == 0);
}

TEST_CASE("the count of transfers wraps") {
    hdl::DriverRig rig;
    rig.driver.bus.counts.transfers = UINT32_MAX;
    uint16_t word = 0;
    CHECK(fpga_bridge_read(&rig.driver, BRIDGE_ID, &word) == ERROR_OK);
    CHECK(rig.driver.bus.counts.transfers == 0);
}
