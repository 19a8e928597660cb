// SPDX-License-Identifier: Apache-2.0
// A transfer of each kind is interrupted after each of its pin changes in each way: the bus
// recovers, nothing is half written, and a line held low is released within 35 ms.
#include <doctest/doctest.h>

#include <functional>
#include <string>
#include <vector>

#include "bench/i2c_master.hpp"
#include "bench/i2c_sensor.hpp"
#include "bench/servo_checker.hpp"

namespace {

using hdl::kMs;
using hdl::kUs;

struct Kind {
    const char *name;
    std::function<void(hdl::I2cMaster &)> transfer;
    unsigned khz;
};

constexpr uint16_t kOld = 0x1234, kNew = 0xA5C3;

std::vector<Kind> kinds() {
    const std::vector<uint8_t> word = {0x04, kNew >> 8, kNew & 0xFF};
    const auto read_of = [](uint8_t address, bool stop_between) {
        return [=](hdl::I2cMaster &master) {
            master.write(address, {0x04}, stop_between);
            master.read(address, 4);
        };
    };
    const auto write_of = [](uint8_t address, std::vector<uint8_t> bytes) {
        return [=](hdl::I2cMaster &master) { master.write(address, bytes); };
    };
    return {{"write of a word", write_of(0x2C, word), 1000},
            {"write of two words", write_of(0x2C, {0x24, 0, 64, 0, 48}), 400},
            {"read with a repeated START", read_of(0x2C, false), 1000},
            {"read after a STOP", read_of(0x2C, true), 400},
            {"another address", write_of(0x2D, word), 1000},
            {"general call", write_of(0x00, word), 1000},
            {"unknown register", write_of(0x2C, {0xF0, 1, 2}), 1000},
            {"write to the left sensor", write_of(0x5C, word), 400},
            {"read of the right sensor", read_of(0x5E, false), 400},
            {"write to both sensors", write_of(0x5D, word), 100},
            {"read of both sensors", read_of(0x5D, false), 400}};
}

// The shortest high times are for the bridge alone.
hdl::I2cTiming timing_of(const Kind &kind) {
    return kind.khz == 1000 ? hdl::standard_timing(1000) : hdl::branch_timing(kind.khz);
}

enum class After { kStop, kNewStart, kFreeze, kReset };
const std::string kNames[] = {"lines let go", "bus cleared at once", "lines held for 40 ms",
                              "reset"};

// Number of pin changes of an undisturbed transfer.
uint64_t count_moves(const Kind &kind) {
    hdl::Bridge bridge(1);
    hdl::I2cSensor left(bridge, 0, 300 * hdl::kNs), right(bridge, 1, 300 * hdl::kNs);
    hdl::I2cMaster master(bridge, timing_of(kind));
    kind.transfer(master);
    return master.moves();
}

// Empty if the bus recovered as required.
std::string try_abort(hdl::Bridge &bridge, const Kind &kind, uint64_t moves, After after) {
    hdl::I2cMaster master(bridge, timing_of(kind));
    hdl::Registers registers(master);
    if (!registers.write(0x04, kOld)) {
        return "the write before was not acknowledged";
    }
    master.abort_after(moves);
    try {
        kind.transfer(master);
    } catch (const hdl::Aborted &) {
    }
    const uint64_t broken_ps = bridge.now();
    if (after == After::kFreeze) {
        bridge.run_idle(35 * kMs);
        if (bridge.in.sda != 0 && bridge.in.scl == 0 && bridge.out().sda == 0) {
            return "SDA is still held after 35 ms";
        }
        bridge.run_idle(5 * kMs);
    }
    if (after == After::kReset) {
        bridge.reset();
    }
    master.let_go();
    if (bridge.out().sda == 0 || after == After::kNewStart) {
        if (!master.clear_bus()) {
            return "the bus does not come free";
        }
    }
    const uint64_t back_ps = bridge.now() - broken_ps;
    if (after != After::kFreeze && back_ps > 35 * kMs) {
        return "back after " + std::to_string(back_ps / kUs) + " us";
    }
    const auto value = registers.read(0x04);
    const bool allowed = value == kOld || value == kNew || (after == After::kReset && value == 0);
    if (!allowed) {
        return "the register holds " + (value ? std::to_string(*value) : std::string("no answer"));
    }
    if (!registers.write(0x04, 0x5A5A) || registers.read(0x04) != 0x5A5A) {
        return "the next transfer fails";
    }
    return "";
}

}  // namespace

TEST_CASE("broken off after every pin move, every kind of transfer comes back") {
    const uint64_t seed = synthetic::test_seed();
    INFO("seed " << seed);
    hdl::Random random(seed);
    uint64_t tries = 0;
    for (const Kind &kind : kinds()) {
        const uint64_t all = count_moves(kind);
        hdl::Bridge bridge(seed);
        hdl::I2cSensor left(bridge, 0, 300 * hdl::kNs), right(bridge, 1, 300 * hdl::kNs);
        for (uint64_t moves = 0; moves < all; moves++) {
            // Frozen lines take 40 ms each: a sample of them, or all in a campaign.
            const bool freeze = hdl::draws(0) != 0 || moves % 7 == random.below(7);
            for (After after : {After::kStop, After::kNewStart, After::kFreeze, After::kReset}) {
                if (after == After::kFreeze && !freeze) {
                    continue;
                }
                tries++;
                const std::string wrong = try_abort(bridge, kind, moves, after);
                if (!wrong.empty()) {
                    FAIL_CHECK(std::string(kind.name) << " after " << moves << " moves, "
                                                      << kNames[int(after)] << ": " << wrong);
                    bridge.reset();
                }
            }
        }
        CHECK(bridge.servos().faults().empty());
    }
    MESSAGE(tries << " aborts");
}

TEST_CASE("SDA or SCL stuck from outside: back as soon as it is free") {
    hdl::Bridge bridge(synthetic::test_seed());
    hdl::I2cMaster master(bridge, hdl::standard_timing(400));
    hdl::Registers registers(master);
    for (int line = 0; line < 2; line++) {
        (line == 0 ? bridge.in.scl : bridge.in.sda) = 0;
        bridge.drive();
        bridge.run_idle(100 * kMs);
        master.let_go();
        CHECK(registers.read(0x00) == 0x5B1D);
    }
}
