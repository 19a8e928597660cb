// SPDX-License-Identifier: Apache-2.0
// The driver under many random faults at once: it never exceeds its time limits, never reports
// success for something that was not done, never starts an action twice, and the first transfer
// after the faults is normal.
#include <doctest/doctest.h>

#include <algorithm>
#include <functional>

#include "bench/driver_rig.hpp"
#include "bench/servo_checker.hpp"
#include "device/fpga_bridge_servo.h"

namespace {

using hdl::kMs;
using hdl::kUs;

class Storm {
  public:
    Storm(hdl::DriverRig &rig, hdl::Random &random) : rig_(rig), random_(random) {}

    /// Faults from now on, with this probability at each fall of SCL; also flipped bits.
    void begin(double chance, bool turn_bits) {
        resets = 0;
        rig_.bus.on_fall([this, chance, turn_bits](uint64_t) {
            if (random_.chance(chance)) {
                fault(turn_bits);
            }
        });
        rig_.bus.misread([this, chance](uint64_t n) {
            // Acknowledge bits of the first message. Wrong data would be indistinguishable from
            // correct data.
            return n % 9 == 0 && n <= 36 && random_.chance(chance);
        });
    }
    unsigned resets = 0, faults = 0;

  private:
    void set_reset(bool level) {
        rig_.world.bridge.in.reset = level;
        rig_.world.bridge.drive();
    }
    void fault(bool turn_bits) {
        hdl::Bridge &bridge = rig_.world.bridge;
        const uint64_t soon_ps = bridge.now() + random_.between(0, 2500 * hdl::kNs);
        faults++;
        switch (random_.below(turn_bits ? 6 : 5)) {
            case 0:
                rig_.bus.others_pull(HAL_I2C_SDA, random_.between(1, 12) * kUs);
                break;
            case 1:
                rig_.bus.others_pull(HAL_I2C_SCL, random_.between(1, 45) * kMs);
                break;
            case 2:
                rig_.bus.others_pull(HAL_I2C_SCL | HAL_I2C_SDA, random_.between(1, 45) * kMs);
                break;
            case 3:
                rig_.bus.others_pull(HAL_I2C_SDA, random_.between(1, 90) * kMs);
                break;
            case 4:
                resets++;
                bridge.at(soon_ps, [this] { set_reset(true); });
                bridge.at(soon_ps + random_.between(100, 9000) * hdl::kNs,
                          [this] { set_reset(false); });
                break;
            default:
                bridge.in.sda_noise = 1;
                bridge.drive();
                bridge.at(soon_ps, [&bridge] {
                    bridge.in.sda_noise = 0;
                    bridge.drive();
                });
        }
    }

    hdl::DriverRig &rig_;
    hdl::Random &random_;
};

bool is_of_bus(int error) {
    const int known[] = {ERROR_OK,      ERROR_I2C_NACK, ERROR_I2C_ARBITRATION, ERROR_I2C_STUCK,
                         ERROR_TIMEOUT, ERROR_REFUSED,  ERROR_VERIFY};
    return std::find(std::begin(known), std::end(known), error) != std::end(known);
}

// After the faults: none of them is left.
void check_idle(hdl::DriverRig &rig, hdl::Random &random) {
    rig.heal();
    rig.bus.wait(40 * kMs);
    rig.counted();
    const auto value = uint16_t(random.next());
    CHECK(fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, value) == ERROR_OK);
    CHECK(rig.world.peek(BRIDGE_SCRATCH) == value);
    const std::string counted = rig.counted();
    const bool calm = counted == "transfers 1" || counted == "transfers 1, doubts 1, repeats 1";
    CHECK(calm);
    rig.took_us();
}

}  // namespace

