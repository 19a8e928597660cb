// SPDX-License-Identifier: Apache-2.0
/// The simulated lenses with their line and clock, and where their rings were a moment ago, which
/// is when a frame that arrives now was exposed.
#ifndef VERGENCE_TESTS_FOCUS_FOCUS_WORLD_HPP
#define VERGENCE_TESTS_FOCUS_FOCUS_WORLD_HPP

#include <array>
#include <deque>

#include "focus_scene.hpp"
#include "tests/motion/lens_bench.hpp"

namespace focus {

using Rings = std::array<double, simrig::kLensAxes>;

class FocusWorld {
  public:
    explicit FocusWorld(const Scene &scene)
        : lenses(motors(scene), positions(scene), scene.seed * 1000003 + scene.index) {
        lenses.advance(scene.warm_us);
        sample(lenses.now_us());
    }

    /// The rings' positions now.
    Rings rings(unsigned side) {
        Rings now{};
        for (std::size_t axis = 0; axis < now.size(); axis++) {
            now[axis] = lenses.controller.motor(side, simrig::LensAxis(axis)).ring(lenses.now_us());
        }
        return now;
    }
    /// At a time that is at most kKeptUs ago.
    Rings rings_at(unsigned side, double time_us) {
        Moment after{lenses.now_us(), {rings(0), rings(1)}};
        for (auto moment = history_.rbegin(); moment != history_.rend(); ++moment) {
            if (moment->time_us <= time_us) {
                const double span_us = after.time_us - moment->time_us;
                const double part =
                    span_us > 0 ? std::min(1.0, (time_us - moment->time_us) / span_us) : 0;
                Rings rings{};
                for (std::size_t axis = 0; axis < rings.size(); axis++) {
                    const double from = moment->rings[side][axis];
                    rings[axis] = from + part * (after.rings[side][axis] - from);
                }
                return rings;
            }
            after = *moment;
        }
        return after.rings[side];
    }

    motion::LensWorld lenses;

  private:
    static constexpr double kStepUs = 2000, kKeptUs = 2000000;
    struct Moment {
        double time_us;
        std::array<Rings, kSides> rings;
    };

    static std::array<motion::LensWorld::Motors, kSides> motors(const Scene &scene) {
        return {scene.side[0].motors, scene.side[1].motors};
    }
    static std::array<motion::LensWorld::Positions, kSides> positions(const Scene &scene) {
        std::array<motion::LensWorld::Positions, kSides> all{};
        for (unsigned side = 0; side < kSides; side++) {
            all[side] = {scene.side[side].zoom, scene.side[side].focus, scene.side[side].iris};
        }
        return all;
    }
    void sample(double time_us) {
        history_.push_back({time_us, {rings(0), rings(1)}});
        while (history_.front().time_us < time_us - kKeptUs) {
            history_.pop_front();
        }
        lenses.at(time_us + kStepUs, [this](double now_us) { sample(now_us); });
    }

    std::deque<Moment> history_;
};

}  // namespace focus

#endif
