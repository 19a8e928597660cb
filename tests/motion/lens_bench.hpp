// SPDX-License-Identifier: Apache-2.0
/// The simulated lens controller on the hal's serial line and clock, and a rig with two lenses
/// only.
#ifndef VERGENCE_TESTS_MOTION_LENS_BENCH_HPP
#define VERGENCE_TESTS_MOTION_LENS_BENCH_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <vector>

#include "core/error.h"
#include "rig/lens_move.h"
#include "rig/rig.h"
#include "tools/simrig/devices/lens_controller.hpp"

namespace motion {

/// Time, and the bytes on the line to a simulated controller.
class LensWorld {
  public:
    using Motors = std::array<simrig::LensMotorSettings, simrig::kLensAxes>;
    using Positions = std::array<double, simrig::kLensAxes>;

    LensWorld(const std::array<Motors, 2> &motors, const std::array<Positions, 2> &positions,
              uint64_t seed, const simrig::LensControllerSettings &settings = {})
        : owned_(simrig::make_lens_controller(
              settings,
              {lens(motors[0], positions[0], seed), lens(motors[1], positions[1], seed + 100)},
              seed + 200)),
          controller(*owned_) {}

    const hal_uart *uart() const { return &uart_; }
    const hal_clock *clock() const { return &clock_; }
    double now_us() const { return now_us_; }

    /// At this time (us), or as soon as time passes.
    void at(double time_us, std::function<void(double)> what) {
        events_.emplace(time_us, std::move(what));
    }
    void advance(double until_us) {
        while (!events_.empty() && events_.begin()->first <= until_us) {
            const auto event = events_.begin();
            step(std::max(now_us_, event->first));
            const auto what = event->second;
            events_.erase(event);
            what(now_us_);
        }
        step(std::max(now_us_, until_us));
    }

  private:
    std::unique_ptr<simrig::LensController> owned_;

  public:
    simrig::LensController &controller;

  private:
    static simrig::LensMotors::value_type lens(const Motors &motors, const Positions &positions,
                                               uint64_t seed) {
        return {simrig::LensMotor(motors[0], positions[0], seed),
                simrig::LensMotor(motors[1], positions[1], seed + 1),
                simrig::LensMotor(motors[2], positions[2], seed + 2)};
    }
    // Times in these tests are (almost) whole microseconds.
    static uint64_t ps_of(double time_us) { return uint64_t(std::llround(time_us * 1e6)); }
    void step(double time_us) {
        now_us_ = time_us;
        for (const uint8_t byte : controller.line().take(ps_of(time_us))) {
            come_.push_back(byte);
        }
    }
    static LensWorld &of(void *self) { return *static_cast<LensWorld *>(self); }

    static int write(void *self, const void *data, size_t bytes, uint64_t) {
        LensWorld &world = of(self);
        const auto *first = static_cast<const uint8_t *>(data);
        world.controller.line().send(ps_of(world.now_us_), {first, first + bytes});
        return ERROR_OK;
    }
    static int read(void *self, void *data, size_t capacity, uint64_t deadline_us, size_t *bytes) {
        LensWorld &world = of(self);
        const double end_us = double(deadline_us);
        while (world.come_.empty() && world.now_us_ < end_us) {
            const double next_us = double(world.controller.line().next_ps()) * 1e-6;
            world.advance(std::min(end_us, std::max(world.now_us_ + 1, std::ceil(next_us))));
        }
        if (world.come_.empty()) {
            return ERROR_TIMEOUT;
        }
        *bytes = std::min(capacity, world.come_.size());
        std::copy_n(world.come_.begin(), *bytes, static_cast<uint8_t *>(data));
        world.come_.erase(world.come_.begin(), world.come_.begin() + std::ptrdiff_t(*bytes));
        return ERROR_OK;
    }
    static int discard(void *self) {
        of(self).come_.clear();
        return ERROR_OK;
    }
    static uint64_t clock_now_us(void *self) { return uint64_t(of(self).now_us_); }
    static void wait_until_us(void *self, uint64_t time_us) { of(self).advance(double(time_us)); }

