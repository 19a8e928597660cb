// SPDX-License-Identifier: Apache-2.0
// The width of a servo's pulse is the requested one, to the clock: whole microseconds and
// sixteenths, one slew step per frame, and never beyond the limits.
#include <doctest/doctest.h>

#include <algorithm>

#include "bench/bus_bench.hpp"
#include "bench/servo_checker.hpp"

namespace {

using hdl::kMs;
using hdl::kUs;

constexpr uint64_t kFrame = 20 * kMs;
constexpr uint32_t kMinQ4 = 900 * 16, kMaxQ4 = 2100 * 16, kCentreQ4 = 1500 * 16;

uint64_t width_ps(uint32_t q4) {
    return (q4 >> 4) * kUs + (q4 & 15u) * 25 / 16 * BRIDGE_CONTROL_PERIOD_PS;
}

struct Bench : hdl::BusBench {
    explicit Bench(uint64_t seed) : BusBench(seed) {
        REQUIRE(registers.write(0x0E, 60000));
        REQUIRE(registers.write(0x08, 3));
        bridge.run_idle(2 * kFrame);
    }
    // The next frame's pulses with the exact clock; the time between them is idle.
    void next_frame() {
        const uint64_t rise = bridge.servos().pulses(0).back().rise_ps;
        bridge.run_idle(rise + kFrame - 10 * kUs - bridge.now());
        bridge.run(10 * kUs + hdl::ServoChecker::kLongest + 5 * kUs);
    }
    uint64_t last_width(int servo) const { return bridge_pulses(servo).back().width_ps(); }
    const std::vector<hdl::Pulse> &bridge_pulses(int servo) const {
        return const_cast<hdl::Bridge &>(bridge).servos().pulses(servo);
    }
};

uint32_t toward(uint32_t actual, uint32_t target, uint32_t slew) {
    return actual < target ? std::min(actual + slew, target) : std::max(actual - slew, target);
}

}  // namespace

TEST_CASE("each pulse is as wide as the registers say, to the clock") {
    const uint64_t seed = synthetic::test_seed();
    INFO("seed " << seed);
    Bench bench(seed);
    hdl::Random random(seed);
    uint32_t actual[] = {kCentreQ4, kCentreQ4}, target[] = {kCentreQ4, kCentreQ4};
    uint32_t slew[] = {30 * 16, 30 * 16};
    bench.next_frame();
    for (uint64_t frame = 0; frame < hdl::draws(80); frame++) {
        for (unsigned servo = 0; servo < BRIDGE_SERVOS; servo++) {
            const auto first = uint8_t(0x10 + 8 * servo);
            if (random.chance(0.4)) {
                // Also beyond the limits, which are then used instead.
                target[servo] = uint32_t(random.between(600 * 16, 2400 * 16));
                REQUIRE(bench.registers.write(first, uint16_t(target[servo])));
            }
            if (random.chance(0.3)) {
                slew[servo] = random.chance(0.2) ? 0 : uint32_t(random.between(1, 2047));
                REQUIRE(bench.registers.write(uint8_t(first + 5), uint16_t(slew[servo])));
            }
            const uint32_t wanted = std::clamp(target[servo], kMinQ4, kMaxQ4);
            actual[servo] = toward(actual[servo], wanted, slew[servo]);
        }
        bench.next_frame();
        for (int servo = 0; servo < BRIDGE_SERVOS; servo++) {
            INFO("frame " << frame << " servo " << servo << " width " << actual[servo] << " / 16");
            CHECK(bench.last_width(servo) == width_ps(actual[servo]));
            CHECK(bench.registers.read(uint8_t(0x11 + 8 * servo)) == actual[servo]);
        }
    }
    CHECK(bench.bridge.servos().faults().empty());
}

TEST_CASE("limits hold whatever is asked for, and change only while they are unlocked") {
    const uint64_t seed = synthetic::test_seed();
    INFO("seed " << seed);
    Bench bench(seed);
    hdl::Random random(seed + 1);
    const uint8_t min = 0x12, max = 0x13, slew = 0x15, unlock = 0x0D;
    uint32_t actual[] = {kCentreQ4, kCentreQ4}, steps = 2047;
    for (uint8_t servo = 0; servo < BRIDGE_SERVOS; servo++) {
        REQUIRE(!bench.registers.write(uint8_t(min + 8 * servo), 16000));
        REQUIRE(!bench.registers.write(uint8_t(max + 8 * servo), 36000));
        REQUIRE(bench.registers.write(uint8_t(slew + 8 * servo), uint16_t(steps)));
    }
    bench.next_frame();
    for (uint64_t round = 0; round < hdl::draws(8); round++) {
        uint32_t wanted[BRIDGE_SERVOS];
        REQUIRE(bench.registers.write(unlock, 0x4C4B));
        for (unsigned servo = 0; servo < BRIDGE_SERVOS; servo++) {
            const auto first = uint8_t(0x10 + 8 * servo);
            const auto shortest = uint32_t(random.between(9600, kCentreQ4));
            const auto longest = uint32_t(random.between(kCentreQ4, 38400));
            const auto target = uint32_t(random.chance(0.5) ? 9600 + 28800 * random.below(2)
                                                            : random.between(9600, 38400));
            REQUIRE(bench.registers.write(uint8_t(first + 2), uint16_t(shortest)));
            REQUIRE(bench.registers.write(uint8_t(first + 3), uint16_t(longest)));
            REQUIRE(bench.registers.write(first, uint16_t(target)));
            wanted[servo] = std::clamp(target, shortest, longest);
        }
        REQUIRE(bench.registers.write(unlock, 1));
        REQUIRE(!bench.registers.write(min, 9600));
        for (int frame = 0; frame < 5; frame++) {
            bench.next_frame();
            for (int servo = 0; servo < BRIDGE_SERVOS; servo++) {
                INFO("round " << round << " frame " << frame << " servo " << servo);
                actual[servo] = toward(actual[servo], wanted[servo], steps);
                CHECK(bench.last_width(servo) == width_ps(actual[servo]));
            }
        }
    }
    CHECK(bench.bridge.servos().faults().empty());
}
