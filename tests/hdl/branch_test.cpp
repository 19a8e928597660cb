// SPDX-License-Identifier: Apache-2.0
// Software control of the sensors' branches: clearing, bypass, disabling; error counters and their
// saturation.
#include <doctest/doctest.h>

#include <string>

#include "bench/bus_bench.hpp"
#include "bench/i2c_sensor.hpp"
#include "bench/servo_checker.hpp"

namespace {

using hdl::kMs;
using hdl::kNs;
using hdl::kUs;

constexpr uint8_t kLeft = 0x5C, kRight = 0x5E, kOwn = 0x5D;
constexpr uint8_t kIrqStatus = 0x0A, kDiag = 0x50, kTimeouts = 0x51, kProtocolErrors = 0x52;
constexpr uint8_t kBranchErrors = 0x53, kSpikes = 0x54, kBusClear = 0x55, kBranchCtrl = 0x56;
constexpr uint16_t kClearBusy = 0x0100, kI2cError = 0x20;

// Changes on the lines of one branch.
class BranchWatch : public hdl::Listener {
  public:
    explicit BranchWatch(int camera) : camera_(camera) {}
    uint32_t wanted() const override { return BRIDGE_EVENT_BRANCH; }
    void on_event(uint64_t, uint32_t, const bridge_outputs &now) override {
        const bool scl = now.branch_scl[camera_] != 0, sda = now.branch_sda[camera_] != 0;
        clocks += scl && !scl_;
        starts += scl && scl_ && !sda && sda_;
        stops += scl && scl_ && sda && !sda_;
        moves += scl != scl_ || sda != sda_;
        scl_ = scl;
        sda_ = sda;
    }
    void clear() { clocks = starts = stops = moves = 0; }
    unsigned clocks = 0, starts = 0, stops = 0, moves = 0;

  private:
    int camera_;
    bool scl_ = true, sda_ = true;
};

struct Bench : hdl::BusBench {
    hdl::I2cSensor left, right;
    BranchWatch watch_left{0}, watch_right{1};

    Bench()
        : BusBench(synthetic::test_seed(), hdl::branch_timing(400)),
          left(bridge, 0, 300 * kNs),
          right(bridge, 1, 300 * kNs) {
        bridge.add(watch_left);
        bridge.add(watch_right);
        bridge.run_idle(130 * kUs);
        for (const uint8_t index : {kTimeouts, kProtocolErrors, kBranchErrors, kSpikes}) {
            write(index, 0);
        }
        write(kIrqStatus, 0xFF);
        clear();
    }
    hdl::I2cSensor &sensor(int camera) { return camera == 0 ? left : right; }
    BranchWatch &watch(int camera) { return camera == 0 ? watch_left : watch_right; }
    void clear() {
        watch_left.clear();
        watch_right.clear();
    }
    // Many times the counter's maximum.
    template <typename Error>
    void ends_at_255(uint8_t index, Error error) {
        for (unsigned i = 0; i < 5; i++) {
            error();
        }
        CHECK(read(index) == 5);
        CHECK((read(kIrqStatus) & kI2cError) != 0);
        for (unsigned i = 0; i < 300; i++) {
            error();
        }
        CHECK(read(index) == 255);
        write(index, 0x1234);
        CHECK(read(index) == 0);
        error();
        CHECK(read(index) == 1);
    }
};

}  // namespace

TEST_CASE("clear of a branch: START, nine clocks and STOP there, and nothing on the other one") {
    Bench bench;
    for (const unsigned branches : {1u, 2u, 3u}) {
        CAPTURE(branches);
        // Writing the register itself must change nothing there.
        bench.write(kBranchCtrl, 0);
        bench.clear();
        bench.write(kBusClear, branches);
        bench.bridge.run(20 * kUs);
        CHECK((bench.read(kDiag) & kClearBusy) != 0);
        bench.bridge.run_idle(130 * kUs);
        CHECK((bench.read(kDiag) & kClearBusy) == 0);
        for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
            CAPTURE(camera);
            const BranchWatch &watch = bench.watch(camera);
            if ((branches >> camera & 1u) == 0) {
                CHECK(watch.moves == 0);
                continue;
            }
            CHECK(watch.starts == 1);
            CHECK(watch.clocks == 10);
            CHECK(watch.stops == 1);
            CHECK(bench.sensor(camera).addressed == 0);
        }
        bench.write(kBranchCtrl, 1);
    }
}

