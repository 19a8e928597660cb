// SPDX-License-Identifier: Apache-2.0
// Millions of bus symbols: the target answers each as documented, and the servos are not disturbed.
#include <doctest/doctest.h>

#include <chrono>
#include <string>

#include "bench/bus_symbols.hpp"
#include "bench/i2c_master.hpp"
#include "bench/register_map.hpp"
#include "bench/servo_checker.hpp"

namespace {

using hdl::kNs;
using hdl::kUs;

// Registers whose writing legitimately stops or shifts a servo's frames, or changes the bus itself.
const std::set<uint8_t> kRules = {0x07, 0x08, 0x0D, 0x0E, 0x0F, 0x55, 0x56};

// Timing of one clock. At the fast rate the router must not take part (see i2c_router.v).
struct Pace {
    uint64_t low_ps, half_high_ps;
};
constexpr Pace kFast = {500 * kNs, 260 * kNs}, kRouted = {1300 * kNs, 700 * kNs};

void start_servos(hdl::Bridge &bridge) {
    hdl::I2cMaster master(bridge, hdl::standard_timing(1000));
    hdl::Registers registers(master);
    REQUIRE(registers.write(0x56, 1));
    REQUIRE(registers.write(0x08, 3));
    // Result of a read without an index, before any other index is written.
    REQUIRE(master.write(hdl::Registers::kAddress, {0x00}) == 2);
    bridge.run_idle(41 * hdl::kMs);
    REQUIRE(bridge.servos().pulses(0).size() >= 1);
    REQUIRE(bridge.servos().pulses(1).size() >= 1);
    bridge.servos().demand(0, 20 * hdl::kMs);
    bridge.servos().demand(1, 20 * hdl::kMs);
}

// One clock. Returns the wire before and after the
// middle.
hdl::Symbol play(hdl::Bridge &bridge, hdl::Symbol symbol, const Pace &pace, hdl::Random &random) {
    const uint64_t jitter = random.below(40000);
    bridge.in.scl = 0;
    bridge.in.sda = symbol.first;
    bridge.drive();
    bridge.run(pace.low_ps + jitter);
    bridge.in.scl = 1;
    bridge.drive();
    bridge.run(pace.half_high_ps);
    hdl::Symbol seen;
    seen.first = bridge.out().sda != 0;
    if (symbol.first != symbol.second) {
        bridge.in.sda = symbol.second;
        bridge.drive();
        bridge.run(pace.half_high_ps);
    }
    seen.second = bridge.out().sda != 0;
    return seen;
}

std::string words(hdl::TargetOracle::Pull pull) {
    return pull == hdl::TargetOracle::Pull::kYes ? "pulled" : "let go";
}

void play_symbols(uint64_t symbols, const Pace &pace) {
    const uint64_t seed = synthetic::test_seed();
    INFO("seed " << seed);
    hdl::Bridge bridge(seed);
    start_servos(bridge);
    hdl::SymbolSource source(seed);
    hdl::TargetOracle oracle(hdl::register_indices());
    oracle.follow(0x00, 0x5B1D, true);
    oracle.follow(0x04, 0, false);
    uint64_t wrong = 0, unsure = 0;
    const auto started = std::chrono::steady_clock::now();
    for (uint64_t i = 0; i < symbols && wrong == 0; i++) {
        hdl::Symbol symbol = source.next();
        uint8_t index = 0;
        if (oracle.about_to_store(index) && kRules.count(index) != 0) {
            symbol = hdl::kStart;
        }
        if (oracle.judging() && !symbol.first && !symbol.second) {
            symbol = hdl::kOne;
        }
        const hdl::TargetOracle::Pull pull = oracle.pull();
        const hdl::Symbol wire = play(bridge, symbol, pace, source.random());
        if (pull == hdl::TargetOracle::Pull::kUnsure) {
            unsure++;
        } else {
            const bool free = pull == hdl::TargetOracle::Pull::kNo;
            if (wire.first != (symbol.first && free) || wire.second != (symbol.second && free)) {
                wrong++;
                FAIL_CHECK("symbol " << i << " at " << bridge.now() / kNs << " ns: should be "
                                     << words(pull) << ", wire " << wire.first << wire.second
                                     << " of " << symbol.first << symbol.second);
            }
        }
        oracle.clock(wire.first, wire.second);
    }
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    bridge.servos().look(bridge.now());
    for (const std::string &fault : bridge.servos().faults()) {
        FAIL_CHECK(fault);
    }
    CHECK(oracle.stored() > symbols / 4000);
    // Both agree about the final contents.
    hdl::I2cMaster master(bridge, hdl::standard_timing(1000));
    master.clear_bus();
    hdl::Registers registers(master);
    CHECK(registers.read(0x04) == oracle.value(0x04));
    MESSAGE(symbols << " symbols, " << oracle.stored() << " words stored, " << unsure
                    << " clocks of unknown registers, " << bridge.servos().pulses(0).size()
                    << " servo frames, " << uint64_t(double(symbols) / seconds) << " symbols/s");
}

}  // namespace

TEST_CASE("random bus symbols at 1 MHz: each answer as documented, no servo frame missed") {
    play_symbols(hdl::draws(1000000), kFast);
}

TEST_CASE("random bus symbols at 400 kHz, with the router and no sensors") {
    play_symbols(hdl::draws(1000000) / 20, kRouted);
}

TEST_CASE("random moves of both lines, shorter than any clock: servos never notice") {
    const uint64_t seed = synthetic::test_seed() + 1, moves = hdl::draws(200000);
    INFO("seed " << seed);
    hdl::Bridge bridge(seed);
    start_servos(bridge);
    hdl::Random random(seed);
    for (uint64_t i = 0; i < moves; i++) {
        bridge.in.scl = uint8_t(random.below(2));
        bridge.in.sda = uint8_t(random.below(2));
        bridge.drive();
        bridge.run(random.between(1 * kNs, random.chance(0.5) ? 100 * kNs : 800 * kNs));
    }
    bridge.servos().look(bridge.now());
    for (const std::string &fault : bridge.servos().faults()) {
        FAIL_CHECK(fault);
    }
    hdl::I2cMaster master(bridge, hdl::standard_timing(400));
    CHECK(master.clear_bus());
    hdl::Registers registers(master);
    CHECK(registers.read(0x00) == 0x5B1D);
}
