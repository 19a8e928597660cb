// SPDX-License-Identifier: Apache-2.0
/// A random scene for both cameras: what they see, how their lenses are set, and what is wrong with
/// their motors.
#ifndef VERGENCE_TESTS_FOCUS_FOCUS_SCENE_HPP
#define VERGENCE_TESTS_FOCUS_FOCUS_SCENE_HPP

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "blur_stack.hpp"
#include "lens_truth.hpp"
#include "tools/simrig/devices/lens_controller.hpp"

namespace focus {

constexpr unsigned kSides = 2;

/// How a scene counts.
enum class SceneClass { kTextured, kTwoDepths, kFlat, kBetween, kLamps };
constexpr int kSceneClasses = 5;
extern const char *const kSceneClassNames[kSceneClasses];

/// A bright disc at the scene's depth, in or beside the window: out of focus a larger one.
struct Lamp {
    double x_px, y_px;   ///< offset from the middle of the frame
    double diameter_px;  ///< diameter in focus
    double radiance;     ///< times that of the ground
};

struct SceneSide {
    LensTruth lens;
    double zoom = 300, focus = 300, iris = 850;  ///< positions of the rings at the start
    std::array<simrig::LensMotorSettings, simrig::kLensAxes> motors;
    double per_mm = 0;      ///< 1 / distance of what the window shows
    double far_per_mm = 0;  ///< 1 / distance of the window's other part, if there are two depths

    double blur_px(double ring) const { return lens.blur_px(ring, zoom, iris, per_mm); }
    double px_per_count() const { return lens.blur_px_per_count(zoom, iris, per_mm); }
    /// The ring's best position within its range, for the near or the far part.
    double best_ring(bool far = false) const {
        return std::clamp(lens.ring_for(far ? far_per_mm : per_mm, zoom), kRingLow, kRingHigh);
    }
};

struct Scene {
    uint64_t seed = 0;
    unsigned index = 0;
    Texture texture;
    std::vector<Lamp> lamps;
    bool two_depths = false;
    double split = 0.5;  ///< part of the window's width with the near depth
    double exposure_us = 5000;
    unsigned gain_q3 = 8;
    /// Electrons of a green pixel of radiance 1 at this exposure and iris.
    double electrons = 4000;
    double flicker = 0;  ///< modulation of the light at 100 Hz
    double flicker_phase = 0;
    double warm_us = 0;  ///< time since the controller's power-up
    std::array<SceneSide, kSides> side;

    /// Noise of a green pixel of radiance 1, in electrons.
    double noise_electrons() const;
    std::string text() const;
};

/// Part of all scenes that have lamps.
extern double lamps_share;

/// The same scene for the same numbers.
Scene draw_scene(uint64_t seed, unsigned index);

}  // namespace focus

#endif
