// SPDX-License-Identifier: Apache-2.0
// Camera switches at random times with drifting, stopped and returning pixel clocks: every frame
// received by the DSP equals a frame sent, and its clock never has a short phase.
#include <doctest/doctest.h>

#include <string>

#include "bench/bus_bench.hpp"
#include "bench/pixel_source.hpp"
#include "bench/servo_checker.hpp"

namespace {

using hdl::kMs;
using hdl::kUs;

constexpr uint32_t kPeriodPs = 20833;
constexpr uint16_t kStream = 0x0100;

struct Bench : hdl::BusBench {
    hdl::Window window;
    hdl::PixelSource left, right;
    hdl::PpiReceiver ppi;
    hdl::Random random;
    size_t checked = 0;
    uint64_t torn = 0, of_camera[2] = {};

    explicit Bench(uint64_t seed)
        : BusBench(seed),
          left(bridge, 0, window),
          right(bridge, 1, window),
          ppi(bridge),
          random(seed) {
        left.set_period(drifting());
        right.set_period(drifting());
        // Sensors on; the sensor launches at the rise, so the bridge samples at the fall.
        REQUIRE(registers.write(0x48, 0x00F3));
        REQUIRE(registers.write(0x23, 0x0030));
        REQUIRE(registers.write(0x08, kStream));
    }

    // Within 1 % of 48 MHz.
    uint32_t drifting() { return uint32_t(random.between(kPeriodPs - 208, kPeriodPs + 208)); }
    hdl::PixelSource &source(int camera) { return camera == 0 ? left : right; }
    uint64_t frame_ps() const { return window.frame_clocks() * kPeriodPs; }

    bool select(int camera) { return registers.write(0x20, uint16_t(camera)); }
    // Waits for the bridge's confirmation; returns how long it took.
    uint64_t wait_switched(int camera, uint64_t longest_ps) {
        const uint64_t begin = bridge.now();
        while (bridge.now() - begin < longest_ps) {
            const uint16_t state = registers.read(0x21).value_or(0xFFFF);
            if ((state & 0x33) == unsigned(0x10 | camera)) {
                break;
            }
            bridge.run(5 * kUs);
        }
        return bridge.now() - begin;
    }
    // Checks what arrived since the last call. One frame in the middle of a forced switch may be
    // cut.
    void check(uint64_t allowed_torn) {
        uint64_t wrong = 0;
        std::string first;
        while (checked < ppi.frames.size() && ppi.frames[checked].end_ps != 0) {
            int camera = -1;
            uint32_t number = 0;
            const std::string fault =
                hdl::check_frame(ppi.frames[checked++], window, camera, number);
            if (!fault.empty()) {
                wrong++;
                first = first.empty() ? fault : first;
            } else {
                of_camera[camera]++;
            }
        }
        // Frames have been checked; unfinished ones stay.
        ppi.frames.erase(ppi.frames.begin(), ppi.frames.begin() + long(checked));
        checked = 0;
        if (wrong > allowed_torn) {
            torn += wrong - allowed_torn;
            FAIL_CHECK("at " << bridge.now() / kUs << " us: " << wrong << " frames: " << first);
        }
    }
};

}  // namespace

TEST_CASE("random switches with drifting and stopped clocks: no torn frame, no short clock") {
    const uint64_t seed = synthetic::test_seed(), switches = hdl::draws(1000);
    INFO("seed " << seed);
    Bench bench(seed);
    int camera = 0;
    uint64_t forced = 0, slowest_ps = 0;
    bench.bridge.run(3 * bench.frame_ps());
    bench.check(0);
    for (uint64_t i = 0; i < switches && bench.torn == 0; i++) {
        const bool stopped = bench.random.chance(0.03);
        if (stopped) {
            // The active camera stops at any point.
            bench.source(camera).set_period(0);
            bench.bridge.run(bench.random.between(1 * kUs, 300 * kUs));
            forced++;
        }
        const int other = 1 - camera;
        bench.source(other).set_period(bench.drifting());
        REQUIRE(bench.select(other));
        if (!stopped && bench.random.chance(0.2)) {
            // Another request before the first one was done.
            bench.bridge.run(bench.random.between(0, 30 * kUs));
            REQUIRE(bench.select(camera));
            bench.bridge.run(bench.random.between(0, 30 * kUs));
            REQUIRE(bench.select(other));
        }
        const uint64_t took_ps = bench.wait_switched(other, 120 * kMs);
        slowest_ps = std::max(slowest_ps, took_ps);
        CHECK(took_ps < 100 * kMs);
        camera = other;
        bench.bridge.run(bench.random.between(0, 2 * bench.frame_ps()));
        bench.check(stopped ? 1 : 0);
        if (stopped) {
            bench.source(1 - camera).set_period(bench.drifting());
        }
    }
    // Half a period of the fastest clock, minus the rounding to whole picoseconds.
    const uint64_t half_ps = (kPeriodPs - 208) / 2 - 1;
    CHECK(bench.ppi.shortest_high_ps >= half_ps);
    CHECK(bench.ppi.shortest_low_ps >= half_ps);
    CHECK(bench.ppi.broken == 0);
    CHECK(bench.of_camera[0] > 0);
    CHECK(bench.of_camera[1] > 0);
    CHECK(bench.bridge.servos().faults().empty());
    MESSAGE(switches << " switches (" << forced << " with a dead camera), " << bench.of_camera[0]
                     << " + " << bench.of_camera[1] << " whole frames, slowest switch "
                     << slowest_ps / kUs << " us");
}
