// SPDX-License-Identifier: Apache-2.0
// Recovery of the bus writes nothing: transfers of each kind are interrupted after each change of a
// line, and lines are held by other devices in several ways. All registers of the bridge and both
// sensors then contain exactly the complete words. The textbook recoveries fail the same test.
#include <doctest/doctest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "bench/driver_bus.hpp"
#include "bench/driver_world.hpp"
#include "bench/servo_checker.hpp"
#include "bridge_registers.h"
#include "core/error.h"
#include "device/fpga_bridge_bus.h"
#include "device/i2c_recovery.h"

namespace {

using hdl::kMs;
using hdl::kUs;
using State = hdl::DriverWorld::State;

constexpr uint8_t kBridge = BRIDGE_I2C_ADDRESS, kLeft = 0x5C, kRight = 0x5E, kBoth = 0x5D;

struct Kind {
    const char *name;
    unsigned khz;
    uint8_t address;
    std::vector<uint8_t> bytes;  // written first
    std::vector<uint8_t> again;  // written after a repeated START
    size_t read;                 // bytes read after a repeated START
    std::vector<size_t> words;   // indices of the bytes that complete a word; the address is 0
};

std::vector<Kind> kinds() {
    const uint8_t key_high = BRIDGE_UNLOCK_KEY >> 8, key_low = BRIDGE_UNLOCK_KEY & 0xFF;
    return {{"word, read back", 1000, kBridge, {BRIDGE_SCRATCH, 0xA5, 0}, {BRIDGE_SCRATCH}, 2, {3}},
            {"two words", 400, kBridge, {BRIDGE_PATTERN_WIDTH, 0, 64, 0, 48}, {}, 0, {3, 5}},
            {"servo", 100, kBridge, {BRIDGE_SERVO0_TARGET_Q4, 0x60, 0}, {}, 0, {3}},
            {"write 1 to clear", 1000, kBridge, {BRIDGE_IRQ_STATUS, 0, 2}, {}, 0, {3}},
            {"lock", 1000, kBridge, {BRIDGE_UNLOCK, 0, 0}, {}, 0, {3}},
            {"key", 1000, kBridge, {BRIDGE_UNLOCK, key_high, key_low}, {}, 0, {}},
            {"trigger", 400, kBridge, {BRIDGE_TRIGGER_CTRL, 0, 1}, {}, 0, {3}},
            {"soft reset", 1000, kBridge, {BRIDGE_CTRL, 0x40, 0}, {}, 0, {3}},
            {"no such register", 1000, kBridge, {0xF0, 1, 2}, {}, 0, {}},
            {"pair", 400, kBridge, {BRIDGE_TIME_HIGH}, {}, 4, {}},
            {"camera", 1000, kBridge, {BRIDGE_CAMERA0_FRAMES}, {}, 16, {}},
            {"write to the left sensor", 400, kLeft, {4, 0xA5, 0}, {}, 0, {3}},
            {"write to both sensors", 400, kBoth, {4, 0xA5, 0}, {}, 0, {3}},
            {"read of the right sensor", 400, kRight, {4}, {}, 2, {}}};
}

// The timings of a kind. SDA changes so late that the fall of SCL was processed before: an
// interruption between the two counts as after the fall.
hdl::I2cTiming timing_of(const Kind &kind) {
    hdl::I2cTiming timing =
        kind.khz == 400 ? hdl::branch_timing(400) : hdl::standard_timing(kind.khz);
    timing.data_hold = 400 * hdl::kNs;
    return timing;
}

void transfer(hdl::I2cMaster &master, const Kind &kind) {
    const bool more = !kind.again.empty() || kind.read != 0;
    const size_t acknowledged = master.write(kind.address, kind.bytes, !more);
    if (more && acknowledged == kind.bytes.size() + 1) {
        if (!kind.again.empty()) {
            master.write(kind.address, kind.again, false);
        }
        master.read(kind.address, kind.read);
    }
}

class Falls : public hdl::Listener {
  public:
    uint32_t wanted() const override { return BRIDGE_EVENT_BUS; }
    void on_event(uint64_t, uint32_t, const bridge_outputs &now) override {
        count += now.scl == 0 && scl_;
        scl_ = now.scl != 0;
    }
    size_t count = 0;