    double now_us_ = 0;
    std::deque<uint8_t> come_;
    std::multimap<double, std::function<void(double)>> events_;
    hal_uart_operations uart_operations_{write, read, discard};
    hal_clock_operations clock_operations_{clock_now_us, wait_until_us, nullptr};
    hal_uart uart_{&uart_operations_, this};
    hal_clock clock_{&clock_operations_, this};
};

/// Numbers that the tests' profiles share.
constexpr int32_t kTolerance = 3, kBacklash = 10, kSlowest = 80;

/// A rig with lenses only, set up by hand.
class LensRig {
  public:
    explicit LensRig(LensWorld &world, bool single = false) : world_(world) {
        std::memset(&rig, 0, sizeof rig);
        std::strcpy(rig.profile.name, "lenses");
        rig_profile_set_lenses(&rig.profile, single ? "v1lc" : "v3lc");
        for (lens_axis_settings &axis : rig.profile.lens.axis) {
            axis.tolerance_counts = kTolerance;
            axis.backlash_counts = kBacklash;
            axis.counts_per_s = kSlowest;
        }
        rig.ports.clock = world.clock();
        rig.ports.lens_uart = world.uart();
        rig.observer = {should_stop, progress, this};
        const lens_ports ports = {world.clock(), world.uart(), nullptr};
        lens_controller_init(&rig.lens_controller, rig.profile.lens_driver, &rig.profile.lens,
                             &ports);
        for (unsigned side = 0; side < (single ? 1u : 2u); side++) {
            rig.camera[side].lens.drive = {&rig.lens_controller, side};
            std::fill_n(rig.camera[side].lens.commanded, 3, INT32_MIN);
        }
    }
    /// Opens both lenses.
    int open() {
        int error = ERROR_OK;
        for (unsigned side = 0; side < rig.profile.lens_driver->lenses; side++) {
            const int own =
                lens_open(&rig.camera[side].lens.drive, uint64_t(world_.now_us()) + 5000000);
            error = error == ERROR_OK ? own : error;
        }
        rig.state = RIG_READY;
        return error;
    }
    int go(unsigned sides, lens_axis axis, int32_t position) {
        asked_us = world_.now_us();
        longest_silence_us = 0;
        done = total = 0;
        went_back = false;
        return rig_lens_move_to(&rig, sides, axis, position);
    }
    /// The same, also to the present target.
    int go_again(unsigned sides, lens_axis axis, int32_t position) {
        rig_lens_move move{};
        int error = rig_lens_move_begin(&rig, &move, sides, axis, position, LENS_MOVE_ALWAYS);
        while (error == ERROR_OK && !rig_lens_move_done(&move)) {
            error = rig_lens_move_step(&rig, &move, uint64_t(world_.now_us()) + 50000);
        }
        return error;
    }

    struct rig rig;
    double cancel_us = std::numeric_limits<double>::infinity();  ///< time of the first cancellation
    double cancelled_us = 0;  ///< time at which the observer last asked to cancel
    double asked_us = 0, longest_silence_us = 0;  ///< time between two calls of the observer
    uint32_t done = 0, total = 0;
    bool went_back = false;  ///< progress decreased, or exceeded its total

  private:
    static bool should_stop(void *self) {
        auto &me = *static_cast<LensRig *>(self);
        const double now_us = me.world_.now_us();
        me.longest_silence_us = std::max(me.longest_silence_us, now_us - me.asked_us);
        me.asked_us = now_us;
        if (now_us >= me.cancel_us) {
            me.cancelled_us = now_us;
            return true;
        }
        return false;
    }
    static void progress(void *self, const char *, uint32_t done, uint32_t total) {
        auto &me = *static_cast<LensRig *>(self);
        me.went_back |= done < me.done || done > total || (me.total != 0 && total != me.total);
        me.done = done;
        me.total = total;
    }
    LensWorld &world_;
};

}  // namespace motion

#endif
