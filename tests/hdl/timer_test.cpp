// SPDX-License-Identifier: Apache-2.0
// Timed behaviour: trigger pulses, and each action of the watchdog; and the lines that only follow
// a register.
#include <doctest/doctest.h>

#include <algorithm>
#include <string>

#include "bench/bus_bench.hpp"
#include "bench/servo_checker.hpp"

namespace {

using hdl::kMs;
using hdl::kUs;

constexpr uint8_t kUnlock = 0x0D, kPeriod = 0x07, kCtrl = 0x08, kStatus = 0x09, kIrqStatus = 0x0A;
constexpr uint8_t kIrqEnable = 0x0B, kIrqTest = 0x0C, kWatchdogMs = 0x0E, kWatchdog = 0x0F;
constexpr uint8_t kTarget = 0x10, kSafe = 0x14, kSlew = 0x15, kFrames = 0x16, kServo1 = 8;
constexpr uint8_t kTrigger = 0x40, kDelay = 0x41, kWidth = 0x42, kSensor = 0x48;
constexpr uint16_t kBusy = 0x0100, kFired = 0x0100, kIrqWatchdog = 0x10, kTriggerDone = 0x80;
enum Action { kHold, kToSafe, kOff };

// Moments of the trigger lines' edges, and of the interrupt line's.
class Edges : public hdl::Listener {
  public:
    uint32_t wanted() const override { return BRIDGE_EVENT_SENSOR | BRIDGE_EVENT_IRQ; }
    void on_event(uint64_t time_ps, uint32_t, const bridge_outputs &now) override {
        for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
            if ((now.trigger[camera] != 0) != high_[camera]) {
                high_[camera] = !high_[camera];
                trigger[camera].push_back(time_ps);
            }
        }
        if ((now.irq != 0) != irq_) {
            irq_ = !irq_;
            irq.push_back(time_ps);
        }
    }
    std::vector<uint64_t> trigger[BRIDGE_CAMERAS], irq;

  private:
    bool high_[BRIDGE_CAMERAS] = {}, irq_ = false;
};

struct Bench : hdl::BusBench {
    Edges edges;

    Bench() { bridge.add(edges); }
    size_t pulses(int servo) { return bridge.servos().pulses(servo).size(); }
};

}  // namespace

TEST_CASE("trigger: delay and width to the microsecond, on the lines that were asked for") {
    const uint64_t seed = synthetic::test_seed();
    INFO("seed " << seed);
    hdl::Random random(seed);
    for (unsigned i = 0; i < 12; i++) {
        const unsigned lines = 1 + i % 3;
        const unsigned delay_us = i == 0 ? 0 : i == 1 ? 65535 : random.below(3000);
        const unsigned width_us = i == 0 ? 1 : i == 2 ? 65535 : 1 + random.below(3000);
        INFO("lines " << lines << " delay " << delay_us << " width " << width_us);
        Bench bench;
        bench.write(kDelay, delay_us);
        bench.write(kWidth, width_us);
        bench.write(kIrqEnable, kTriggerDone);
        const uint64_t begin = bench.bridge.now();
        bench.write(kTrigger, lines);
        if (delay_us + width_us > 100) {
            CHECK((bench.read(kTrigger) & kBusy) != 0);
            // Not while it is busy.
            bench.write(kTrigger, 3);
            bench.write(kWidth, 7);
            bench.write(kWidth, width_us);
        }
        bench.bridge.run_idle((delay_us + width_us + 10) * kUs);
        for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
            const auto &edges = bench.edges.trigger[camera];
            if ((lines >> camera & 1u) == 0) {
                CHECK(edges.empty());
                continue;
            }
            REQUIRE(edges.size() == 2);
            CHECK(edges == bench.edges.trigger[lines == 2 ? 1 : 0]);
            // The width is exact except for the two clocks at the end, which idle time stretches.
            CHECK(std::abs(int64_t(edges[1] - edges[0]) - int64_t(width_us * kUs)) <=
                  int64_t(3 * kUs));
            // The write's 36 bits, up to its acknowledge, take 36 us; the first tick adds up to
            // one.
            const auto delay = int64_t(edges[0] - begin) - int64_t(delay_us * kUs);
            CHECK(delay > int64_t(35 * kUs));
            CHECK(delay < int64_t(38 * kUs));
        }
        CHECK((bench.read(kTrigger) & kBusy) == 0);
        CHECK(bench.read(kIrqStatus) == kTriggerDone);
        REQUIRE(bench.edges.irq.size() == 1);
    }
}

