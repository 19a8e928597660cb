// SPDX-License-Identifier: Apache-2.0
// What others do, on the same lenses, lines and windows.
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "focus/focus_measure.h"
#include "focus_bench.hpp"

namespace focus {
namespace {

constexpr int kFramesAtStop = 2;
// libcamera's rpi/af.cpp counts a peak as seen when the contrast fell to this part of it.
constexpr double kContrastRatio = 0.75;

/// A lens that is stopped, then measured.
class Stops {
  public:
    Stops(FocusBench &bench, unsigned side) : bench_(bench), side_(side) {
        const rig_rectangle where = focus_region();
        begin_s_ = bench.now_s();
        begin_frames_ = bench.frames(side);
        error_ = rig_region_begin(&bench.rig, &region_, side, &where, 1);
    }

    /// Contrast at a position; negative after an error.
    double at(double position) {
        const auto counts = int32_t(std::lround(std::clamp(position, kRingLow, kRingHigh)));
        if (error_ == ERROR_OK) {
            error_ = rig_lens_move_to(&bench_.rig, 1u << side_, LENS_FOCUS, counts);
        }
        return here();
    }
    double here() {
        double sum = 0;
        for (int i = 0; i < kFramesAtStop && error_ == ERROR_OK; i++) {
            rig_region_frame frame{};
            error_ = rig_region_take(&bench_.rig, &region_, i == 0 ? now_us() : 0, &frame);
            if (error_ == ERROR_OK) {
                sum += measure(frame);
                raw_image_release(&frame.image);
            }
        }
        const double contrast = error_ == ERROR_OK ? sum / kFramesAtStop : -1;
        most_ = std::max(most_, contrast);
        least_ = std::min(least_, contrast);
        return contrast;
    }
    double position() {
        int32_t positions[LENS_AXES] = {};
        if (error_ == ERROR_OK) {
            error_ = rig_lens_read(&bench_.rig, side_, positions);
        }
        return positions[LENS_FOCUS];
    }
    bool failed() const { return error_ != ERROR_OK; }
    double most() const { return most_; }

    /// By the rule of af.cpp: the last contrast is near the largest, and some were much smaller.
    Report end(double contrast) {
        Report report;
        rig_region_end(&bench_.rig, &region_, false);
        const bool peak = contrast >= kContrastRatio * most_ && least_ <= kContrastRatio * most_;
        report.error = error_;
        report.verdict = error_ == ERROR_JAMMED ? Verdict::kJammed
                         : error_ != ERROR_OK   ? Verdict::kError
                         : peak                 ? Verdict::kFocused
                                                : Verdict::kNoContrast;
        report.seconds = bench_.now_s() - begin_s_;
        report.frames = bench_.frames(side_) - begin_frames_;
        return report;
    }

  private:
    uint64_t now_us() const { return uint64_t(bench_.world.lenses.now_us()); }
    double measure(const rig_region_frame &frame) const {
        const focus_noise none{};
        const focus_window window = {frame.image.data, size_t(frame.image.stride),
                                     uint16_t(frame.image.width_px),
                                     uint16_t(frame.image.height_px), kValueMax};
        return double(focus_measure_window(&window, FOCUS_GREEN, FOCUS_VARIANCE, &none).energy);
    }

    FocusBench &bench_;
    unsigned side_;
    rig_region region_{};
    int error_ = ERROR_OK;
    double begin_s_ = 0, most_ = 0, least_ = 1e30;
    unsigned begin_frames_ = 0;
};

/// The top of a parabola through three equally spaced values, in steps from the middle one.
double parabola(double before, double middle, double after) {
    const double bend = before - 2 * middle + after;
    return bend < 0 ? std::clamp(0.5 * (before - after) / bend, -1.0, 1.0) : 0;
}

}  // namespace

Report hill_climb(FocusBench &bench, unsigned side) {
    Stops lens(bench, side);
    double position = lens.position(), best = lens.here(), step = 64;
    while (std::abs(step) >= kResolutionCounts && !lens.failed()) {
        bool climbed = false;
        for (int turn = 0; turn < 2 && !climbed; turn++, step = climbed ? step : -step) {
            for (;;) {
                const double next = position + step;
                const double contrast = next < kRingLow || next > kRingHigh ? -1 : lens.at(next);
                if (contrast <= best || lens.failed()) {
                    break;
                }
                climbed = true;
                best = contrast;
                position = next;
            }
        }
        step /= 2;
    }
    return lens.end(lens.at(position));
}

Report stops(FocusBench &bench, unsigned side) {
    constexpr double kCoarse = 30, kFine = 7.5;
    Stops lens(bench, side);
    double best = -1, peak = kRingLow;
    for (double position = kRingLow; position <= kRingHigh && !lens.failed(); position += kCoarse) {
        const double contrast = lens.at(position);
        if (contrast > best) {
            best = contrast;
            peak = position;
        } else if (contrast < kContrastRatio * lens.most()) {
            break;
        }
    }
    std::vector<double> fine, found;
    for (double position = std::min(kRingHigh, peak + kCoarse);
         position >= std::max(kRingLow, peak - kCoarse) && !lens.failed(); position -= kFine) {
        fine.push_back(position);
        found.push_back(lens.at(position));
    }
    if (lens.failed()) {
        return lens.end(-1);
    }
    const std::size_t top =
        std::size_t(std::max_element(found.begin(), found.end()) - found.begin());
    double position = fine[top];
    if (top > 0 && top + 1 < fine.size()) {
        position -= kFine * parabola(found[top - 1], found[top], found[top + 1]);
    }
    return lens.end(lens.at(position));
}

}  // namespace focus
