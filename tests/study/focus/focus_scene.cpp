// SPDX-License-Identifier: Apache-2.0
#include "focus_scene.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "focus_camera.hpp"

namespace focus {

const char *const kSceneClassNames[kSceneClasses] = {"textured", "two depths", "flat", "between",
                                                     "lamps"};

double lamps_share = 0.1;

namespace {

constexpr double kPi = 3.14159265358979323846;

double between(simrig::Noise &noise, double low, double high) {
    return low + (high - low) * noise.uniform();
}

double between_log(simrig::Noise &noise, double low, double high) {
    return low * std::pow(high / low, noise.uniform());
}

simrig::LensMotorSettings draw_motor(simrig::Noise &noise, double counts_per_s) {
    simrig::LensMotorSettings motor;
    motor.counts_per_s = counts_per_s * between(noise, 0.8, 1.2);
    motor.start_ms = between(noise, 0, 60);
    motor.backlash_counts = between(noise, 0, 8);
    motor.read_noise_counts = between(noise, 0, 1.5);
    motor.drift_counts_per_h = between(noise, -3, 3);
    return motor;
}

/// As an automatic exposure leaves it, more or less.
void draw_light(Scene &scene, simrig::Noise &noise) {
    const SceneSide &left = scene.side[0];
    const double stop = left.lens.f_number(left.zoom, left.iris) / 2;
    const double needed_us = between_log(noise, 500, 8000) * stop * stop;
    scene.exposure_us = std::min(needed_us, 150000.0);
    if (scene.exposure_us > 10000 && noise.chance(0.8)) {
        scene.exposure_us = std::floor(scene.exposure_us / 10000) * 10000;
    }
    // Dark frames are as noisy as amplified ones: the noise at a gain is known of cameras behind
    // the bridge only.
    const double kind = noise.uniform();
    const double level = kind < 0.6   ? between(noise, 0.3, 0.6)
                         : kind < 0.9 ? between_log(noise, 0.018, 0.3)
                                      : between(noise, 0.6, 1.1);
    scene.electrons = level * kFullWellElectrons;
    scene.flicker = noise.chance(0.5) ? 0.06 : 0;
    scene.flicker_phase = between(noise, 0, 2 * kPi);
}

/// The contrast depends on the noise, so that most windows are textured as the goals mean it.
void draw_texture(Scene &scene, simrig::Noise &noise) {
    Texture &texture = scene.texture;
    const double kind = noise.uniform();
    texture.kind = kind < 0.5    ? TextureKind::kPower
                   : kind < 0.7  ? TextureKind::kEdges
                   : kind < 0.8  ? TextureKind::kStep
                   : kind < 0.92 ? TextureKind::kBars
                                 : TextureKind::kLights;
    texture.slope = noise.chance(0.2) ? 0 : between(noise, 0, 1.5);
    const double part = scene.noise_electrons() / scene.electrons;
    texture.contrast = between_log(noise, std::max(0.02, 3 * part), 0.5);
    const double special = noise.uniform();
    if (special < 0.1) {
        texture.contrast = 0;
    } else if (special < 0.2) {
        texture.contrast = between_log(noise, 0.1, 3) * part;
    }
    scene.two_depths = noise.chance(0.1);
    scene.split = between(noise, 0.3, 0.7);
}

/// Lamps in a row, in a grid or anywhere, before a ground that is darker, with or without texture.
void draw_lamps(Scene &scene, simrig::Noise &noise) {
    const bool in_grid = noise.chance(0.5);
    const double spacing_px = between_log(noise, 40, 400), reach_px = between_log(noise, 100, 800);
    const double diameter_px = between_log(noise, 2, 60), radiance = between_log(noise, 3, 3000);
    const double left_px = between(noise, 0, spacing_px), top_px = between(noise, 0, spacing_px);
    const unsigned most = in_grid ? 60 : 1 + unsigned(noise.next() % 12);
    const int steps = int(reach_px / spacing_px) + 1;
    for (int j = -steps; in_grid && j <= steps; j++) {
        for (int i = -steps; i <= steps && scene.lamps.size() < most; i++) {
            scene.lamps.push_back(
                {left_px + i * spacing_px, top_px + j * spacing_px, diameter_px, radiance});
        }
    }
    while (!in_grid && scene.lamps.size() < most) {
        scene.lamps.push_back({between(noise, -reach_px, reach_px),
                               between(noise, -reach_px, reach_px),
                               diameter_px * between(noise, 0.7, 1.4), radiance});
    }
    scene.electrons = between_log(noise, 0.004, 0.4) * kFullWellElectrons;
    scene.texture.contrast = noise.chance(0.5) ? 0 : scene.texture.contrast;
    scene.two_depths = false;
}

}  // namespace

Scene draw_scene(uint64_t seed, unsigned index) {
    Scene scene;
    scene.seed = seed;
    scene.index = index;
    simrig::Noise noise(simrig::Noise(seed).next() + index);
    const double zoom = kRingLow + kRingSpan * (8.5 * std::pow(10, noise.uniform()) - 8.5) / 76.5;
    const double iris = noise.chance(0.25) ? kRingHigh : between(noise, kRingLow, kRingHigh);
    // As much distance as there is travel of the ring; the ends are also possible.
    const double end = noise.uniform();
    const double depth = end < 0.05 ? 0 : end > 0.95 ? 1 : noise.uniform();
    const double other = std::clamp(depth + between(noise, -0.3, 0.3), 0.0, 1.0);
    for (unsigned side = 0; side < kSides; side++) {
        SceneSide &own = scene.side[side];
        const double speeds[] = {200, 150, 180};
        for (std::size_t axis = 0; axis < own.motors.size(); axis++) {
            own.motors[axis] = draw_motor(noise, speeds[axis]);
        }
        own.lens.wide_mm *= between(noise, 0.99, 1.01);
        own.lens.tele_mm *= between(noise, 0.99, 1.01);
        own.lens.drift_per_m = between(noise, -0.004, 0.004);
        own.zoom = std::clamp(zoom + between(noise, -3, 3), kRingLow, kRingHigh);
        own.iris = std::clamp(iris + between(noise, -3, 3), kRingLow, kRingHigh);
        own.focus = between(noise, kRingLow, kRingHigh);
        // The cameras are not at the same place.
        own.per_mm = depth / kNearestMm * between(noise, 0.99, 1);
        own.far_per_mm = other / kNearestMm;
    }
    scene.warm_us = between(noise, 0, 3600e6);
    draw_light(scene, noise);
    draw_texture(scene, noise);
    // Of numbers of their own, so that all other scenes are the same with and without lamps.
    simrig::Noise lamps(simrig::Noise(seed ^ 0x1A35).next() + index);
    if (lamps.chance(lamps_share)) {
        draw_lamps(scene, lamps);
    }
    return scene;
}

double Scene::noise_electrons() const {
    return std::sqrt(electrons + kReadElectrons * kReadElectrons);
}

std::string Scene::text() const {
    char text[400];
    const SceneSide &left = side[0];
    std::snprintf(text, sizeof text,
                  "%s slope %.2f contrast %.4f%s, zoom %.0f iris %.0f (f/%.1f), %.2f px a count, "
                  "exposure %.0f us, gain %.1f, noise %.1f %%, light %.2f%s, %u lamps",
                  kTextureNames[int(texture.kind)], texture.slope, texture.contrast,
                  two_depths ? " two depths" : "", left.zoom, left.iris,
                  left.lens.f_number(left.zoom, left.iris), left.px_per_count(), exposure_us,
                  gain_q3 / 8.0, 100 * noise_electrons() / electrons,
                  electrons * (gain_q3 / 8.0) / kFullWellElectrons, flicker != 0 ? " flicker" : "",
                  unsigned(lamps.size()));
    return text;
}

}  // namespace focus
