// SPDX-License-Identifier: Apache-2.0
// Where a cold search may sweep: as the lens is set, with the iris closed first, or at the wide end
// first. Crude on purpose: the highest frame of a sweep, a parabola around it, and one approach.
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "focus_bench.hpp"
#include "rig/lens_move.h"

namespace focus {
namespace {

class Sweep {
  public:
    Sweep(FocusBench &bench, unsigned side) : bench_(bench), side_(side) {
        begin_s_ = bench.now_s();
        begin_frames_ = bench.frames(side);
        const rig_rectangle where = focus_region();
        error_ = rig_region_begin(&bench.rig, &region_, side, &where, 1);
    }

    void move(lens_axis axis, double position) {
        if (error_ == ERROR_OK) {
            const double inside = std::clamp(position, kRingLow, kRingHigh);
            error_ = rig_lens_move_to(&bench_.rig, 1u << side_, axis, int32_t(std::lround(inside)));
        }
    }
    void expose(double exposure_us, double gain) {
        uint32_t applied_us = 0;
        uint16_t applied_q3 = 0;
        if (error_ == ERROR_OK) {
            error_ = rig_region_exposure(&bench_.rig, &region_, uint32_t(exposure_us), &applied_us);
        }
        if (error_ == ERROR_OK) {
            error_ = rig_region_gain(&bench_.rig, &region_, uint16_t(gain * 8), &applied_q3);
        }
    }
    /// Frames while the ring moves from above to below. Returns the position of the peak.
    double down(double from, double to) {
        move(LENS_FOCUS, from);
        std::vector<Frame> frames;
        placed_ = 0;
        rig_lens_move going{};
        if (error_ == ERROR_OK) {
            error_ =
                rig_lens_move_begin(&bench_.rig, &going, 1u << side_, LENS_FOCUS,
                                    int32_t(std::lround(std::max(to, kRingLow))), LENS_MOVE_ALWAYS);
        }
        while (error_ == ERROR_OK && !rig_lens_move_done(&going)) {
            take(frames);
            if (error_ == ERROR_OK) {
                error_ = rig_lens_move_step(&bench_.rig, &going, 0);
            }
            place(frames, bench_.now_s() * 1e6 - kReadingsUs);
        }
        place(frames, bench_.now_s() * 1e6);
        return error_ == ERROR_OK ? peak(frames) : kRingLow;
    }
    Report end() {
        Report report;
        report.error = error_;
        rig_region_end(&bench_.rig, &region_, false);
        report.verdict = error_ == ERROR_OK ? Verdict::kFocused : Verdict::kError;
        report.seconds = bench_.now_s() - begin_s_;
        report.frames = bench_.frames(side_) - begin_frames_;
        return report;
    }

