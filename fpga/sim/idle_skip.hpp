// SPDX-License-Identifier: Apache-2.0
// Idle clocks that only count. Most do: the core's next state equals its last one, except for the
// time, the phase of the servo frame and the places in the millisecond. The Verilog itself shows
// that a state is stable, by a clock that was evaluated; until the next value of these counters
// that anything is compared with, the same holds for the following clocks, so they can be added
// instead of evaluated.
#ifndef VERGENCE_FPGA_SIM_IDLE_SKIP_HPP
#define VERGENCE_FPGA_SIM_IDLE_SKIP_HPP

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "verilated_bridge.hpp"

using Root = Vbridge_sim___024root;

// Other versions of Verilator, or generated Verilog, may name the registers differently; then every
// clock is evaluated.
#if VERILATOR_VERSION_INTEGER == 5006000 && !BRIDGE_EVERY_CLOCK

// Verilator may keep the next value of the time apart, while it evaluates a clock.
template <class R>
auto next_time(R &root, int) -> decltype(&root.__Vdly__bridge_sim__DOT__core__DOT__time_us) {
    return &root.__Vdly__bridge_sim__DOT__core__DOT__time_us;
}
template <class R>
uint32_t *next_time(R &root, long) {
    return &root.bridge_sim__DOT__core__DOT__time_us;
}

struct IdleCounters {
    explicit IdleCounters(Root &root)
        : time_us(root.bridge_sim__DOT__core__DOT__time_us),
          phase(root.bridge_sim__DOT__core__DOT__servos__DOT__frames__DOT__phase),
          tens(root.bridge_sim__DOT__core__DOT__ticks__DOT__tens),
          fives(root.bridge_sim__DOT__core__DOT__ticks__DOT__fives),
          twenties(root.bridge_sim__DOT__core__DOT__ticks__DOT__twenties),
          rate_count(root.bridge_sim__DOT__core__DOT__video__DOT__rates__DOT__count),
          rate_next(root.bridge_sim__DOT__core__DOT__video__DOT__rates__DOT__count_next),
          rate_turn(root.bridge_sim__DOT__core__DOT__video__DOT__rates__DOT__turn),
          period(root.bridge_sim__DOT__core__DOT__servos__DOT__frames__DOT__period),
          actual{root.bridge_sim__DOT__core__DOT__servos__DOT__servo0__DOT__actual,
                 root.bridge_sim__DOT__core__DOT__servos__DOT__servo1__DOT__actual},
          quiet{
              &root.bridge_sim__DOT__core__DOT__video__DOT__camera0__DOT__clock_watch__DOT__quiet,
              &root.bridge_sim__DOT__core__DOT__video__DOT__camera1__DOT__clock_watch__DOT__quiet} {
    }

    uint32_t &time_us;
    uint16_t &phase;
    uint8_t &tens, &fives, &twenties;  // each counts when the previous one restarts
    // Of rate_meter: counts ticks of 10 us during a turn for the frame period of a camera.
    uint16_t &rate_count, &rate_next;
    const uint8_t rate_turn;
    const uint16_t period, actual[2];
    // Of clock_meter: the ticks of 50 us without an edge of a camera's clock, up to kLost.
    uint8_t *const quiet[2];
    static constexpr unsigned kLost = 4;

    // The number of clocks before one in which a comparison changes its outcome. Comparisons are
    // made by time_base, rate_meter with its counter's end, servo_frame with its period and, while
    // the widths are worked out, with small numbers, servo_pwm with its pulse's end and 4096.
    // clock_meter ignores ticks of 50 us after it has lost its clock; when resting, before that
    // too.
    unsigned room(bool resting) const {
        const unsigned now = phase;
        if (now < kWidths) {
            return 0;
        }
        unsigned min = tens < kDecade ? kDecade - tens : 0;
        if (min != 0 && rate_count < kRateFull - kDecadesOfMs) {
            min += (kDecade + 1) * (kLastFive - fives);
            if (resting || (*quiet[0] == kLost && *quiet[1] == kLost)) {
                min += (kDecade + 1) * (kLastFive + 1) * (kLastTwenty - twenties);
            }
        }
        min = std::min(min, kPhases - now % kPhases);
        for (const unsigned end : ends()) {
            min = end >= now ? std::min(min, end - now) : min;
        }
        return min == 0 ? 0 : min - 1;
    }
    // Skips this many clocks, within that number, or one less: not up to the start of a tick of 10
    // us. Returns how many.
    unsigned pass(unsigned clocks) {
        clocks -= (tens + clocks) % (kDecade + 1) == kDecade ? 1 : 0;
        time_us += clocks;
        phase = static_cast<uint16_t>(phase + clocks);
        const unsigned decades = (tens + clocks) / (kDecade + 1);
        if ((rate_turn & kRateOfFrames) != 0) {
            rate_count = static_cast<uint16_t>(rate_count + decades);
            rate_next = static_cast<uint16_t>(rate_next + decades);
        }
        twenties = static_cast<uint8_t>(twenties + (fives + decades) / (kLastFive + 1));
        fives = static_cast<uint8_t>((fives + decades) % (kLastFive + 1));
        tens = static_cast<uint8_t>((tens + clocks) % (kDecade + 1));
        return clocks;
    }
    // Hash of the outcomes of all comparisons with the phase.
    unsigned outcomes() const {
        unsigned number = phase < kWidths ? 8u + phase : phase / kPhases;
        for (const unsigned end : ends()) {
            number = number * 4 + (phase > end ? 2u : 0u) + (phase == end ? 1u : 0u);
        }
        return number;
    }

