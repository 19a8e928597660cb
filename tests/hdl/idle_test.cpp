// SPDX-License-Identifier: Apache-2.0
// One script twice: with 25 clocks per microsecond throughout, and with one while nothing changes
// on a bus or a camera. Every register, frame and servo edge is the same.
#include <doctest/doctest.h>

#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "bench/i2c_master.hpp"
#include "bench/pixel_source.hpp"
#include "bench/random.hpp"
#include "bench/register_map.hpp"
#include "bench/servo_checker.hpp"
#include "bench/twins.hpp"

namespace {

using hdl::kMs;
using hdl::kUs;

struct Record {
    std::vector<std::map<uint8_t, uint16_t>> registers;
    std::vector<hdl::Pulse> pulses[BRIDGE_SERVOS];
    std::vector<uint64_t> irq_ps;
    std::vector<hdl::Pulse> pauses;

    // Whether a pulse lies within one pause, in which an idle clock runs all the time.
    bool is_idle(const hdl::Pulse &pulse) const {
        for (const hdl::Pulse &pause : pauses) {
            if (pulse.rise_ps > pause.rise_ps + 2 * kUs && pulse.fall_ps < pause.fall_ps) {
                return true;
            }
        }
        return false;
    }
    std::vector<std::vector<std::vector<uint16_t>>> frames;
};

class IrqEdges : public hdl::Listener {
  public:
    uint32_t wanted() const override { return BRIDGE_EVENT_IRQ; }
    void on_event(uint64_t time_ps, uint32_t, const bridge_outputs &) override {
        edges.push_back(time_ps);
    }
    std::vector<uint64_t> edges;
};

class Script {
  public:
    Script(uint64_t seed, bool idle)
        : bridge_(seed),
          idle_(idle),
          master_(bridge_, hdl::standard_timing(400)),
          registers_(master_),
          left_(bridge_, 0, {}),
          ppi_(bridge_) {
        bridge_.add(irq_);
    }

    Record run() {
        write(0x0B, 0x00FF);
        write(0x0E, 60);      // watchdog
        write(0x0F, 0x0001);  // move to the safe position
        write(0x10, 1700 * 16 + 5);
        write(0x18, 1203 * 16 + 11);
        write(0x1D, 40 * 16 + 3);
        write(0x08, 0x0003);
        pause(50);
        write(0x10, 1000 * 16);
        pause(42);
        write(0x15, 100 * 16);
        picture();
        pause(33);
        write(0x41, 777);
        write(0x42, 1500);
        write(0x40, 3);
        pause(4);
        write(0x0B, 0x00F0);
        pause(110);  // the watchdog fires
        write(0x0F, 0x0101);
        write(0x0A, 0x00FF);
        pause(21);
        write(0x08, 0x0000);
        pause(25);
        record_.irq_ps = irq_.edges;
        for (int servo = 0; servo < BRIDGE_SERVOS; servo++) {
            record_.pulses[servo] = bridge_.servos().pulses(servo);
        }
        for (const hdl::Received &frame : ppi_.frames) {
            record_.frames.push_back(frame.lines);
        }
        CHECK(bridge_.servos().faults().empty());
        return record_;
    }

  private:
    void write(uint8_t index, uint16_t value) { REQUIRE(registers_.write(index, value)); }

    // To the next whole millisecond from now, plus a little: an idle clock is then high.
    void pause(uint64_t duration_ms) {
        const uint64_t begin = bridge_.now();
        const uint64_t end = (bridge_.now() / kMs + duration_ms) * kMs + 100 * hdl::kNs;
        if (idle_) {
            bridge_.run_idle(end - bridge_.now());
        } else {
            bridge_.run(end - bridge_.now());
        }
        REQUIRE(bridge_.now() == end);
        record_.pauses.push_back({begin, end});
        std::map<uint8_t, uint16_t> all;
        for (uint8_t index : hdl::register_indices()) {
            all[index] = registers_.read(index).value_or(0xDEAD);
        }
        record_.registers.push_back(all);
    }

    void picture() {
        write(0x48, 0x00F3);
        write(0x23, 0x0030);
        write(0x08, 0x0103);
        left_.set_period(20800);
        bridge_.run(3 * left_.window().frame_clocks() * 20800);
        write(0x08, 0x0003);
        left_.set_period(0);
    }

    hdl::Bridge bridge_;
    bool idle_;
    hdl::I2cMaster master_;
    hdl::Registers registers_;
    hdl::PixelSource left_;
    hdl::PpiReceiver ppi_;
    IrqEdges irq_;
    Record record_;
};

class Twins : public hdl::TwoBridges {
  public:
    explicit Twins(uint64_t seed) : TwoBridges(seed), random_(seed) {
        write(0x0B, 0x00FF);
        write(0x48, 0x00F3);
        write(0x0D, 0x4C4B);
        write(0x08, 0x0003);
    }

