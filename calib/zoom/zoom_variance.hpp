// SPDX-License-Identifier: Apache-2.0
/// How much lenses deviate from smooth curves and views from each other, estimated from the data.
#ifndef VERGENCE_CALIB_ZOOM_ZOOM_VARIANCE_HPP
#define VERGENCE_CALIB_ZOOM_ZOOM_VARIANCE_HPP

#include "calib/zoom/zoom_equations.hpp"

namespace calib {

/// Covariance at a least-squares solution.
struct zoom_covariance {
    matrix shared;
    // Variances of the latents by capture.
    std::vector<std::array<zoom_latents, CAMERAS>> latent_variance;
    double own_freedom = 0;  // parameters of the places that the data determine
};

zoom_covariance covariance_of(const zoom_problem &problem, const zoom_layout &layout,
                              const zoom_prior &prior, const zoom_weights &weights,
                              const zoom_estimate &estimate);

/// One step towards the most likely variances of deviations and latents: a fixed point of the
/// marginal likelihood. Returns the largest relative change of a standard deviation.
/// Source: D. MacKay, "Bayesian interpolation", 1992, section 4.3.
double update_variances(const zoom_problem &problem, const zoom_layout &layout,
                        const zoom_estimate &estimate, const zoom_covariance &covariance,
                        zoom_prior *prior);

/// Standard deviation of the used corners' residuals over their sigmas.
double corner_noise_ratio(const zoom_problem &problem, const zoom_layout &layout,
                          const zoom_prior &prior, const zoom_estimate &estimate,
                          const zoom_covariance &covariance);

}  // namespace calib

#endif