TEST_CASE("words are written or not, as the driver says, in a storm of faults") {
    const uint64_t seed = synthetic::test_seed();
    INFO("seed " << seed);
    hdl::DriverRig rig(seed);
    hdl::Random random(seed);
    Storm storm(rig, random);
    unsigned done = 0, failed = 0;
    for (uint64_t i = 0; i < hdl::draws(40); i++) {
        INFO("round " << i);
        check_idle(rig, random);
        auto expected = rig.world.state();
        REQUIRE(expected);
        const auto value = uint16_t(random.next());
        storm.begin(double(random.between(1, 40)) / 1000, false);
        rig.took_us();
        const int error = fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, value);
        CHECK(is_of_bus(error));
        CHECK(rig.took_us() <= FPGA_BRIDGE_CALL_US);
        rig.heal();
        (error == ERROR_OK ? done : failed)++;
        const auto state = rig.world.state();
        REQUIRE(state);
        const uint32_t seen = state->at(BRIDGE_SCRATCH);
        if (storm.resets > 0) {
            CHECK((error != ERROR_OK || seen == value || seen == 0));
            continue;
        }
        // The word is stored or not; no other has changed.
        if (error == ERROR_OK || seen == value) {
            (*expected)[BRIDGE_SCRATCH] = value;
        }
        CHECK(hdl::difference(*state, *expected) == "");
    }
    CHECK(done > 0);
    CHECK(failed > 0);
    MESSAGE(done << " written, " << failed << " not, " << storm.faults << " faults");
}

TEST_CASE("a trigger starts once at most in a storm of faults") {
    const uint64_t seed = synthetic::test_seed() + 1;
    INFO("seed " << seed);
    hdl::DriverRig rig(seed);
    hdl::Random random(seed);
    Storm storm(rig, random);
    unsigned pulses = 0;
    for (uint64_t i = 0; i < hdl::draws(30); i++) {
        INFO("round " << i);
        check_idle(rig, random);
        rig.world.trigger.pulses = 0;
        storm.begin(double(random.between(1, 60)) / 1000, false);
        const int error = fpga_bridge_start(&rig.driver, BRIDGE_TRIGGER_CTRL, 1);
        CHECK(is_of_bus(error));
        CHECK(rig.took_us() <= FPGA_BRIDGE_CALL_US);
        rig.heal();
        rig.bus.wait(200 * kUs);
        CHECK(rig.world.trigger.pulses <= 1);
        if (error == ERROR_OK && storm.resets == 0) {
            CHECK(rig.world.trigger.pulses == 1);
        }
        pulses += rig.world.trigger.pulses;
    }
    CHECK(pulses > 0);
}

TEST_CASE("feeding in a storm: each restart is reported") {
    const uint64_t seed = synthetic::test_seed() + 2;
    INFO("seed " << seed);
    hdl::DriverRig rig(seed);
    hdl::Random random(seed);
    Storm storm(rig, random);
    unsigned restarts = 0, false_alarms = 0;
    REQUIRE(fpga_bridge_watchdog_feed(&rig.driver) == ERROR_OK);
    for (uint64_t i = 0; i < hdl::draws(30); i++) {
        INFO("round " << i);
        storm.begin(double(random.between(1, 30)) / 1000, false);
        rig.took_us();
        const int error = fpga_bridge_watchdog_feed(&rig.driver);
        CHECK(rig.took_us() <= 2 * FPGA_BRIDGE_CALL_US);
        rig.heal();
        rig.bus.wait(40 * kMs);
        const int later = fpga_bridge_watchdog_feed(&rig.driver);
        const bool reported = error == ERROR_RESTARTED || later == ERROR_RESTARTED;
        if (storm.resets > 0) {
            CHECK(reported);
        } else {
            false_alarms += reported;
        }
        CHECK(fpga_bridge_watchdog_feed(&rig.driver) == ERROR_OK);
        restarts += reported;
    }
    CHECK(restarts > 0);
    // Devices that pull SDA in two consecutive reads look like a restart.
    MESSAGE(restarts << " reported, " << false_alarms << " of them false");
    CHECK(false_alarms <= restarts / 20);
}

TEST_CASE("bits turned over besides: the driver ends in time, and the bridge obeys again") {
    const uint64_t seed = synthetic::test_seed() + 3;
    INFO("seed " << seed);
    hdl::DriverRig rig(seed);
    hdl::Random random(seed);
    Storm storm(rig, random);
    for (uint64_t i = 0; i < hdl::draws(30); i++) {
        INFO("round " << i);
        check_idle(rig, random);
        storm.begin(double(random.between(1, 60)) / 1000, true);
        uint16_t words[FPGA_BRIDGE_BLOCK_WORDS];
        const int error =
            i % 2 == 0 ? fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, uint16_t(random.next()))
                       : fpga_bridge_read_block(&rig.driver, BRIDGE_CAMERA0_FRAMES, 8, words);
        CHECK(is_of_bus(error));
        CHECK(rig.took_us() <= FPGA_BRIDGE_CALL_US);
    }
    CHECK(rig.world.bridge.servos().faults().empty());
}