  private:
    static constexpr unsigned kDecade = 9, kLastFive = 4, kLastTwenty = 19, kWidths = 64,
                              kPhases = 4096, kRateOfFrames = 2, kRateFull = 0xFFFF,
                              kDecadesOfMs = 100;
    std::array<unsigned, 3> ends() const { return {period, actual[0] / 16u, actual[1] / 16u}; }
};

// Whether each camera's clock monitor has just seen its clock (alive: a sum of 1 << camera), or has
// lost it.
inline bool may_rest(Root &root, unsigned alive) {
    const IdleCounters counters(root);
    for (unsigned camera = 0; camera < 2; camera++) {
        const unsigned quiet = *counters.quiet[camera];
        if ((alive >> camera & 1u) != 0 ? quiet > 1 : quiet != IdleCounters::kLost) {
            return false;
        }
    }
    return true;
}

class IdleSkip {
  public:
    // Just after a rising edge of an idle clock was evaluated and nothing else happened: how many
    // of the next ones only count. Resting: as if the camera clocks that are not lost had just been
    // seen, since some ticks of 50 us are evaluated.
    unsigned still(Root &root, bool resting) {
        const IdleCounters counters(root);
        for (uint8_t *quiet : counters.quiet) {
            if (resting && *quiet != IdleCounters::kLost) {
                *quiet = 0;
                take(root, *quiet);
            }
        }
        if (!same(root) || counters.outcomes() != outcomes_) {
            std::memcpy(before_, bytes(root), sizeof before_);
            outcomes_ = counters.outcomes();
            proved_ = false;
        } else {
            // Two successive clocks, or an earlier stable state.
            proved_ = proved_ || counters.time_us == time_us_ + 1;
        }
        time_us_ = counters.time_us;
        return proved_ ? counters.room(resting) : 0;
    }
    // Skips these, or one less. Returns how many.
    unsigned pass(Root &root, unsigned clocks) {
        IdleCounters counters(root);
        const unsigned passed = counters.pass(clocks);
        time_us_ = *next_time(root, 0) = counters.time_us;
        return passed;
    }

  private:
    static unsigned char *bytes(Root &root) { return reinterpret_cast<unsigned char *>(&root); }
    // Whether the state equals the previous one, except for the counters.
    bool same(Root &root) {
        const IdleCounters counters(root);
        take(root, counters.time_us);
        take(root, *next_time(root, 0));
        take(root, counters.phase);
        take(root, counters.tens);
        take(root, counters.fives);
        take(root, counters.twenties);
        take(root, counters.rate_count);
        take(root, counters.rate_next);
        return std::memcmp(before_, bytes(root), sizeof before_) == 0;
    }
    template <class Word>
    void take(Root &root, const Word &counter) {
        const auto *place = reinterpret_cast<const unsigned char *>(&counter);
        std::memcpy(before_ + (place - bytes(root)), place, sizeof counter);
    }

    bool proved_ = false;
    uint32_t time_us_ = 0, outcomes_ = 0;
    unsigned char before_[sizeof(Root)] = {};
};

#else

inline bool may_rest(Root &, unsigned) {
    return false;
}

class IdleSkip {
  public:
    unsigned still(Root &, bool) { return 0; }
    unsigned pass(Root &, unsigned clocks) { return clocks; }
};

#endif

#endif