    void live() {
        const unsigned what = random_.below(12);
        const auto number = [this](unsigned end) { return uint16_t(random_.below(end)); };
        if (what < 2) {  // a servo's place
            write(uint8_t(0x10 + 8 * what), uint16_t(900 * 16 + random_.below(1200 * 16)));
        } else if (what == 2) {  // a frame's length
            write(0x07, uint16_t(15000 + random_.below(10001)));
        } else if (what == 3) {  // the watchdog's
            write(0x0E, uint16_t(20 + random_.below(200)));
        } else if (what == 4) {
            write(0x04, number(65535));  // feeds it
        } else if (what == 5) {
            write(0x0A, 0x00FF);
        } else if (what == 6) {
            write(0x08, uint16_t(number(4) | number(2) << 8));
        } else if (what == 7) {  // trigger
            write(0x41, number(2000));
            write(0x42, uint16_t(1 + random_.below(3000)));
            write(0x40, number(4));
        } else if (what == 8) {
            write(0x20, number(3));
        }
        // A clock may run slowly while the bridge idles, or stop meanwhile.
        const int camera = int(random_.below(2));
        const uint32_t period_ps = random_.below(3) == 0 ? 0 : 20800 + 4 * random_.below(4000000);
        const unsigned kind = random_.below(4);
        const uint64_t idle_ps = kind == 0   ? random_.below(40) * kUs + random_.below(1000000)
                                 : kind == 1 ? random_.below(2000) * kUs
                                             : random_.below(60) * kMs + random_.below(1000) * kUs;
        const bool clocks = random_.below(2) == 0;
        for (hdl::Twin &twin : twins) {
            twin.bridge.set_clock(camera, clocks ? period_ps : 0);
            twin.bridge.run_idle(idle_ps);
        }
    }

    void pass(uint64_t duration_ps) {
        for (hdl::Twin &twin : twins) {
            twin.bridge.run_idle(duration_ps);
        }
    }

  private:
    hdl::Random random_;
};

// A bridge whose running cameras either make 16 clock edges every 140 us of a pause, or rest in it.
class Shown {
  public:
    Shown(uint64_t seed, bool rests) : twin_(seed), rests_(rests) { twin_.bridge.add(irq_); }

    void write(uint8_t index, uint16_t value) { REQUIRE(twin_.registers.write(index, value)); }
    void pause(unsigned alive, uint64_t duration_ps) {
        bridge_model *model = twin_.bridge.model();
        const uint64_t end = twin_.bridge.now() + duration_ps, idle_end = end - 30 * kUs;
        bridge_model_set_idle(model, 1);
        if (rests_) {
            do {
                REQUIRE(twin_.bridge.now() < end - duration_ps + 300 * kUs);
                show(alive);
                twin_.bridge.run(10 * kUs);
            } while (bridge_model_may_rest(model, alive) == 0);
            bridge_model_set_resting(model, 1);
            twin_.bridge.run(idle_end - 90 * kUs - twin_.bridge.now());
            bridge_model_set_resting(model, 0);
        }
        while (twin_.bridge.now() < idle_end) {
            show(alive);
            twin_.bridge.run(std::min(idle_end - twin_.bridge.now(), 139 * kUs));
        }
        // Two simultaneous changes of the divided clock would look like none.
        twin_.bridge.run(10 * kUs);
        show(alive);
        bridge_model_set_idle(model, 0);
        twin_.bridge.run(end - twin_.bridge.now());
    }
    // The cameras that the bridge has lost, as a sum of 1 << camera.
    unsigned lost() { return unsigned(twin_.registers.read(0x09).value_or(0)) >> 3 & 3u; }
    // Except the frequencies, which are counted from the simulated edges.
    std::map<uint8_t, uint16_t> registers() {
        std::map<uint8_t, uint16_t> all;
        for (uint8_t index : hdl::register_indices()) {
            if (index != 0x34 && index != 0x3C) {
                all[index] = twin_.registers.read(index).value_or(0xDEAD);
            }
        }
        return all;
    }
    const std::vector<hdl::Pulse> &pulses(int servo) { return twin_.bridge.servos().pulses(servo); }
    const std::vector<uint64_t> &irq_ps() const { return irq_.edges; }

  private:
    void show(unsigned alive) {
        constexpr uint32_t kPeriodPs = 20800;
        for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
            if ((alive >> camera & 1u) != 0) {
                twin_.bridge.set_clock(camera, kPeriodPs);
                twin_.bridge.run(16 * kPeriodPs + kPeriodPs / 4);
                twin_.bridge.set_clock(camera, 0);
            }
        }
    }

