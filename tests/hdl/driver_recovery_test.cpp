// SPDX-License-Identifier: Apache-2.0
// Recovery of the bus writes nothing: transfers of each kind are broken off at each bit, with
// lines held by others in several ways, and all registers of the bridge and both sensors are then
// what they were. The textbook's nine clocks fail the same test.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "bench/driver_bus.hpp"
#include "bench/i2c_master.hpp"
#include "bench/i2c_sensor.hpp"
#include "bench/servo_checker.hpp"
#include "bridge_registers.h"
#include "core/error.h"
#include "device/fpga_bridge_bus.h"
#include "device/i2c_recovery.h"

namespace {

using hdl::kMs;
using hdl::kUs;

struct Kind {
    const char *name;
    unsigned khz;
    std::function<void(hdl::I2cMaster &)> transfer;
};

std::function<void(hdl::I2cMaster &)> write_of(uint8_t address, std::vector<uint8_t> bytes) {
    return [=](hdl::I2cMaster &master) { master.write(address, bytes); };
}

std::function<void(hdl::I2cMaster &)> read_of(uint8_t address, uint8_t index, size_t bytes) {
    return [=](hdl::I2cMaster &master) {
        master.write(address, {index}, false);
        master.read(address, bytes);
    };
}

std::vector<Kind> kinds() {
    constexpr uint8_t bridge = BRIDGE_I2C_ADDRESS;
    const uint8_t key_high = BRIDGE_UNLOCK_KEY >> 8, key_low = BRIDGE_UNLOCK_KEY & 0xFF;
    return {{"a word, read back", 1000,
             [](hdl::I2cMaster &master) {
                 master.write(bridge, {BRIDGE_SCRATCH, 0xA5, 0x00}, false);
                 read_of(bridge, BRIDGE_SCRATCH, 2)(master);
             }},
            {"two words", 400, write_of(bridge, {BRIDGE_PATTERN_WIDTH, 0, 64, 0, 48})},
            {"a servo's target", 100, write_of(bridge, {BRIDGE_SERVO0_TARGET_Q4, 0x60, 0x00})},
            {"write 1 to clear", 1000, write_of(bridge, {BRIDGE_IRQ_STATUS, 0, 0x02})},
            {"the key", 1000, write_of(bridge, {BRIDGE_UNLOCK, key_high, key_low})},
            {"a trigger", 400, write_of(bridge, {BRIDGE_TRIGGER_CTRL, 0, 0x01})},
            {"soft reset", 1000, write_of(bridge, {BRIDGE_CTRL, 0x40, 0x00})},
            {"a register that is not there", 1000, write_of(bridge, {0xF0, 1, 2})},
            {"a pair", 400, read_of(bridge, BRIDGE_TIME_HIGH, 4)},
            {"a camera's record", 1000, read_of(bridge, BRIDGE_CAMERA0_FRAMES, 16)},
            {"a write to a sensor", 400, write_of(0x5C, {0x04, 0xA5, 0x00})},
            {"a read of a sensor", 400, read_of(0x5E, 0x04, 2)}};
}

enum class Others { kNothing, kHoldSda, kReleaseSda, kHoldScl };
const char *const kNames[] = {"nobody", "SDA held for 50 ms", "SDA held until clocks come",
                              "SCL held for 20 ms"};

// The registers' bits that only a write can change, the sensors' registers, and what was started.
using State = std::vector<uint32_t>;

struct TriggerCount : hdl::Listener {
    uint32_t wanted() const override { return BRIDGE_EVENT_SENSOR; }
    void on_event(uint64_t, uint32_t, const bridge_outputs &now) override {
        pulses += now.trigger[0] != 0 && !level;
        level = now.trigger[0] != 0;
    }
    uint32_t pulses = 0;
    bool level = false;
};

struct Bench {
    hdl::Bridge bridge;
    hdl::I2cSensor left, right;
    TriggerCount trigger;

    explicit Bench(uint64_t seed)
        : bridge(seed), left(bridge, 0, 300 * hdl::kNs), right(bridge, 1, 300 * hdl::kNs) {
        bridge.add(trigger);
    }
    ~Bench() { bridge.remove(trigger); }

