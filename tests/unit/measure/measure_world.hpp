// SPDX-License-Identifier: Apache-2.0
/// A world of numbers to measure in: cameras by the simulated rig's formulas, servos that come to
/// rest elsewhere, potentiometers that drift, a subject that only the cameras see.
#ifndef VERGENCE_TESTS_MEASURE_WORLD_HPP
#define VERGENCE_TESTS_MEASURE_WORLD_HPP

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "core/error.h"
#include "measure/measure.h"
#include "synthetic/zoom_rig.hpp"

namespace measure_world {

using Random = std::mt19937_64;

inline double uniform(Random &random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
inline double normal(Random &random, double sigma) {
    return std::normal_distribution<double>(0, sigma)(random);
}

/// In focus at the upper end of the ring, as zoom_rig has it. Its lenses also focus otherwise at
/// other zooms, by up to 0.7 % of 1.8 m, which is left out here.
constexpr double kNearestMm = 800;

class World {
  public:
    explicit World(uint64_t seed) : random(seed) {
        for (int side = 0; side < 2; side++) {
            zoom[side] = uniform(random, 300, 850);
            focus[side] = uniform(random, 300, 850);
        }
    }

    double subject_mm[3] = {125, 0, 1800};
    double near_mm = 1750, far_mm = 1900, width_mm = 300;
    double servo_sigma_rad = 0.0052, drift_counts = 1;
    /// Part of full light that the longest exposure, largest gain and f/4 would be too much by.
    double light = 50;
    double dark_part = 0;
    double other_mm = 1.5;  // expected with a pair at another zoom
    bool surface_shows = true;
    int pairs = 0, pairs_at_aim = 0;
    double zoom[2], focus[2], pan[2] = {0.1, -0.05};  // where they are
    double focus_error[2] = {3, -2.5};                // of each move of a focus ring, counts
    double commanded_pan[2] = {NAN, NAN};
    double f_number = 12;
    /// Overrides an event.
    std::function<void(const measure_step &, measure_event &)> meddle;
    std::vector<measure_step> steps;
    double seconds = 0;

    measure_event carry_out(const measure_step &step) {
        measure_event event{};
        steps.push_back(step);
        seconds += step.seconds;
        move(step);
        if (step.kind == MEASURE_STEP_LIGHT && !step.keep_iris) {
            f_number = std::clamp(4 * std::sqrt(light), 1.6, std::max(f_number, 1.6));
        }
        const double product = f_number * f_number / 16 / light;  // of the largest
        event.light = {std::min(1.0, 2 * product) * 1e6, std::max(1.0, 2 * product),
                       std::min(1.0, 1 / product)};
        event.light.gain = std::min(event.light.gain, 2.0);
        event.focus_mm = subject_mm[2] * uniform(random, 0.97, 1.03);
        event.f_number = f_number;
        pairs += step.kind == MEASURE_STEP_PAIR;
        event.pair = {static_cast<uint32_t>(pairs), step.bracket > 0 ? 0 : dark_part};
        event.surface = {step.with_pair != 0,
                         subject_mm[2],
                         near_mm,
                         far_mm,
                         1,
                         step.with_pair != 0 ? 1.5 : 20,
                         0.9,
                         nullptr,
                         other_mm,
                         0.8};
        look(step, event);
        for (int side = 0; side < 2; side++) {
            event.axes.side[side].zoom_counts = zoom[side] + normal(random, drift_counts);
            event.axes.side[side].focus_counts = focus[side] + normal(random, drift_counts);
            event.axes.side[side].pan_rad = commanded_pan[side];
        }
        if (meddle) {
            meddle(step, event);
        }
        return event;
    }

    synthetic::Camera camera(int side) const {
        return zoom_rig::camera_at(side, zoom[side], focus[side], pan[side], true);
    }

    synthetic::Vector subject(double dx_mm = 0) const {
        return {subject_mm[0] + dx_mm, subject_mm[1], subject_mm[2]};
    }

    /// Whether both cameras see a point beside the subject.
    bool sees(double dx_mm) const {
        for (int side = 0; side < 2; side++) {
            const auto pixel = camera(side).project(subject(dx_mm));
            if (!pixel || pixel->x < 0 || pixel->x > 2047 || pixel->y < 0 || pixel->y > 1535) {
                return false;
            }
        }
        return true;
    }

    bool has(measure_phase phase) const {
        return std::any_of(steps.begin(), steps.end(),
                           [&](const measure_step &step) { return step.phase == phase; });
    }
    const measure_step &last(measure_phase phase) const {
        const auto found =
            std::find_if(steps.rbegin(), steps.rend(),
                         [&](const measure_step &step) { return step.phase == phase; });
        REQUIRE(found != steps.rend());
        return *found;
    }

  private:
    void move(const measure_step &step) {
        for (int side = 0; side < 2; side++) {
            const auto &to = step.axes.side[side];
            if (step.kind == MEASURE_STEP_ZOOM) {
                zoom[side] = to.zoom_counts + normal(random, 1);
            } else if (step.kind == MEASURE_STEP_FOCUS) {
                focus[side] = to.focus_counts + focus_error[side] + normal(random, 0.3);
            } else if (step.kind == MEASURE_STEP_AUTOFOCUS) {
                focus[side] = 300 + 550 * kNearestMm / subject_mm[2];
            } else if (step.kind == MEASURE_STEP_AIM) {
                commanded_pan[side] = to.pan_rad;
                pairs_at_aim = pairs;
                pan[side] = to.pan_rad + normal(random, servo_sigma_rad);
            }
        }
        f_number = step.kind == MEASURE_STEP_IRIS ? step.f_number : f_number;
    }

    // The subject where the cameras really have it.
    void look(const measure_step &step, measure_event &event) {
        if (step.kind != MEASURE_STEP_LOOK) {
            return;
        }
        event.error = surface_shows ? ERROR_OK : ERROR_NO_SURFACE;
        const auto left = camera(0);
        const auto in_left = synthetic::operator*(left.R_camera_world, subject() - left.centre_mm);
        const auto right = camera(1).project(subject());
        const double left_mm[3] = {in_left.x, in_left.y, in_left.z};
        std::copy(left_mm, left_mm + 3, event.subject.left_mm);
        event.subject.right_px[0] = right ? right->x : NAN;
        event.subject.right_px[1] = right ? right->y : NAN;
        event.subject.near_mm = near_mm;
        event.subject.far_mm = far_mm;
        event.subject.width_mm = width_mm;
    }

    Random random;
};

inline const zoom_calibration *model() {
    static const auto calibration = zoom_rig::calibration();
    return calibration.get();
}

inline measure_instrument whole_rig() {
    measure_instrument rig{};
    rig.servos = rig.zoom = rig.focus = rig.iris = rig.exposure = rig.brackets = rig.mosaic = true;
    rig.calibration = model();
    rig.f_number_open = 1.6;
    rig.f_number_closed = 16;
    rig.exposure_max_us = 1e6;
    rig.gain_max = 2;
    rig.steady_us = 1e4;
    return rig;
}

inline measure_request wish(measure_wish kind, double value, bool quick = false) {
    measure_request request{};
    request.wish = kind;
    request.value = value;
    request.quick = quick;
    return request;
}

inline measure_result run(World &world, const measure_request &request,
                          const measure_instrument &instrument) {
    measure self;
    measure_step step = measure_begin(&self, &request, &instrument);
    for (int i = 0; step.kind != MEASURE_STEP_END; i++) {
        REQUIRE(i < 60);
        const measure_event event = world.carry_out(step);
        step = measure_next(&self, &event);
    }
    return self.result;
}

inline bool lost(const measure_result &result, measure_loss loss) {
    return (result.losses >> loss & 1) != 0;
}

}  // namespace measure_world

#endif
