// SPDX-License-Identifier: Apache-2.0
// The bridge is reset, or disappears, at each half bit of the driver's transfers: the driver's
// result is still true. Actions are never started twice.
#include <doctest/doctest.h>

#include <functional>

#include "bench/driver_rig.hpp"
#include "device/fpga_bridge_servo.h"

namespace {

using hdl::kMs;
using hdl::kUs;

constexpr uint16_t kOld = 0x5A5A;

// Event at this half bit of the next transfer. Halves are low and high phases of SCL.
void at_half(hdl::DriverRig &rig, uint64_t half, std::function<void()> what) {
    const uint64_t only = rig.bus.transfers() + 1;
    rig.bus.on_fall([&rig, half, only, what](uint64_t n) {
        if (n == half / 2 && rig.bus.transfers() == only) {
            // The low phase takes 1.8 us of 2.5.
            const uint64_t offset_ps = half % 2 == 0 ? 500 * hdl::kNs : 2100 * hdl::kNs;
            rig.world.bridge.at(rig.world.bridge.now() + offset_ps, what);
        }
    });
}

void set_reset(hdl::DriverRig &rig, bool level) {
    rig.world.bridge.in.reset = level;
    rig.world.bridge.drive();
}

std::function<void()> reset(hdl::DriverRig &rig) {
    return [&rig] {
        set_reset(rig, true);
        rig.world.bridge.at(rig.world.bridge.now() + 300 * hdl::kNs,
                            [&rig] { set_reset(rig, false); });
    };
}

// Calls `check` with a reset, or the end of the bridge, at each half bit (or a sample) of a
// transfer with this many falls of SCL.
void for_each_half(uint64_t falls, bool for_good,
                   const std::function<void(hdl::DriverRig &)> &check) {
    hdl::DriverRig rig;
    hdl::Random random(synthetic::test_seed());
    const uint32_t step = hdl::draws(0) != 0 ? 1 : 3;
    for (uint64_t half = 2 + random.below(step); half < 2 * falls + 2; half += step) {
        INFO("half bit " << half);
        rig.heal();
        REQUIRE(rig.world.poke(BRIDGE_SERVO0_TARGET_Q4, kOld));
        REQUIRE(rig.world.poke(BRIDGE_SCRATCH, kOld));
        rig.world.trigger.pulses = 0;
        rig.counted();
        if (for_good) {
            at_half(rig, half, [&] { set_reset(rig, true); });
        } else {
            at_half(rig, half, reset(rig));
        }
        rig.took_us();
        check(rig);
        CHECK(rig.took_us() <= 3 * FPGA_BRIDGE_CALL_US);
    }
}

}  // namespace

TEST_CASE("a word that is read is one of before the reset or after it") {
    unsigned doubts = 0;
    for_each_half(58, false, [&](hdl::DriverRig &rig) {
        uint16_t value = 0;
        CHECK(fpga_bridge_read(&rig.driver, BRIDGE_SERVO0_TARGET_Q4, &value) == ERROR_OK);
        const bool real = value == kOld || value == 0x5DC0;
        CHECK(real);
        doubts += rig.driver.bus.counts.doubts;
    });
    CHECK(doubts > 0);
    for_each_half(58, true, [](hdl::DriverRig &rig) {
        uint16_t value = kOld;
        const int error = fpga_bridge_read(&rig.driver, BRIDGE_SERVO0_TARGET_Q4, &value);
        const bool known = error == ERROR_OK || error == ERROR_I2C_NACK;
        CHECK(known);
        CHECK(value == kOld);
    });
}

TEST_CASE("a word that was written is there, or the driver says so") {
    // Possible states of a bridge that was reset, and another one.
    const uint16_t values[] = {0xFFFF, 0x5B1D, 0x0102};
    unsigned turn = 0;
    for_each_half(96, false, [&](hdl::DriverRig &rig) {
        const uint16_t value = values[turn++ % 3];
        CHECK(fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, value) == ERROR_OK);
        // A reset after the word was read back, during the extra read, clears it.
        const auto seen = rig.world.peek(BRIDGE_SCRATCH);
        const bool real = seen == value || (seen == 0 && rig.counted() == "transfers 1");
        CHECK(real);
    });
    for_each_half(96, true, [](hdl::DriverRig &rig) {
        const int error = fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, 0xFFFF);
        const bool known = error == ERROR_OK || error == ERROR_I2C_NACK || error == ERROR_REFUSED;
        CHECK(known);
    });
}