TEST_CASE("watchdog: each action, and the servos obey again when its mark is cleared") {
    for (const unsigned action : {kHold, kToSafe, kOff}) {
        CAPTURE(action);
        Bench bench;
        bench.write(kWatchdogMs, 100);
        bench.write(kWatchdog, action);
        bench.write(kIrqEnable, kIrqWatchdog);
        for (const uint8_t servo : {uint8_t(0), kServo1}) {
            bench.write(uint8_t(kSafe + servo), 1000 * 16);
            bench.write(uint8_t(kSlew + servo), 100 * 16);
        }
        bench.write(kCtrl, 3);
        bench.bridge.run_idle(60 * kMs);
        // Moving when it fires, three frames later: 1500 us plus 100 in each frame.
        bench.write(kTarget, 2000 * 16);
        const uint64_t kicked = bench.bridge.now();
        bench.bridge.run_idle(95 * kMs);
        CHECK((bench.read(kStatus) & 4) == 0);
        CHECK(bench.edges.irq.empty());
        bench.bridge.run_idle(10 * kMs);
        CHECK((bench.read(kStatus) & 4) != 0);
        CHECK(bench.read(kWatchdog) == (kFired | action));
        CHECK((bench.read(kIrqStatus) & kIrqWatchdog) != 0);
        REQUIRE(bench.edges.irq.size() == 1);
        CHECK(bench.edges.irq[0] > kicked + 100 * kMs - 2 * kUs);
        CHECK(bench.edges.irq[0] < kicked + 101 * kMs + 5 * kUs);
        const size_t pulses[] = {bench.pulses(0), bench.pulses(1)};
        const uint16_t actual = bench.read(0x11);
        CHECK(actual >= 1900 * 16);
        // Writes have no effect once it has fired, nor does reading.
        bench.write(kTarget, 1300 * 16);
        bench.bridge.run_idle(300 * kMs);
        for (int servo = 0; servo < BRIDGE_SERVOS; servo++) {
            const size_t more = bench.pulses(servo) - pulses[servo];
            if (action == kOff) {
                CHECK(more <= 1);
            } else {
                CHECK(more >= 14);
                const uint64_t safe = 1000 * kUs;
                const uint64_t held = servo == 0 ? actual / 16 * kUs : 1500 * kUs;
                CHECK(bench.bridge.servos().pulses(servo).back().width_ps() ==
                      (action == kToSafe ? safe : held));
            }
        }
        CHECK((bench.read(kStatus) & 3) == (action == kOff ? 0 : 3));
        bench.write(kIrqStatus, kIrqWatchdog);
        bench.write(kWatchdog, kFired | action);
        CHECK(bench.read(kWatchdog) == action);
        bench.write(kWatchdogMs, 1000);
        bench.bridge.run_idle(300 * kMs);
        CHECK(bench.bridge.servos().pulses(0).back().width_ps() == 1300 * kUs);
        CHECK((bench.read(kStatus) & 7) == 3);
        CHECK(bench.edges.irq.size() == 2);
        CHECK(bench.bridge.servos().faults().empty());
    }
}