    // Everything as it is before each transfer: unlocked, so that all can be written, and no value
    // that zeros or ones could leave unchanged.
    void prepare() {
        bridge.in.scl = bridge.in.sda = 1;
        bridge.drive();
        bridge.reset();
        bridge.run(5 * kUs);
        bridge.run_idle(150 * kUs);  // the branches are cleared after a reset
        hdl::I2cMaster master(bridge, hdl::standard_timing(1000));
        hdl::Registers registers(master);
        CHECK(registers.write(BRIDGE_SCRATCH, 0x1234));
        CHECK(registers.write(BRIDGE_IRQ_TEST, 0x82));
        CHECK(registers.write(BRIDGE_SERVO0_TARGET_Q4, 0x5A5A));
        CHECK(registers.write(BRIDGE_UNLOCK, BRIDGE_UNLOCK_KEY));
        left.registers.fill(0x3C96);
        right.registers.fill(0x3C96);
        trigger.pulses = 0;
    }

    // Whether the transfer was broken off before its end; lines stay as they are then.
    bool begin(const Kind &kind, uint64_t moves) {
        hdl::I2cMaster master(
            bridge, kind.khz == 400 ? hdl::branch_timing(400) : hdl::standard_timing(kind.khz));
        master.abort_after(moves);
        try {
            kind.transfer(master);
        } catch (const hdl::Aborted &) {
            return true;
        }
        return false;
    }

    State state() {
        hdl::I2cMaster master(bridge, hdl::standard_timing(1000));
        hdl::Registers registers(master);
        const size_t count = BRIDGE_BRANCH_CTRL + 1;
        const auto words = registers.read(0, count);
        REQUIRE(words);
        State state;
        for (const bridge_register &row : bridge_registers) {
            unsigned mask = row.stored_mask | row.clear_mask;
            if (row.index == BRIDGE_UNLOCK) {
                mask = 1;
            } else if (row.index == BRIDGE_IRQ_STATUS) {
                mask &= ~unsigned(BRIDGE_IRQ_STATUS_I2C_ERROR_MASK);
            }
            REQUIRE(row.index < count);
            state.push_back(uint32_t(row.index) << 16 | ((*words)[row.index] & mask));
        }
        state.insert(state.end(), left.registers.begin(), left.registers.end());
        state.insert(state.end(), right.registers.begin(), right.registers.end());
        state.push_back(trigger.pulses);
        return state;
    }

    // What the broken transfer alone does: nothing moves afterwards until all have given up.
    State alone(const Kind &kind, uint64_t moves) {
        prepare();
        begin(kind, moves);
        bridge.run(2 * kUs);
        bridge.run_idle(40 * kMs);
        bridge.in.scl = bridge.in.sda = 1;
        bridge.drive();
        bridge.run(5 * kUs);
        bridge.run_idle(200 * kUs);
        return state();
    }
};

std::string difference(const State &is, const State &should) {
    for (size_t i = 0; i < is.size(); i++) {
        if (is[i] != should[i]) {
            char text[80];
            std::snprintf(text, sizeof text, "place %zu holds %06X instead of %06X", i,
                          unsigned(is[i]), unsigned(should[i]));
            return text;
        }
    }
    return "";
}

// For each number of moves, what the transfer alone does by then. It changes at few of them only,
// which halving finds.
void fill_alone(Bench &bench, const Kind &kind, size_t from, size_t to,
                std::vector<State> &states) {
    if (to - from <= 1) {
        return;
    }
    if (states[from] == states[to]) {
        std::fill(states.begin() + long(from) + 1, states.begin() + long(to), states[from]);
        return;
    }
    const size_t middle = from + (to - from) / 2;
    states[middle] = bench.alone(kind, middle);
    fill_alone(bench, kind, from, middle, states);
    fill_alone(bench, kind, middle, to, states);
}

// Recovers with the others' hold. Empty when all is well.
std::string recover(Bench &bench, Others others) {
    hdl::DriverBus lines(bench.bridge, hdl::standard_timing(100));
    const uint64_t begin_ps = bench.bridge.now();
    const auto run = [&] {
        return i2c_recovery_run(lines.bus(), lines.clock(), FPGA_BRIDGE_QUIET_US);
    };
    if (others == Others::kHoldSda) {
        lines.others_pull(HAL_I2C_SDA);
        if (run() != ERROR_I2C_STUCK) {
            return "SDA is held, and not reported";
        }
        lines.others_pull(0);
    } else if (others == Others::kReleaseSda) {
        lines.others_pull(HAL_I2C_SDA);
        lines.release_after(3);
    } else if (others == Others::kHoldScl) {
        lines.others_pull(HAL_I2C_SCL);
        lines.allow_idle(false);
        bench.bridge.at(begin_ps + 20 * kMs, [&] { lines.others_pull(0); });
    }
    const int error = run();
    if (error != ERROR_OK) {
        return "recovery ends with " + std::to_string(error);
    }
    if (others == Others::kNothing && bench.bridge.now() - begin_ps > 35 * kMs) {
        return "recovery takes longer than 35 ms";
    }
    if (lines.recovery_falls() > 0 && others != Others::kHoldSda && others != Others::kReleaseSda) {
        return "clocks, though nobody but the bridge held SDA";
    }
    return "";
}

}  // namespace