  private:
    bool scl_ = true;
};

using Recovery = std::function<int(const hal_i2c *, const hal_clock *)>;

int ours(const hal_i2c *bus, const hal_clock *clock) {
    return i2c_recovery_run(bus, clock, FPGA_BRIDGE_QUIET_US);
}

// Drives lines for half a period of 100 kHz; returns which are high.
unsigned half_period(const hal_i2c *bus, const hal_clock *clock, unsigned pulled) {
    unsigned high = 0;
    bus->operations->lines(bus->self, pulled, &high);
    clock->operations->wait_until_us(clock->self, clock->operations->now_us(clock->self) + 5);
    bus->operations->lines(bus->self, pulled, &high);
    return high;
}

void stop(const hal_i2c *bus, const hal_clock *clock) {
    for (int pulled : {+HAL_I2C_SCL, HAL_I2C_SCL | HAL_I2C_SDA, +HAL_I2C_SDA, 0}) {
        half_period(bus, clock, unsigned(pulled));
    }
}

// UM10204, 3.1.16: nine clocks with SDA released, then STOP.
int nine_clocks(const hal_i2c *bus, const hal_clock *clock) {
    half_period(bus, clock, 0);
    for (int i = 0; i < 9; i++) {
        half_period(bus, clock, HAL_I2C_SCL);
        half_period(bus, clock, 0);
    }
    stop(bus, clock);
    return ERROR_OK;
}

// Clocks only while SDA is low, then STOP.
int clocks_while_held(const hal_i2c *bus, const hal_clock *clock) {
    unsigned high = half_period(bus, clock, 0);
    for (int i = 0; i < 9 && (high & HAL_I2C_SDA) == 0; i++) {
        half_period(bus, clock, HAL_I2C_SCL);
        high = half_period(bus, clock, 0);
    }
    stop(bus, clock);
    return ERROR_OK;
}

enum Others { kNobody, kSdaShort, kSdaLong, kSdaForever, kSdaClocked, kSclLong, kBothLong, kLate };
const char *const kNames[] = {"no device",
                              "SDA held for 40 us",
                              "SDA held for 20 ms",
                              "SDA held until it was reported",
                              "SDA held until the third clock",
                              "SCL held for 20 ms",
                              "both held for 20 ms",
                              "left alone for 40 ms before"};
constexpr unsigned kWays = 8;
constexpr uint64_t kLimit = 35 * kMs;

// Recovers while other devices hold lines. Empty if it succeeds and is fast enough.
std::string recover(hdl::Bridge &bridge, Others others, const Recovery &recovery) {
    hdl::DriverBus lines(bridge, hdl::standard_timing(100));
    const auto run = [&] { return recovery(lines.bus(), lines.clock()); };
    switch (others) {
        case kNobody:
            break;
        case kSdaShort:
            lines.others_pull(HAL_I2C_SDA, 40 * kUs);
            break;
        case kSdaLong:
            lines.others_pull(HAL_I2C_SDA, 20 * kMs);
            break;
        case kSdaForever:
            lines.others_pull(HAL_I2C_SDA);
            if (run() != ERROR_I2C_STUCK) {
                return "SDA is held, and not reported; ";
            }
            lines.others_pull(0);
            break;
        case kSdaClocked:
            lines.others_pull(HAL_I2C_SDA);
            lines.release_after(3);
            break;
        case kSclLong:
            lines.others_pull(HAL_I2C_SCL, 20 * kMs);
            break;
        case kBothLong:
            lines.others_pull(HAL_I2C_SCL | HAL_I2C_SDA, 20 * kMs);
            break;
        case kLate:
            lines.wait(40 * kMs);
            break;
    }
    const uint64_t begin_ps = bridge.now();
    const int error = run();
    if (error != ERROR_OK) {
        return "recovery ends with " + std::to_string(error) + "; ";
    }
    // Devices that release the lines themselves do not count.
    const uint64_t free_ps = others == kSdaClocked ? 0 : lines.released_ps();
    const bool slow = bridge.now() - std::max(begin_ps, free_ps) > kLimit;
    return slow ? "recovery takes longer than 35 ms; " : "";
}

// Clocks without START, two bytes of zeros and two of ones: no device may take them as data.
void clock_without_start(hdl::Bridge &bridge) {
    for (unsigned i = 0; i < 36; i++) {
        bridge.in.scl = 0;
        bridge.drive();
        bridge.run(400 * hdl::kNs);
        bridge.in.sda = i >= 18;
        bridge.drive();
        bridge.run(kUs);
        bridge.in.scl = 1;
        bridge.drive();
        bridge.run(kUs);
    }
}

// The states that a kind's words produce in order; the first is the initial one.
class Expected {
  public:
    Expected(hdl::DriverWorld &world, const Kind &kind) : kind_(kind) {
        states_.push_back(complete(world, 0));
        for (size_t word : kind.words) {
            states_.push_back(complete(world, word));
            CHECK(states_.back() != states_[states_.size() - 2]);
        }
    }
    /// After this many falls of SCL: a word is stored at the fall that ends its last byte.
    const State &after(size_t falls) const {
        size_t taken = 0;
        for (size_t word : kind_.words) {
            taken += falls >= 9 * word + 9;
        }
        return states_[taken];
    }
    const State &before() const { return states_.front(); }

