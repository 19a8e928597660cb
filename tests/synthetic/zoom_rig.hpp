// SPDX-License-Identifier: Apache-2.0
/// A rig with two 10x zooms that equals the default one of the simulated rig (its numbers are
/// repeated here), as a zoom calibration: smooth curves only, or with the cam's ripple.
#ifndef VERGENCE_TESTS_SYNTHETIC_ZOOM_RIG_HPP
#define VERGENCE_TESTS_SYNTHETIC_ZOOM_RIG_HPP

#include <memory>

#include "stereo/zoom/zoom_calibration.h"
#include "synthetic/camera.hpp"

namespace zoom_rig {

/// A camera in the instrument's frame, by the simulated rig's formulas. `ripple` false: without the
/// cam's ripple.
synthetic::Camera camera_at(int side, double zoom, double focus, double pan_rad, bool ripple);

/// The smooth part as a calibration, with the covariance of a good one (independent parameters).
std::unique_ptr<zoom_calibration> calibration();

/// The state with both cameras at the same zoom, focused at and turned to `distance_mm` ahead.
zoom_state state(double zoom, double distance_mm);

}  // namespace zoom_rig

#endif
