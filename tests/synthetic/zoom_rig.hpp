// SPDX-License-Identifier: Apache-2.0
/// A rig with two 10x zooms that equals the default one of the simulated rig (its numbers are
/// repeated here), as a zoom calibration: smooth curves only, or with the cam's ripple.
#ifndef VERGENCE_TESTS_SYNTHETIC_ZOOM_RIG_HPP
#define VERGENCE_TESTS_SYNTHETIC_ZOOM_RIG_HPP

#include <memory>

#include "stereo/zoom/zoom_calibration.h"

namespace zoom_rig {

struct lens_truth {
    double wide_mm, tele_mm, bow_mm, ripple_mm, ripple_periods, ripple_phase_deg;
    double centre_offset_px[2], centre_wander_px[2], pupil_travel_mm;
    double distortion_wide[3], distortion_tele[3], decentring_wide_px[2], decentring_tele_px[2];
    double nearest_focus_mm, focus_drift_per_m;
};
struct mount_truth {
    double pupil_mm[3], turn_deg[3], axis_point_mm[3], axis_direction[3];
};

extern const lens_truth lens[2];
extern const mount_truth mount[2];

/// A camera by the simulated rig's formulas. `ripple` false: without the cam's ripple.
struct camera_truth {
    double f_px, image_distance_px, centre_px[2], k[3], p[2], pupil_mm;
    double R_world_camera[9], position_mm[3];
};
camera_truth truth_at(int side, double zoom, double focus, double pan_rad, bool ripple);

/// The smooth part as a calibration, with the covariance of a good one (independent parameters).
std::unique_ptr<zoom_calibration> calibration();

/// The state with both cameras at the same zoom, focused at and turned to `distance_mm` ahead.
zoom_state state(double zoom, double distance_mm);

}  // namespace zoom_rig

#endif