    hdl::Twin twin_;
    bool rests_;
    IrqEdges irq_;
};

}  // namespace

TEST_CASE("after a rest the bridge knows what it would know without") {
    const uint64_t seed = synthetic::test_seed();
    hdl::Random random(seed);
    Shown plain(seed, false), rested(seed, true);
    for (Shown *each : {&plain, &rested}) {
        each->write(0x0B, 0x00FF);
        each->write(0x48, 0x00F3);
        each->write(0x0E, 40);  // the watchdog fires in some pauses
        each->write(0x08, 0x0003);
    }
    for (uint64_t i = 0; i < hdl::draws(40); i++) {
        CAPTURE(i);
        const auto alive = unsigned(random.below(4));
        const uint64_t duration_ps = 2 * kMs + random.below(60) * kMs + random.below(1000) * kUs;
        const auto place_q4 = uint16_t(900 * 16 + random.below(1200 * 16));
        for (Shown *each : {&plain, &rested}) {
            each->write(0x0A, 0x00FF);
            each->write(0x0F, 0x0101);
            each->write(uint8_t(0x10 + 8 * (i % 2)), place_q4);
            each->pause(alive, duration_ps);
        }
        for (Shown *each : {&plain, &rested}) {
            CHECK(each->lost() == (~alive & 3u));
        }
        CHECK(plain.registers() == rested.registers());
    }
    CHECK(plain.irq_ps() == rested.irq_ps());
    CHECK(plain.irq_ps().size() > 2);
    for (int servo = 0; servo < BRIDGE_SERVOS; servo++) {
        REQUIRE(plain.pulses(servo).size() > 10);
        REQUIRE(plain.pulses(servo).size() == rested.pulses(servo).size());
        for (size_t i = 0; i < plain.pulses(servo).size(); i++) {
            CHECK(plain.pulses(servo)[i].rise_ps == rested.pulses(servo)[i].rise_ps);
            CHECK(plain.pulses(servo)[i].fall_ps == rested.pulses(servo)[i].fall_ps);
        }
    }
}

TEST_CASE("what idle clocks only count is added, with no other outcome") {
    const uint64_t seed = synthetic::test_seed();
    Twins twins(seed);
    const uint64_t lives = hdl::draws(120);
    for (uint64_t i = 0; i < lives; i++) {
        CAPTURE(i);
        twins.live();
        REQUIRE(twins.same());
    }
}

TEST_CASE("rate_meter gives up a camera without frames at the same microsecond") {
    Twins twins(synthetic::test_seed());
    // Both clocks, 32 ms each, and a wait of 655 ms.
    for (int i = 0; i < 40; i++) {
        CAPTURE(i);
        twins.pass(20 * kMs + uint64_t(i) * 7 * kUs);
        REQUIRE(twins.same());
    }
}

TEST_CASE("idle time changes nothing") {
    const uint64_t seed = synthetic::test_seed();
    const Record exact = Script(seed, false).run(), idle = Script(seed, true).run();
    REQUIRE(exact.registers.size() == idle.registers.size());
    for (size_t i = 0; i < exact.registers.size(); i++) {
        for (const auto &word : exact.registers[i]) {
            const uint8_t index = word.first;
            INFO("pause " << i << " register " << int(index));
            // A frame's start crosses from the camera's clock, which takes a clock more by chance.
            const bool crossed = index >= 0x44 && index <= 0x46;
            CHECK(std::abs(int(word.second) - int(idle.registers[i].at(index))) <=
                  (crossed ? 1 : 0));
        }
    }
    CHECK(exact.frames == idle.frames);
    CHECK(exact.frames.size() >= 2);
    CHECK(exact.irq_ps.size() == idle.irq_ps.size());
    for (int servo = 0; servo < BRIDGE_SERVOS; servo++) {
        const auto &all = exact.pulses[servo], &some = idle.pulses[servo];
        REQUIRE(all.size() == some.size());
        CHECK(all.size() > 10);
        for (size_t i = 0; i < all.size(); i++) {
            INFO("servo " << servo << " pulse " << i);
            // An edge within a microsecond comes at its end. Outputs follow the clock's edge by one
            // clock, which is 40 ns in one run and a microsecond in the other.
            const auto late = [](uint64_t exact_ps, uint64_t idle_ps) {
                return idle_ps >= exact_ps && idle_ps - exact_ps <= 2 * kUs;
            };
            CHECK(late(all[i].rise_ps, some[i].rise_ps));
            CHECK(late(all[i].fall_ps, some[i].fall_ps));
            if (idle.is_idle(some[i])) {
                CHECK(some[i].width_ps() == (all[i].width_ps() + kUs - 1) / kUs * kUs);
            }
        }
    }
}