TEST_CASE("recovery begun at each bit of each transfer writes nothing") {
    const uint64_t seed = synthetic::test_seed();
    INFO("seed " << seed);
    const bool all_ways = hdl::draws(0) != 0;
    uint64_t tries = 0, steps = 0;
    for (const Kind &kind : kinds()) {
        Bench bench(seed);
        bench.prepare();
        hdl::I2cMaster counter(bench.bridge, hdl::branch_timing(400));
        kind.transfer(counter);
        const size_t all = counter.moves();
        std::vector<State> states(all + 1);
        states[0] = bench.alone(kind, 0);
        states[all] = bench.alone(kind, all);
        fill_alone(bench, kind, 0, all, states);
        for (size_t moves = 0; moves <= all; moves++) {
            steps += moves > 0 && states[moves] != states[moves - 1];
            // SCL held costs 25 times as much as the others.
            for (unsigned way = 0; way < 4; way++) {
                if (!all_ways && way != (moves % 13 == 5 ? 3 : moves % 3)) {
                    continue;
                }
                tries++;
                bench.prepare();
                bench.begin(kind, moves);
                std::string wrong = recover(bench, Others(way));
                wrong += difference(bench.state(), states[moves]);
                CAPTURE(kind.name);
                CAPTURE(moves);
                CAPTURE(kNames[way]);
                CHECK(wrong == "");
            }
        }
        CHECK(bench.bridge.servos().faults().empty());
    }
    // Words were stored by some of the transfers themselves, so the registers do show it.
    CHECK(steps >= 8);
    MESSAGE(tries << " recoveries");
}

TEST_CASE("where the lines cannot be reached, silence alone recovers, and writes nothing") {
    const Kind kind = kinds().front();
    Bench bench(synthetic::test_seed());
    for (uint64_t moves = 0; moves < 100; moves += 7) {
        const State expected = bench.alone(kind, moves);
        bench.prepare();
        bench.begin(kind, moves);
        bench.bridge.in.scl = bench.bridge.in.sda = 1;
        bench.bridge.drive();
        hdl::DriverBus lines(bench.bridge, hdl::standard_timing(100));
        lines.hide_lines();
        CHECK(i2c_recovery_run(lines.bus(), lines.clock(), FPGA_BRIDGE_QUIET_US) == ERROR_OK);
        CHECK(bench.bridge.out().sda == 1);
        CHECK(difference(bench.state(), expected) == "");
    }
}

TEST_CASE("nine clocks with SDA let go, as the textbook has it, do write") {
    const Kind kind = kinds().front();
    Bench bench(synthetic::test_seed());
    unsigned accidents = 0;
    for (uint64_t moves = 0; moves < 120; moves++) {
        const State expected = bench.alone(kind, moves);
        bench.prepare();
        bench.begin(kind, moves);
        hdl::I2cMaster master(bench.bridge, hdl::standard_timing(100));
        master.let_go();
        for (int clock = 0; clock < 9; clock++) {
            bench.bridge.in.scl = 0;
            bench.bridge.drive();
            bench.bridge.run(5 * kUs);
            bench.bridge.in.scl = 1;
            bench.bridge.drive();
            bench.bridge.run(5 * kUs);
        }
        accidents += difference(bench.state(), expected).empty() ? 0 : 1;
    }
    MESSAGE(accidents << " of 120 write a register");
    CHECK(accidents > 0);
}