  private:
    State complete(hdl::DriverWorld &world, size_t bytes) const {
        world.prepare();
        if (bytes > 0) {
            hdl::I2cMaster master(world.bridge, timing_of(kind_));
            master.write(kind_.address, {kind_.bytes.begin(), kind_.bytes.begin() + long(bytes)});
            world.bridge.run(50 * kUs);
        }
        const auto state = world.state();
        REQUIRE(state);
        return *state;
    }

    const Kind &kind_;
    std::vector<State> states_;
};

struct Result {
    uint64_t tries = 0, wrong = 0;
};

// How often each interruption point of a kind is tried: one of this many.
using Choose = std::function<bool(size_t moves, unsigned way)>;

void break_off(const Kind &kind, const Recovery &recovery, const Choose &choose, bool report,
               Result &result) {
    hdl::DriverWorld world(synthetic::test_seed());
    const Expected expected(world, kind);
    world.prepare();
    hdl::I2cMaster counter(world.bridge, timing_of(kind));
    transfer(counter, kind);
    bool clean = false;
    for (size_t moves = 0; moves <= counter.moves(); moves++) {
        for (unsigned way = 0; way < kWays; way++) {
            if (!choose(moves, way)) {
                continue;
            }
            if (!clean) {
                world.prepare();
            }
            Falls falls;
            world.bridge.add(falls);
            hdl::I2cMaster master(world.bridge, timing_of(kind));
            master.abort_after(moves);
            try {
                transfer(master, kind);
            } catch (const hdl::Aborted &) {
            }
            world.bridge.remove(falls);
            // Devices that pull SCL down end the bit that the master left high.
            const bool scl_taken = way == kSclLong || way == kBothLong;
            falls.count += scl_taken && world.bridge.out().scl != 0;
            std::string wrong = recover(world.bridge, Others(way), recovery);
            clock_without_start(world.bridge);
            const auto state = world.state();
            wrong += state ? hdl::difference(*state, expected.after(falls.count)) : "no answer";
            clean = state == expected.before();
            result.tries++;
            result.wrong += !wrong.empty();
            if (report && !wrong.empty()) {
                FAIL_CHECK(std::string(kind.name) << " after " << moves << " moves, "
                                                  << std::string(kNames[way]) << ": " << wrong);
            }
        }
    }
    CHECK(world.bridge.servos().faults().empty());
}

}  // namespace

TEST_CASE("recovery begun after each move of each transfer writes nothing") {
    const uint64_t seed = synthetic::test_seed();
    INFO("seed " << seed);
    hdl::Random random(seed);
    const bool all = hdl::draws(0) != 0;
    Result result;
    for (const Kind &kind : kinds()) {
        break_off(
            kind, ours, [&](size_t, unsigned) { return all || random.below(14 * kWays) == 0; },
            true, result);
    }
    MESSAGE(result.tries << " recoveries");
    CHECK(result.wrong == 0);
}

TEST_CASE("where the lines cannot be reached, silence alone recovers, and writes nothing") {
    Result result;
    const Recovery blind = [](const hal_i2c *bus, const hal_clock *clock) {
        hal_i2c_operations operations = *bus->operations;
        unsigned high = 0;
        operations.lines(bus->self, 0, &high);  // the backend releases them
        operations.lines = nullptr;
        const hal_i2c hidden = {&operations, bus->self};
        return i2c_recovery_run(&hidden, clock, FPGA_BRIDGE_QUIET_US);
    };
    break_off(
        kinds().front(), blind,
        [](size_t moves, unsigned way) { return way == kNobody && moves % 9 == 4; }, true, result);
    CHECK(result.tries >= 10);
    CHECK(result.wrong == 0);
}

TEST_CASE("the textbook's recoveries fail that test") {
    const Choose some = [](size_t moves, unsigned way) { return way == kNobody && moves % 4 == 0; };
    Result blind;
    break_off(kinds().front(), nine_clocks, some, false, blind);
    MESSAGE("nine clocks: " << blind.wrong << " of " << blind.tries << " go wrong");
    CHECK(blind.wrong > 0);
    const Choose held = [](size_t moves, unsigned way) {
        return way == kSdaClocked && moves % 4 == 0;
    };
    Result careful;
    break_off(kinds().front(), clocks_while_held, held, false, careful);
    MESSAGE("clocks while SDA is held: " << careful.wrong << " of " << careful.tries
                                         << " go wrong");
    CHECK(careful.wrong > 0);
}