TEST_CASE("a sensor that was left in the middle of a read lets its branch go") {
    for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
        CAPTURE(camera);
        Bench bench;
        const uint8_t address = camera == 0 ? kLeft : kRight;
        // Its zeros hold SDA at the reset.
        bench.master.start();
        REQUIRE(bench.master.write_byte(uint8_t(address << 1 | 1)));
        bench.master.bit(true);
        bench.master.bit(true);
        bench.bridge.reset();
        bench.master.let_go();
        CHECK(bench.bridge.out().branch_sda[camera] == 0);
        bench.bridge.run_idle(130 * kUs);
        CHECK(bench.bridge.out().branch_sda[camera] == 1);
        CHECK(bench.bridge.out().branch_scl[camera] == 1);
        CHECK(bench.master.write(address, {0x10, 0x12, 0x34}) == 4);
        CHECK(bench.sensor(camera).registers[0x10] == 0x1234);
    }
}

TEST_CASE("levels of the branches' lines") {
    Bench bench;
    for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
        for (const bool sda : {false, true}) {
            bench.write(kBranchCtrl, 0);
            bench.sensor(camera).hang(sda, !sda);
            const unsigned low = 1u << ((sda ? 4 : 2) + camera);
            CHECK((bench.read(kDiag) & 0x3C) == (0x3C & ~low));
            bench.sensor(camera).hang(false, false);
            CHECK((bench.read(kDiag) & 0x3C) == 0x3C);
        }
    }
}

TEST_CASE("without the router nothing moves on the branches") {
    Bench bench;
    bench.write(kBranchCtrl, 0);
    bench.clear();
    for (const uint8_t address : {kLeft, kRight, kOwn}) {
        CHECK(bench.master.write(address, {0x10, 0x12, 0x34}) == 0);
        CHECK(!bench.master.read(address, 2));
    }
    CHECK(bench.watch_left.moves == 0);
    CHECK(bench.watch_right.moves == 0);
    CHECK(bench.read(kBranchErrors) == 0);
}

TEST_CASE("bypass: one branch gets every address unchanged, the other one works normally") {
    for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
        CAPTURE(camera);
        Bench bench;
        bench.write(kBranchCtrl, unsigned(1 | (camera + 1) << 1));
        hdl::I2cSensor &joined = bench.sensor(camera), &other = bench.sensor(1 - camera);
        // The sensor's own address always means both branches.
        CHECK(bench.master.write(kOwn, {0x20, 0xBE, 0xEF}) == 4);
        CHECK(joined.registers[0x20] == 0xBEEF);
        CHECK(other.registers[0x20] == 0xBEEF);
        const uint64_t seen = joined.addressed;
        for (const uint8_t address : {uint8_t(0x1D), uint8_t(0x5F), uint8_t(0x7D)}) {
            bench.clear();
            CHECK(bench.master.write(address, {0x20, 0, 0}) == 0);
            CHECK(bench.watch(camera).clocks >= 9);
        }
        CHECK(joined.addressed == seen);
        // Another device on the bypassed branch, simulated by the bench: it answers to 0x1D.
        bench.bridge.remove(joined);
        bench.master.start();
        for (int bit = 7; bit >= 0; bit--) {
            bench.master.bit((0x1D << 1 >> bit & 1) != 0);
        }
        bench.bridge.in.branch_sda[camera] = 0;
        bench.bridge.drive();
        CHECK(!bench.master.bit(true));
        bench.bridge.in.branch_sda[camera] = 1;
        bench.bridge.drive();
        bench.master.stop();
    }
}

