// SPDX-License-Identifier: Apache-2.0
/// The firmware's rig with simulated lenses and cameras that see a scene, in virtual time; and what
/// came of focusing on it.
#ifndef VERGENCE_TESTS_FOCUS_FOCUS_BENCH_HPP
#define VERGENCE_TESTS_FOCUS_FOCUS_BENCH_HPP

#include <array>
#include <string>

#include "focus/focus_measure.h"
#include "focus_camera.hpp"
#include "rig/rig.h"
#include "rig/rig_region.h"

namespace focus {

enum class Verdict {
    kFocused,
    kEverywhere,
    kNoContrast,
    kEnd,
    kTwoPeaks,
    kLights,
    kChanged,
    kJammed,
    kError,
};
constexpr int kVerdicts = 9;
extern const char *const kVerdictNames[kVerdicts];

/// What a method reports about a lens.
struct Report {
    Verdict verdict = Verdict::kError;
    int error = 0;
    double blur_px = -1;  ///< remaining; negative: not reported
    double seconds = 0;   ///< duration in the rig's time
    unsigned frames = 0;
};

/// A report, and the truth. Plain bytes, as processes exchange them.
struct Result {
    unsigned scene, method, side;
    SceneClass kind;
    Report report;
    /// Position and best position in counts; two depths: the best one nearer to `ring`.
    double ring, best;
    double blur_px;    ///< true diameter of the disc of what the window shows
    double excess_px;  ///< excess of `blur_px` over that of a ring kResolutionCounts off its best
    double both_seconds;     ///< duration in the rig's time, for both lenses
    double tolerance;        ///< larger of half a depth of focus and kResolutionCounts
    double contrast, noise;  ///< rms over mean: of the sharp window, of a frame

    bool is_sharp() const { return std::abs(ring - best) <= tolerance; }
};

class FocusBench {
  public:
    FocusBench(const Scene &scene, const BlurStack &stack);
    FocusBench(const FocusBench &) = delete;

    /// Brings the rig up with the scene's exposure and gain. Returns 0 or an error.
    int bring_up();
    /// Fills in the truth for a lens that has been focused.
    Result result(unsigned method, unsigned side, const Report &report);
    double now_s() const { return world.lenses.now_us() * 1e-6; }
    const FocusCamera &camera(unsigned side) const { return side == 0 ? left_ : right_; }
    unsigned frames(unsigned side) const { return camera(side).frames(); }

    const Scene &scene;
    FocusWorld world;
    struct rig rig;

  private:
    FocusCamera left_, right_;
};

/// The larger part of the frame, whose pixels are measured.
rig_rectangle focus_region();

/// Noise of the cameras at a gain of 1, as the firmware's measures are given it.
focus_noise unity_noise();

/// Builds what both windows of a scene show.
void build_stack(const Scene &scene, BlurStack &stack);

/// Ways to focus both lenses.
enum Method { kCold, kTable, kMethods };
using Reports = std::array<Report, kSides>;
struct MethodRow {
    const char *name, *option;
    Reports (*focus)(FocusBench &bench);
    double seconds_p50, seconds_p99, frames_p99;  ///< limits
};
extern const MethodRow kMethodRows[kMethods];

/// rig_autofocus: knowing nothing; with what was learned of both lenses.
Reports autofocus_cold(FocusBench &bench);
Reports autofocus_table(FocusBench &bench);

}  // namespace focus

#endif
