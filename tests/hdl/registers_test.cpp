// SPDX-License-Identifier: Apache-2.0
// Every register over the bus: its value after reset, what it accepts and what it rejects, from the
// vectors generated from the map; at every speed of the bus, with slow and fast board clocks.
#include <doctest/doctest.h>

#include <algorithm>
#include <string>

#include "bench/i2c_master.hpp"
#include "bench/register_map.hpp"
#include "bench/servo_checker.hpp"

namespace {

constexpr uint8_t kUnlock = 0x0D;
constexpr uint16_t kKey = 0x4C4B;

// The bridge moves SDA only while SCL is low, and early enough for 1 MHz: 450 ns, less 120 ns for
// the edge.
class SdaChecker : public hdl::Listener {
  public:
    uint32_t wanted() const override { return BRIDGE_EVENT_BUS; }
    void on_event(uint64_t time_ps, uint32_t, const bridge_outputs &now) override {
        fell_ps_ = scl_ && now.scl == 0 ? time_ps : fell_ps_;
        const bool low = now.sda == 0 && bridge->in.sda != 0;
        if (low != low_) {
            late_ps = std::max(late_ps, time_ps - fell_ps_);
            at_high += now.scl != 0 && low ? 1 : 0;
        }
        scl_ = now.scl != 0;
        low_ = low;
    }
    const hdl::Bridge *bridge = nullptr;
    uint64_t late_ps = 0;
    unsigned at_high = 0;

  private:
    bool scl_ = true, low_ = false;
    uint64_t fell_ps_ = 0;
};

struct Bench {
    SdaChecker sda;
    hdl::Bridge bridge;
    hdl::I2cMaster master;
    hdl::Registers registers;

    Bench(unsigned khz, uint32_t clock_period_ps)
        : bridge(synthetic::test_seed()),
          master(bridge, hdl::standard_timing(khz)),
          registers(master) {
        bridge.set_clock(BRIDGE_CLOCK_CONTROL, clock_period_ps);
        sda.bridge = &bridge;
        bridge.add(sda);
    }

    // A difference from the vectors as text; "" if there is none.
    std::string after_reset(const nlohmann::json &reg) {
        bridge.reset();
        const auto index = reg.at("index").get<uint8_t>();
        const auto mask = reg.at("mask").get<uint16_t>();
        const auto value = registers.read(index);
        if (!value) {
            return "no answer";
        }
        if ((*value & mask) != (reg.at("reset").get<uint16_t>() & mask)) {
            return "reads " + std::to_string(*value) + " after reset";
        }
        return "";
    }

    std::string after_write(const nlohmann::json &reg, const nlohmann::json &vector) {
        bridge.reset();
        const auto index = reg.at("index").get<uint8_t>();
        const auto mask = reg.at("mask").get<uint16_t>();
        if (vector.at("unlocked").get<bool>() && !registers.write(kUnlock, kKey)) {
            return "cannot be unlocked";
        }
        const auto word = vector.at("value").get<uint16_t>();
        const size_t acknowledged =
            master.write(hdl::Registers::kAddress, {index, uint8_t(word >> 8), uint8_t(word)});
        const std::string what = "write of " + std::to_string(word);
        if (acknowledged != (vector.at("accepted").get<bool>() ? 4u : 3u)) {
            return what + ": " + std::to_string(acknowledged) + " bytes acknowledged";
        }
        const auto value = registers.read(index);
        if (!value || (*value & mask) != (vector.at("reads").get<uint16_t>() & mask)) {
            return what + " reads " + (value ? std::to_string(*value) : std::string("nothing"));
        }
        return "";
    }
};

}  // namespace

