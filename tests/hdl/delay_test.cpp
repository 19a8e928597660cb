// SPDX-License-Identifier: Apache-2.0
// The simulated synchronisers randomly take an extra clock, as real ones do: otherwise the other
// tests would never see an inconsistent word cross.
#include <doctest/doctest.h>

#include <map>

#include "bench/i2c_master.hpp"
#include "bench/pixel_source.hpp"

namespace {

// A camera clock with a constant phase to the bridge's: only chance can change the result.
constexpr uint64_t kPeriodPs = BRIDGE_CONTROL_PERIOD_PS;

class FrameInterrupts : public hdl::Listener {
  public:
    uint32_t wanted() const override { return BRIDGE_EVENT_IRQ; }
    void on_event(uint64_t time_ps, uint32_t, const bridge_outputs &now) override {
        if (now.irq != 0) {
            rises.push_back(time_ps);
        }
    }
    std::vector<uint64_t> rises;
};

}  // namespace

TEST_CASE("a frame's start crosses in so many clocks or in one more, both often") {
    const uint64_t seed = synthetic::test_seed();
    INFO("seed " << seed);
    hdl::Bridge bridge(seed);
    hdl::I2cMaster master(bridge, hdl::standard_timing(1000));
    hdl::Registers registers(master);
    const hdl::Window window;
    hdl::PixelSource left(bridge, 0, window);
    hdl::PpiReceiver ppi(bridge);
    FrameInterrupts interrupts;
    bridge.add(interrupts);
    REQUIRE(registers.write(0x48, 0x00F3));
    REQUIRE(registers.write(0x23, 0x0030));
    REQUIRE(registers.write(0x0B, 0x0001));
    REQUIRE(registers.write(0x08, 0x0100));
    left.set_period(kPeriodPs);
    std::map<uint64_t, int> latencies;
    for (int i = 0; i < 64; i++) {
        REQUIRE(registers.write(0x0A, 0xFFFF));
        interrupts.rises.clear();
        for (int wait = 0; wait < 3 && interrupts.rises.empty(); wait++) {
            bridge.run(window.frame_clocks() * kPeriodPs);
        }
        REQUIRE(interrupts.rises.size() == 1);
        REQUIRE(!ppi.frames.empty());
        // The frame that started here is the last one that had begun by then.
        uint64_t begin_ps = 0;
        for (const hdl::Received &frame : ppi.frames) {
            begin_ps = frame.begin_ps < interrupts.rises[0] ? frame.begin_ps : begin_ps;
        }
        latencies[(interrupts.rises[0] - begin_ps) / kPeriodPs]++;
    }
    REQUIRE(latencies.size() == 2);
    const auto few = *latencies.begin(), many = *latencies.rbegin();
    CHECK(many.first == few.first + 1);
    CHECK(few.second >= 8);
    CHECK(many.second >= 8);
}