TEST_CASE("a sensor that holds SCL is not waited for, but counted") {
    Bench bench;
    bench.left.stretch_ps = 30 * kUs;
    (void)bench.master.write(kLeft, {0x10, 0x12, 0x34});
    bench.left.stretch_ps = 0;
    bench.bridge.run_idle(40 * kMs);
    // At each clock that the sensor missed, and once for the missing acknowledge.
    CHECK(bench.read(kBranchErrors) >= 8);
    CHECK((bench.read(kIrqStatus) & kI2cError) != 0);
    CHECK(bench.master.write(kLeft, {0x10, 0x12, 0x34}) == 4);
    CHECK(bench.left.registers[0x10] == 0x1234);
}

TEST_CASE("a sensor that holds SDA under a byte is answered for: not acknowledged, and counted") {
    for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
        CAPTURE(camera);
        Bench bench;
        const uint8_t address = camera == 0 ? kLeft : kRight;
        bench.master.start();
        REQUIRE(bench.master.write_byte(uint8_t(address << 1)));
        REQUIRE(bench.master.write_byte(0x10));
        bench.sensor(camera).hang(true, false);
        bool free = true;
        for (int bit = 0; bit < 8; bit++) {
            free = bench.master.bit(true) && free;
        }
        // The DSP's own bits are unchanged, and the low level is not an acknowledge.
        CHECK(free);
        CHECK(bench.master.bit(true));
        bench.sensor(camera).hang(false, false);
        bench.master.stop();
        CHECK(bench.read(kBranchErrors) == 1);
        bench.write(kBusClear, 1u << camera);
        bench.bridge.run_idle(130 * kUs);
        CHECK(bench.master.write(address, {0x10, 0x12, 0x34}) == 4);
        CHECK(bench.sensor(camera).registers[0x10] == 0x1234);
    }
}

TEST_CASE("spikes on the branches change nothing and are not counted") {
    Bench bench;
    bench.write(kBranchCtrl, 0);
    for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
        for (uint8_t *line :
             {&bench.bridge.in.branch_scl[camera], &bench.bridge.in.branch_sda[camera]}) {
            *line = 0;
            bench.bridge.drive();
            bench.bridge.run(60 * kNs);
            *line = 1;
            bench.bridge.drive();
            bench.bridge.run(kUs);
        }
    }
    CHECK(bench.read(kSpikes) == 0);
    CHECK(bench.read(kBranchErrors) == 0);
}

TEST_CASE("errors are counted up to 255, and any write restarts the count") {
    Bench bench;
    SUBCASE("on a branch: a byte that is not acknowledged") {
        bench.bridge.remove(bench.right);
        bench.ends_at_255(kBranchErrors, [&] { CHECK(bench.master.write(kRight, {}) == 0); });
    }
    SUBCASE("of the protocol: STOP inside a byte") {
        bench.ends_at_255(kProtocolErrors, [&] {
            bench.master.start();
            bench.master.write_byte(hdl::Registers::kAddress << 1);
            bench.master.bit(true);
            bench.master.stop();
        });
    }
    SUBCASE("time-outs: the bus stops for 35 ms in a transfer") {
        for (unsigned i = 0; i < 3; i++) {
            bench.master.start();
            bench.master.write_byte(hdl::Registers::kAddress << 1);
            bench.bridge.run_idle(40 * kMs);
            bench.master.stop();
            CHECK(bench.read(kTimeouts) == i + 1);
        }
        CHECK((bench.read(kIrqStatus) & kI2cError) != 0);
        bench.write(kTimeouts, 0);
        CHECK(bench.read(kTimeouts) == 0);
    }
}

TEST_CASE("spikes are counted up to 255, on each line of the bus") {
    Bench bench;
    for (uint8_t *noise : {&bench.bridge.in.scl_noise, &bench.bridge.in.sda_noise}) {
        const auto spikes = [&](unsigned count) {
            for (unsigned i = 0; i < count; i++) {
                *noise = 1;
                bench.bridge.drive();
                bench.bridge.run(45 * kNs);
                *noise = 0;
                bench.bridge.drive();
                bench.bridge.run(kUs);
            }
        };
        spikes(7);
        CHECK(bench.read(kSpikes) == 7);
        spikes(300);
        CHECK(bench.read(kSpikes) == 255);
        bench.write(kSpikes, 0);
        CHECK(bench.read(kSpikes) == 0);
    }
    CHECK(bench.read(kProtocolErrors) == 0);
}