TEST_CASE("each register's reset value and access, at each speed") {
    struct Speed {
        unsigned khz;
        uint32_t clock_period_ps;
        uint64_t data_hold_ps;
    };
    // 25 MHz and 10 % to both sides; data as late as a master may change them.
    for (const Speed speed :
         {Speed{100, 40000, 0}, Speed{400, 40000, 0}, Speed{1000, 40000, 0}, Speed{1000, 44444, 0},
          Speed{1000, 36364, 0}, Speed{1000, 40000, 400 * hdl::kNs}}) {
        Bench bench(speed.khz, speed.clock_period_ps);
        hdl::I2cTiming timing = hdl::standard_timing(speed.khz);
        timing.data_hold = speed.data_hold_ps;
        bench.master.set_timing(timing);
        unsigned vectors = 0;
        for (const auto &reg : hdl::register_map().at("registers")) {
            const auto name = reg.at("name").get<std::string>();
            INFO(name << " at " << speed.khz << " kHz, clock of " << speed.clock_period_ps
                      << " ps");
            CHECK(bench.after_reset(reg) == "");
            for (const auto &vector : reg.at("writes")) {
                vectors++;
                // The lowest speed costs ten times as much: every fifth vector.
                if (speed.khz > 100 || vectors % 5 == 0) {
                    CHECK(bench.after_write(reg, vector) == "");
                }
            }
        }
        if (speed.data_hold_ps == 0) {  // else the master's late changes hide the bridge's
            CHECK(bench.sda.late_ps > 0);
            CHECK(bench.sda.late_ps <= 330 * hdl::kNs);
            CHECK(bench.sda.at_high == 0);
        }
        CHECK(bench.bridge.servos().faults().empty());
    }
}

TEST_CASE("indices that do not exist read 0 and take nothing") {
    Bench bench(1000, 40000);
    for (const auto &entry : hdl::register_map().at("unknown")) {
        const auto index = entry.get<uint8_t>();
        CAPTURE(int(index));
        CHECK(bench.registers.read(index) == 0);
        CHECK(bench.master.write(hdl::Registers::kAddress, {index, 0x12, 0x34}) == 2);
    }
}

TEST_CASE("the index increases through reads and writes of many words, and wraps") {
    Bench bench(1000, 40000);
    // Pattern's width, height, blanking: neighbours that only store.
    CHECK(bench.master.write(hdl::Registers::kAddress, {0x24, 0, 64, 0, 48, 0, 100, 0, 20}) == 10);
    const auto words = bench.registers.read(0x24, 4);
    REQUIRE(words);
    CHECK(*words == std::vector<uint16_t>{64, 48, 100, 20});
    const auto around = bench.registers.read(0xFF, 2);
    REQUIRE(around);
    CHECK(*around == std::vector<uint16_t>{0, 0x5B1D});
}

TEST_CASE("the index survives STOP, half a word changes nothing, the general call is ignored") {
    Bench bench(400, 40000);
    CHECK(bench.registers.write(0x04, 0xBEEF));
    CHECK(bench.master.write(hdl::Registers::kAddress, {0x04}) == 2);
    const auto bytes = bench.master.read(hdl::Registers::kAddress, 2);
    REQUIRE(bytes);
    CHECK(*bytes == std::vector<uint8_t>{0xBE, 0xEF});
    CHECK(bench.master.write(hdl::Registers::kAddress, {0x04, 0x12}) == 3);
    CHECK(bench.registers.read(0x04) == 0xBEEF);
    CHECK(bench.master.write(0x00, {0x04, 0x12, 0x34}) == 0);
    for (unsigned address = 0; address < 128; address++) {
        if (address != hdl::Registers::kAddress) {
            CAPTURE(address);
            CHECK(bench.master.write(uint8_t(address), {0x04, 0x12, 0x34}) == 0);
        }
    }
    CHECK(bench.registers.read(0x04) == 0xBEEF);
}

TEST_CASE("soft reset: registers as after reset, the transfer and a pulse end as they should") {
    Bench bench(400, 40000);
    CHECK(bench.registers.write(0x04, 0x1111));
    CHECK(bench.registers.write(0x08, 0x0003));
    while (bench.bridge.out().servo[0] == 0) {
        bench.bridge.run(10 * hdl::kUs);
    }
    CHECK(bench.registers.write(0x08, 0x4000));
    CHECK(bench.registers.read(0x04) == 0);
    CHECK(bench.registers.read(0x08) == 0);
    bench.bridge.run(2 * hdl::kMs);
    bench.bridge.run_idle(45 * hdl::kMs);
    CHECK(bench.bridge.servos().pulses(0).size() == 1);
    CHECK(bench.bridge.servos().pulses(0).back().width_ps() == 1500 * hdl::kUs);
    CHECK(bench.bridge.servos().faults().empty());
}
