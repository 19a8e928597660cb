// SPDX-License-Identifier: Apache-2.0
// Random transfers to the left sensor, the right one, both, the bridge itself and unused addresses:
// each arrives where it belongs and nowhere else; and the behaviour when a transfer stops.
#include <doctest/doctest.h>

#include <string>

#include "bench/bus_bench.hpp"
#include "bench/i2c_sensor.hpp"
#include "bench/servo_checker.hpp"

namespace {

constexpr uint8_t kLeft = 0x5C, kRight = 0x5E, kBoth = 0x5D, kBranchCtrl = 0x56;
constexpr uint8_t kTimeouts = 0x51, kBranchErrors = 0x53, kDiag = 0x50;
// After a reset both branches are cleared first (i2c_router.v).
constexpr uint64_t kClearTime = 110 * hdl::kUs;

struct Bench : hdl::BusBench {
    hdl::I2cSensor left, right;
    std::array<uint16_t, 256> left_expected{}, right_expected{};
    hdl::Random random;

    Bench(uint64_t seed, uint64_t answer_ps)
        : BusBench(seed, hdl::branch_timing(400)),
          left(bridge, 0, answer_ps),
          right(bridge, 1, answer_ps),
          random(seed) {
        bridge.run_idle(kClearTime);
        REQUIRE(registers.write(kBranchCtrl, 1));
    }

    uint8_t some_address() { return uint8_t(kLeft + random.below(3)); }
    bool is_left(uint8_t address) const { return address != kRight; }
    bool is_right(uint8_t address) const { return address != kLeft; }

    bool write(uint8_t address) {
        const auto first = uint8_t(random.below(256));
        std::vector<uint8_t> bytes = {first};
        const uint32_t words = 1 + random.below(3);
        for (uint32_t i = 0; i < words; i++) {
            const auto value = uint16_t(random.below(65536));
            bytes.push_back(uint8_t(value >> 8));
            bytes.push_back(uint8_t(value));
            const auto index = uint8_t(first + i);
            if (is_left(address)) {
                left_expected[index] = value;
            }
            if (is_right(address)) {
                right_expected[index] = value;
            }
        }
        return master.write(address, bytes) == bytes.size() + 1;
    }

    bool read(uint8_t address) {
        const auto index = uint8_t(random.below(255));
        if (master.write(address, {index}, random.chance(0.5)) != 2) {
            return false;
        }
        const auto bytes = master.read(address, 4);
        const auto &expected = is_left(address) ? left_expected : right_expected;
        return bytes && ((*bytes)[0] << 8 | (*bytes)[1]) == expected[index] &&
               ((*bytes)[2] << 8 | (*bytes)[3]) == expected[uint8_t(index + 1)];
    }

    bool own() {
        const auto value = uint16_t(random.below(65536));
        return registers.write(0x04, value) && registers.read(0x04) == value;
    }

    // To an unused address, mostly one that differs from a sensor's in few bits.
    bool foreign() {
        uint8_t address = 0;
        do {
            address = random.chance(0.7) ? uint8_t(0x5D ^ 1u << random.below(7))
                                         : uint8_t(random.below(128));
        } while (address == hdl::Registers::kAddress || address == kLeft || address == kRight ||
                 address == kBoth);
        return random.chance(0.5) ? master.write(address, {0, 1, 2}) == 0
                                  : !master.read(address, 2);
    }

    bool same() const {
        return left.registers == left_expected && right.registers == right_expected;
    }
};

}  // namespace

TEST_CASE("random transfers to both sensors: none goes astray") {
    const uint64_t seed = synthetic::test_seed(), transfers = hdl::draws(2000);
    INFO("seed " << seed);
    uint64_t wrong = 0, astray = 0, done = 0;
    for (uint64_t answer_ns : {0u, 300u, 900u}) {
        for (unsigned khz : {100u, 400u}) {
            Bench bench(seed + answer_ns + khz, answer_ns * hdl::kNs);
            bench.master.set_timing(hdl::branch_timing(khz));
            for (uint64_t i = 0; i < transfers / (khz == 100 ? 30 : 4); i++, done++) {
                const uint64_t left = bench.left.addressed, right = bench.right.addressed;
                const uint64_t clocks[] = {bench.left.clocks, bench.right.clocks};
                const uint32_t kind = bench.random.below(10);
                const uint8_t address = bench.some_address();
                const bool right_way = kind == 0   ? bench.own()
                                       : kind <= 2 ? bench.foreign()
                                       : kind <= 6 ? bench.write(address)
                                                   : bench.read(address);
                wrong += !right_way || !bench.same();
                // Which sensors were addressed, and which were not.
                const bool for_left = kind > 2 && bench.is_left(address);
                const bool for_right = kind > 2 && bench.is_right(address);
                astray += (bench.left.addressed != left) != for_left;
                astray += (bench.right.addressed != right) != for_right;
                // For other addresses, a branch gets only the clocks of an address, three of them
                // here.
                astray += kind <= 2 && (bench.left.clocks - clocks[0] > 3 * 9 ||
                                        bench.right.clocks - clocks[1] > 3 * 9);
                if (!bench.same()) {
                    bench.left_expected = bench.left.registers;
                    bench.right_expected = bench.right.registers;
                }
            }
            CAPTURE(khz);
            CAPTURE(answer_ns);
            CHECK(bench.left.broken + bench.right.broken == 0);
            // No device answered that was not expected to.
            CHECK(bench.registers.read(kBranchErrors) == 0);
            CHECK(bench.left.short_times + bench.right.short_times == 0);
        }
    }
    CHECK(wrong == 0);
    CHECK(astray == 0);
    MESSAGE(done << " transfers");
}