TEST_CASE(
    "watchdog: never without a servo, nor when it is off, and a write of any register helps") {
    Bench bench;
    bench.write(kWatchdogMs, 1);
    bench.bridge.run_idle(20 * kMs);
    CHECK((bench.read(kIrqStatus) & kIrqWatchdog) == 0);
    bench.write(kWatchdogMs, 50);
    bench.write(kCtrl, 2);
    for (int i = 0; i < 5; i++) {
        bench.bridge.run_idle(45 * kMs);
        bench.write(0x04, unsigned(i));
    }
    CHECK(!bench.registers.write(kWatchdogMs, 0));
    bench.write(kUnlock, 0x4C4B);
    bench.write(kWatchdogMs, 0);
    bench.bridge.run_idle(500 * kMs);
    CHECK((bench.read(kIrqStatus) & kIrqWatchdog) == 0);
    bench.write(kWatchdogMs, 0xFFFF);
    bench.bridge.run_idle(200 * kMs);
    CHECK((bench.read(kIrqStatus) & kIrqWatchdog) == 0);
    bench.write(kWatchdogMs, 1);
    bench.bridge.run_idle(3 * kMs);
    CHECK((bench.read(kIrqStatus) & kIrqWatchdog) != 0);
}

TEST_CASE("servo frames of another length; pulses are counted modulo 256") {
    Bench bench;
    bench.write(kWatchdogMs, 60000);
    CHECK(!bench.registers.write(kPeriod, 15000));
    bench.write(kUnlock, 0x4C4B);
    for (const unsigned period_us : {25000u, 21847u, 15000u}) {
        CAPTURE(period_us);
        bench.write(kPeriod, period_us);
        bench.write(kCtrl, 3);
        const unsigned frames = period_us == 15000 ? 260 : 8;
        bench.bridge.run_idle(frames * period_us * kUs);
        const auto &pulses = bench.bridge.servos().pulses(1);
        REQUIRE(pulses.size() >= 3);
        CHECK(pulses.back().rise_ps - pulses[pulses.size() - 2].rise_ps == period_us * kUs);
        CHECK(bench.read(kFrames) == (bench.pulses(0) & 0xFFu));
        CHECK(bench.read(kFrames + kServo1) == (bench.pulses(1) & 0xFFu));
    }
    CHECK(bench.pulses(0) > 256);
    CHECK(bench.bridge.servos().faults().empty());
}

TEST_CASE("lines to the sensors follow their register, and interrupts can be tried") {
    Bench bench;
    for (unsigned value = 0; value < 256; value += value < 16 ? 1 : 15) {
        CAPTURE(value);
        bench.write(kSensor, value);
        const bridge_outputs &out = bench.bridge.out();
        unsigned is = 0;
        for (unsigned camera = 0; camera < BRIDGE_CAMERAS; camera++) {
            is |= unsigned(out.sensor_reset_n[camera]) << camera;
            is |= unsigned(out.sensor_standby[camera]) << (2 + camera);
            is |= unsigned(out.sensor_oe[camera]) << (4 + camera);
            is |= unsigned(out.sensor_extclk_enable[camera]) << (6 + camera);
        }
        CHECK(is == value);
    }
    bench.write(kSensor, 0);
    for (unsigned bit = 0; bit < 8; bit++) {
        CAPTURE(bit);
        bench.write(kIrqEnable, ~(1u << bit) & 0xFFu);
        bench.write(kIrqTest, 1u << bit);
        CHECK(bench.read(kIrqStatus) == 1u << bit);
        CHECK(bench.bridge.out().irq == 0);
        CHECK((bench.read(kStatus) & 0x40) == 0);
        bench.write(kIrqEnable, 1u << bit);
        CHECK(bench.bridge.out().irq == 1);
        CHECK((bench.read(kStatus) & 0x40) != 0);
        bench.write(kIrqStatus, ~(1u << bit) & 0xFFu);
        CHECK(bench.bridge.out().irq == 1);
        bench.write(kIrqStatus, 1u << bit);
        CHECK(bench.bridge.out().irq == 0);
        CHECK(bench.read(kIrqStatus) == 0);
    }
}