  private:
    static constexpr double kReadingsUs = 400000;
    struct Frame {
        uint64_t time_us;
        double energy, position;
    };
    void take(std::vector<Frame> &frames) {
        rig_region_frame frame{};
        error_ = rig_region_take(&bench_.rig, &region_, 0, &frame);
        if (error_ != ERROR_OK) {
            return;
        }
        const focus_noise unity = unity_noise(), noise = focus_noise_at(&unity, frame.gain_q3);
        const focus_window window = {frame.image.data, size_t(frame.image.stride), kRegionPx,
                                     kRegionPx, kValueMax};
        frames.push_back(
            {frame.exposed_us,
             double(focus_measure_window(&window, FOCUS_GREEN, FOCUS_NORMALIZED_VARIANCE, &noise)
                        .energy),
             0});
        raw_image_release(&frame.image);
    }
    /// Gives frames until then their positions: those that have enough readings after them.
    void place(std::vector<Frame> &frames, double until_us) {
        for (; placed_ < frames.size() && double(frames[placed_].time_us) <= until_us; placed_++) {
            Frame &frame = frames[placed_];
            int32_t position_q4 = 0;
            uint16_t sigma_q4 = 0;
            const int error = rig_lens_position_at(&bench_.rig, side_, LENS_FOCUS, frame.time_us,
                                                   &position_q4, &sigma_q4);
            frame.position = error == ERROR_OK ? position_q4 / 16.0 : -1;
        }
    }
    double peak(const std::vector<Frame> &frames) const {
        std::vector<Frame> placed;
        for (const Frame &frame : frames) {
            if (frame.position >= 0) {
                placed.push_back(frame);
            }
        }
        if (placed.empty()) {
            return kRingLow;
        }
        const auto higher = [](const Frame &a, const Frame &b) { return a.energy < b.energy; };
        const Frame top = *std::max_element(placed.begin(), placed.end(), higher);
        // A parabola through what is above 0.8 of it, as far as there is no gap.
        double s[5] = {}, t[3] = {};
        const auto at =
            std::size_t(std::max_element(placed.begin(), placed.end(), higher) - placed.begin());
        const auto add = [&](const Frame &frame) {
            const double x = frame.position - top.position;
            double power = 1;
            for (int i = 0; i < 5; i++, power *= x) {
                s[i] += power;
                t[i < 3 ? i : 2] += i < 3 ? power * frame.energy / top.energy : 0;
            }
        };
        for (std::size_t i = at; i < placed.size() && placed[i].energy > 0.8 * top.energy; i++) {
            add(placed[i]);
        }
        for (std::size_t i = at; i-- > 0 && placed[i].energy > 0.8 * top.energy;) {
            add(placed[i]);
        }
        const double m00 = s[0], m01 = s[1], m02 = s[2], m11 = s[2], m12 = s[3], m22 = s[4];
        const double det = m00 * (m11 * m22 - m12 * m12) - m01 * (m01 * m22 - m12 * m02) +
                           m02 * (m01 * m12 - m11 * m02);
        const double b = m00 * (t[1] * m22 - m12 * t[2]) - t[0] * (m01 * m22 - m12 * m02) +
                         m02 * (m01 * t[2] - t[1] * m02);
        const double c = m00 * (m11 * t[2] - t[1] * m12) - m01 * (m01 * t[2] - t[1] * m02) +
                         t[0] * (m01 * m12 - m11 * m02);
        return det > 0 && c < 0 ? top.position + std::clamp(-b / c / 2, -30.0, 30.0) : top.position;
    }

    FocusBench &bench_;
    unsigned side_;
    rig_region region_{};
    int error_ = ERROR_OK;
    double begin_s_ = 0;
    unsigned begin_frames_ = 0;
    std::size_t placed_ = 0;
};

/// Half of the width of the narrowest peak.
double reach(const SceneSide &own) {
    return std::max(12.0, 8 / own.px_per_count());
}

}  // namespace

Report sweep_open(FocusBench &bench, unsigned side) {
    Sweep sweep(bench, side);
    sweep.move(LENS_FOCUS, sweep.down(kRingHigh, kRingLow));
    return sweep.end();
}

Report sweep_closed(FocusBench &bench, unsigned side) {
    const SceneSide &own = bench.scene.side[side];
    Sweep sweep(bench, side);
    const double f_number = own.lens.f_number(own.zoom, own.iris);
    const double open = own.lens.f_number(own.zoom, kRingHigh);
    const double f8 = kRingHigh - kRingSpan * std::log(8 / open) / std::log(16 / open);
    const bool closes = f_number < 7;
    double around = 0;
    if (closes) {
        const double light = std::pow(8 / f_number, 2), longest_us = 150000;
        const double longer = std::max(1.0, std::min(light, longest_us / bench.scene.exposure_us));
        sweep.move(LENS_IRIS, f8);
        sweep.expose(bench.scene.exposure_us * longer,
                     std::min(64.0, bench.scene.gain_q3 / 8.0 * light / longer));
        around = sweep.down(kRingHigh, kRingLow);
        sweep.move(LENS_IRIS, own.iris);
        sweep.expose(bench.scene.exposure_us, bench.scene.gain_q3 / 8.0);
    }
    const double half = 30 + reach(own);
    sweep.move(LENS_FOCUS,
               closes ? sweep.down(around + half, around - half) : sweep.down(kRingHigh, kRingLow));
    return sweep.end();
}

Report sweep_wide(FocusBench &bench, unsigned side) {
    const SceneSide &own = bench.scene.side[side];
    Sweep sweep(bench, side);
    const bool zooms = own.px_per_count() > 0.3;
    double around = 0;
    if (zooms) {
        sweep.move(LENS_ZOOM, kRingLow);
        around = sweep.down(kRingHigh, kRingLow);
        sweep.move(LENS_ZOOM, own.zoom);
    }
    const double half = 40 + reach(own);
    sweep.move(LENS_FOCUS,
               zooms ? sweep.down(around + half, around - half) : sweep.down(kRingHigh, kRingLow));
    return sweep.end();
}

}  // namespace focus