TEST_CASE("no sensor there: not acknowledged, and the bus stays free") {
    hdl::Bridge bridge(synthetic::test_seed());
    hdl::I2cMaster master(bridge, hdl::branch_timing(400));
    hdl::Registers registers(master);
    CHECK(registers.write(kBranchCtrl, 1));
    for (uint8_t address : {kLeft, kRight, kBoth}) {
        CHECK(master.write(address, {1, 2, 3}) == 0);
        CHECK(!master.read(address, 2));
    }
    CHECK(registers.read(0x00) == 0x5B1D);
}

TEST_CASE("a hung sensor does not take the DSP's bus with it") {
    Bench bench(synthetic::test_seed(), 0);
    for (bool sda : {true, false}) {
        bench.left.hang(sda, !sda);
        bench.bridge.run_idle(40 * hdl::kMs);
        CHECK(bench.registers.read(0x00) == 0x5B1D);
        CHECK(bench.write(kRight));
        bench.left.hang(false, false);
        bench.bridge.run_idle(40 * hdl::kMs);
        CHECK(bench.write(kLeft));
        CHECK(bench.read(kLeft));
    }
    CHECK(bench.same());
}

TEST_CASE("a transfer to a sensor that stops with SCL low: its branch is let go after 31 ms") {
    for (const bool ones : {false, true}) {
        Bench bench(synthetic::test_seed(), 300 * hdl::kNs);
        REQUIRE(bench.registers.write(kBranchErrors, 0));
        REQUIRE(bench.registers.write(kTimeouts, 0));
        const uint64_t starts = bench.right.starts, stops = bench.left.stops;
        // Address, index, and half of the high byte; SCL stays low.
        bench.master.start();
        REQUIRE(bench.master.write_byte(kLeft << 1));
        REQUIRE(bench.master.write_byte(0x10));
        for (int i = 0; i < 4; i++) {
            bench.master.bit(ones);
        }
        bench.bridge.run_idle(28 * hdl::kMs);
        CHECK(bench.bridge.out().branch_scl[0] == 0);
        CHECK(bench.left.stops == stops);
        bench.bridge.run_idle(8 * hdl::kMs);
        CHECK(bench.bridge.in.scl == 0);
        for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
            CHECK(bench.bridge.out().branch_scl[camera] == 1);
            CHECK(bench.bridge.out().branch_sda[camera] == 1);
        }
        // STOP, where SDA was low, then the clear of this branch alone, which ends with one too.
        CHECK(bench.left.stops == stops + (ones ? 1 : 2));
        CHECK(bench.right.starts == starts + 1);
        bench.master.let_go();
        CHECK(bench.registers.read(kBranchErrors) == 1);
        CHECK(bench.registers.read(kTimeouts) == 1);
        CHECK((bench.registers.read(kDiag).value_or(0x0100) & 0x0100) == 0);
        CHECK(bench.write(kLeft));
        CHECK(bench.write(kRight));
        CHECK(bench.read(kLeft));
        CHECK(bench.same());
    }
}

TEST_CASE("a transfer that stops with SCL low for 29 ms continues") {
    Bench bench(synthetic::test_seed(), 300 * hdl::kNs);
    bench.master.start();
    REQUIRE(bench.master.write_byte(kRight << 1));
    REQUIRE(bench.master.write_byte(0x10));
    bench.bridge.run_idle(29 * hdl::kMs);
    CHECK(bench.master.write_byte(0x12));
    CHECK(bench.master.write_byte(0x34));
    bench.master.stop();
    bench.right_expected[0x10] = 0x1234;
    CHECK(bench.same());
}
