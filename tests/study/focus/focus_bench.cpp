// SPDX-License-Identifier: Apache-2.0
#include "focus_bench.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/error.h"

namespace focus {

const char *const kVerdictNames[kVerdicts] = {
    "focused",   "sharp everywhere", "no contrast",   "peak at end of range",
    "two peaks", "misled by lights", "scene changed", "lens jammed",
    "error",
};
const MethodRow kMethodRows[kMethods] = {
    {"cold", "cold", autofocus_cold, 12, 20, 250},
    {"with the table", "table", autofocus_table, 6, 10, 50},
};

rig_rectangle focus_region() {
    rig_rectangle region{};
    region.column_px = region.row_px = kMarginPx;
    region.width_px = region.height_px = kRegionPx;
    return region;
}

focus_noise unity_noise() {
    constexpr double kPerElectron = (kValueMax - kBlack) / kFullWellElectrons;
    constexpr double kRead = kReadElectrons * kPerElectron;
    return {uint16_t(kBlack), uint32_t(256 * kRead * kRead), uint32_t(65536 * kPerElectron)};
}

void build_stack(const Scene &scene, BlurStack &stack) {
    simrig::Noise noise(simrig::Noise(scene.seed ^ 0x5EED).next() + scene.index);
    const SceneSide &left = scene.side[0];
    stack.build(scene.texture, left.lens.spot_px(left.zoom, left.iris), noise);
}

FocusBench::FocusBench(const Scene &scene_, const BlurStack &stack)
    : scene(scene_),
      world(scene_),
      left_(scene_, stack, world, 0),
      right_(scene_, stack, world, 1) {
    rig_profile profile;
    rig_profile_named("two-cameras-lens", &profile);
    profile.width_px = profile.height_px = kFramePx;
    profile.frame_us = uint32_t(kFrameMinUs);

    // The lenses' data sheet, from which each lens differs.
    const LensTruth sheet;
    profile.optics.focal_length_wide_um = uint32_t(sheet.wide_mm * 1000);
    profile.optics.focal_length_tele_um = uint32_t(sheet.tele_mm * 1000);
    profile.optics.focus_nearest_um = uint32_t(kNearestMm * 1000);
    profile.optics.f_number_open = uint16_t(sheet.open_wide * 1000);
    profile.optics.f_number_closed = uint16_t(sheet.closed * 1000);
    profile.optics.pixel_nm = uint16_t(kPixelMm * 1e6);
    rig_ports ports{};
    ports.clock = world.lenses.clock();
    ports.lens_uart = world.lenses.uart();
    ports.camera[0] = left_.port();
    ports.camera[1] = right_.port();
    rig_init(&rig, &profile, &ports, nullptr);
}

int FocusBench::bring_up() {
    int error = rig_bringup(&rig);
    uint32_t applied_us = 0;
    uint16_t applied_q3 = 0;
    if (error == ERROR_OK) {
        error = rig_exposure(&rig, 3, uint32_t(scene.exposure_us), &applied_us);
    }
    return error == ERROR_OK ? rig_gain(&rig, 3, uint16_t(scene.gain_q3), &applied_q3) : error;
}

Result FocusBench::result(unsigned method, unsigned side, const Report &report) {
    const SceneSide &own = scene.side[side];
    const FocusCamera &own_camera = camera(side);
    Result result{};
    result.scene = scene.index;
    result.method = method;
    result.side = side;
    result.report = report;
    const Rings rings = world.rings(side);
    const double ring = rings[simrig::kFocus];
    result.ring = ring;
    // With the zoom and iris that the lens really has now.
    const auto blur_px = [&](double at, bool far) {
        return own.lens.blur_px(at, rings[simrig::kZoom], rings[simrig::kIris],
                                far ? own.far_per_mm : own.per_mm);
    };
    // At the ends of the controller's range the ring stops half its play short of them.
    const simrig::LensMotorSettings &motor = own.motors[simrig::kFocus];
    const double play = motor.backlash_counts / 2;
    const double drift = simrig::drift_counts(motor, world.lenses.now_us());
    for (const bool far : {false, true}) {
        if (far && !scene.two_depths) {
            break;
        }
        const double per_mm = far ? own.far_per_mm : own.per_mm;
        const double best = std::clamp(own.lens.ring_for(per_mm, rings[simrig::kZoom]),
                                       kRingLow + play - drift, kRingHigh - play - drift);
        const double reachable_px = std::max(blur_px(best - kResolutionCounts, far),
                                             blur_px(best + kResolutionCounts, far));
        const double excess_px = blur_px(ring, far) - reachable_px;
        if (!far || std::abs(ring - best) < std::abs(ring - result.best)) {
            result.best = best;
            result.blur_px = blur_px(ring, far);
            result.excess_px = excess_px;
            result.tolerance =
                std::max(kResolutionCounts,
                         kSharpPx / own.lens.blur_px_per_count(rings[simrig::kZoom],
                                                               rings[simrig::kIris], per_mm));
        }
        Rings sharp = {own.zoom, own.best_ring(far), own.iris};
        result.contrast = std::max(result.contrast, own_camera.contrast(own_camera.still(sharp)));
    }
    result.noise = scene.noise_electrons() / scene.electrons;
    result.kind = !scene.lamps.empty()                   ? SceneClass::kLamps
                  : result.contrast < 0.5 * result.noise ? SceneClass::kFlat
                  : result.contrast < 3 * result.noise || result.contrast < 0.02
                      ? SceneClass::kBetween
                  : scene.two_depths ? SceneClass::kTwoDepths
                                     : SceneClass::kTextured;
    return result;
}

}  // namespace focus
