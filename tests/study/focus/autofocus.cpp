// SPDX-License-Identifier: Apache-2.0
// The firmware's autofocus.
#include "rig/auto/autofocus.h"

#include <cmath>

#include "core/error.h"
#include "focus_bench.hpp"

namespace focus {

namespace {

Verdict verdict_of(focus_verdict verdict) {
    switch (verdict) {
        case FOCUS_FOCUSED:
            return Verdict::kFocused;
        case FOCUS_SHARP_EVERYWHERE:
            return Verdict::kEverywhere;
        case FOCUS_NO_CONTRAST:
            return Verdict::kNoContrast;
        case FOCUS_PEAK_AT_END:
            return Verdict::kEnd;
        case FOCUS_TWO_PEAKS:
            return Verdict::kTwoPeaks;
        case FOCUS_LIGHTS:
            return Verdict::kLights;
        case FOCUS_SCENE_CHANGED:
            return Verdict::kChanged;
        case FOCUS_LENS_JAMMED:
            return Verdict::kJammed;
        default:
            return Verdict::kError;
    }
}

/// As if this object had been focused at some zooms before, yesterday: the potentiometers have
/// drifted since.
void learn(FocusBench &bench) {
    simrig::Noise noise(bench.scene.seed + bench.scene.index);
    const lens_axis_settings *axes = bench.rig.profile.lens.axis;
    const bool above = axes[LENS_FOCUS].approach == LENS_FROM_ABOVE;
    for (const double zoom : {320.0, 430.0, 560.0, 700.0, 840.0}) {
        for (unsigned side = 0; side < kSides; side++) {
            const SceneSide &own = bench.scene.side[side];
            const double play = own.motors[simrig::kFocus].backlash_counts / 2;
            const double position =
                own.lens.ring_for(own.per_mm, zoom) + (above ? -play : play) + 0.7 * noise.gauss();
            if (position < kRingLow || position > kRingHigh) {
                continue;
            }
            lens_learned_focus(&bench.rig.camera[side].lens.learned.focus, uint8_t(side),
                               &bench.rig.object, int32_t(zoom), int32_t(kRingSpan),
                               int32_t(std::lround(16 * position)), 16, INT32_MIN);
        }
    }
}

Reports focus_both(FocusBench &bench) {
    rig_autofocus_options options{};
    options.measure = FOCUS_VARIANCE;
    const int error = rig_autofocus(&bench.rig, 3, &options);
    Reports reports;
    for (unsigned side = 0; side < kSides; side++) {
        const rig_focus &focus = bench.rig.camera[side].focus;
        Report &report = reports[side];
        report.error = error;
        report.seconds = focus.duration_ms * 1e-3;
        report.frames = focus.frames;
        if (error == ERROR_OK || error == ERROR_JAMMED) {
            report.verdict = verdict_of(focus.search.result.verdict);
            report.blur_px = focus.search.result.blur_px;
        }
    }
    return reports;
}

}  // namespace

Reports autofocus_cold(FocusBench &bench) {
    return focus_both(bench);
}

Reports autofocus_table(FocusBench &bench) {
    learn(bench);
    return focus_both(bench);
}

}  // namespace focus
