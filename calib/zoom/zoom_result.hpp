// SPDX-License-Identifier: Apache-2.0
/// The solution of a zoom rig, and its form as a `zoom_calibration`.
#ifndef VERGENCE_CALIB_ZOOM_ZOOM_RESULT_HPP
#define VERGENCE_CALIB_ZOOM_ZOOM_RESULT_HPP

#include <memory>
#include <string>
#include <vector>

#include "calib/zoom/zoom_robust.hpp"
#include "calib/zoom/zoom_seed.hpp"
#include "calib/zoom/zoom_variance.hpp"

namespace calib {

struct zoom_solution {
    std::string failure;  // "" when solved
    zoom_problem problem;
    zoom_layout layout;
    zoom_prior prior;
    zoom_estimate estimate;
    zoom_covariance covariance;
    std::vector<zoom_setting> settings;  // each alone
    std::vector<zoom_rejection> rejections;
    double noise_ratio = 0;  // residuals over the sigmas given with the corners
    double rms_px = 0;
    std::vector<std::string> warnings;  // what speaks against it, most important first
    /// Without id, date, note and instrument.
    std::shared_ptr<zoom_calibration> rig;
    /// For comparison: f and all else on straight lines through the settings alone.
    std::shared_ptr<zoom_calibration> paper;
};

/// Fills `rig` from problem, estimate and covariance.
void describe_zoom(zoom_solution *solution);

}  // namespace calib

#endif