TEST_CASE("feeding the watchdog misses no restart, and reports none that was not") {
    for_each_half(96, false, [](hdl::DriverRig &rig) {
        REQUIRE(rig.world.poke(BRIDGE_SCRATCH, 0x6A35));  // the mark
        rig.driver.marked = true;
        const int first = fpga_bridge_watchdog_feed(&rig.driver);
        rig.bus.on_fall({});
        const int second = fpga_bridge_watchdog_feed(&rig.driver);
        const int third = fpga_bridge_watchdog_feed(&rig.driver);
        const bool reported_once = (first == ERROR_RESTARTED) != (second == ERROR_RESTARTED);
        CHECK(reported_once);
        CHECK(first + second == ERROR_RESTARTED);
        CHECK(third == ERROR_OK);
    });
    hdl::DriverRig rig;
    CHECK(fpga_bridge_watchdog_feed(&rig.driver) == ERROR_OK);
    for (int i = 0; i < 3; i++) {
        CHECK(fpga_bridge_watchdog_feed(&rig.driver) == ERROR_OK);
    }
    // A feed that fails although the bridge received it is not a restart.
    rig.bus.misread([](uint64_t n) { return n == 9 * 3 + 8 + 1; });
    CHECK(fpga_bridge_watchdog_feed(&rig.driver) == ERROR_I2C_NACK);
    rig.heal();
    CHECK(fpga_bridge_watchdog_feed(&rig.driver) == ERROR_OK);
    // A restart is reported even if the first attempt to set the mark fails.
    rig.world.bridge.reset();
    rig.bus.wait(200 * kUs);
    const uint64_t next = rig.bus.transfers() + 1;
    rig.bus.misread([&](uint64_t n) { return n == 9 + 8 + 1 && rig.bus.transfers() > next; });
    CHECK(fpga_bridge_watchdog_feed(&rig.driver) == ERROR_I2C_NACK);
    rig.heal();
    CHECK(fpga_bridge_watchdog_feed(&rig.driver) == ERROR_RESTARTED);
    CHECK(fpga_bridge_watchdog_feed(&rig.driver) == ERROR_OK);
    // The same if the mark was stored and the driver received a wrong acknowledge.
    rig.world.bridge.reset();
    rig.bus.wait(200 * kUs);
    const uint64_t looks = rig.bus.transfers() + 2;
    rig.bus.misread([&](uint64_t n) { return n == 9 * 3 + 8 + 1 && rig.bus.transfers() > looks; });
    CHECK(fpga_bridge_watchdog_feed(&rig.driver) == ERROR_REFUSED);
    rig.heal();
    CHECK(fpga_bridge_watchdog_feed(&rig.driver) == ERROR_RESTARTED);
    CHECK(fpga_bridge_watchdog_feed(&rig.driver) == ERROR_OK);
}

TEST_CASE("the trigger is never started twice, and started when the driver says so") {
    hdl::DriverRig rig;
    hdl::Random random(synthetic::test_seed());
    const uint32_t step = hdl::draws(0) != 0 ? 1 : 5;
    const std::function<void()> faults[] = {
        reset(rig),
        [&] { rig.bus.others_pull(HAL_I2C_SDA, 4 * kUs); },
        [&] { rig.bus.others_pull(HAL_I2C_SCL, 40 * kMs); },
        [&] { rig.bus.misread([](uint64_t n) { return n % 9 == 0; }); },
    };
    unsigned begun = 0, failed = 0;
    for (const auto &fault : faults) {
        for (uint64_t half = 2 + random.below(step); half < 2 * (9 * 4 + 2); half += step) {
            INFO("half bit " << half);
            rig.heal();
            rig.world.prepare();
            at_half(rig, half, fault);
            const int error = fpga_bridge_start(&rig.driver, BRIDGE_TRIGGER_CTRL, 1);
            rig.bus.wait(40 * kMs);
            CHECK(rig.world.trigger.pulses <= 1);
            if (error == ERROR_OK) {
                // A reset ends a pulse, or prevents it.
                CHECK((rig.world.trigger.pulses == 1 || &fault == &faults[0]));
            }
            begun += rig.world.trigger.pulses;
            failed += error != ERROR_OK;
        }
    }
    CHECK(begun > 0);
    CHECK(failed > 0);
}

TEST_CASE("a soft reset is sent once, and is seen") {
    hdl::DriverRig rig;
    CHECK(fpga_bridge_soft_reset(&rig.driver) == ERROR_OK);
    CHECK(rig.counted() == "transfers 2");
    CHECK(rig.world.peek(BRIDGE_SCRATCH) == 0);
    CHECK(rig.world.peek(BRIDGE_UNLOCK) == 0);
    REQUIRE(rig.world.poke(BRIDGE_SCRATCH, 1));
    const uint64_t before = rig.bus.transfers();
    rig.bus.misread([](uint64_t n) { return n == 9 * 3 + 8 + 1; });
    CHECK(fpga_bridge_soft_reset(&rig.driver) == ERROR_REFUSED);
    CHECK(rig.bus.transfers() == before + 1);
    rig.heal();
    CHECK(rig.world.peek(BRIDGE_SCRATCH) == 0);
}
