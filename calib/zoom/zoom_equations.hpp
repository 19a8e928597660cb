// SPDX-License-Identifier: Apache-2.0
/// Normal equations of the zoom rig, and the least-squares solution by Levenberg and Marquardt's
/// method. The parameters of each board position are eliminated, so that one solution costs as
/// much as the shared parameters demand.
#ifndef VERGENCE_CALIB_ZOOM_ZOOM_EQUATIONS_HPP
#define VERGENCE_CALIB_ZOOM_ZOOM_EQUATIONS_HPP

#include <functional>
#include <vector>

#include "calib/base/linear.hpp"
#include "calib/zoom/zoom_view.hpp"

namespace calib {

/// The latents of one view, which only this view depends on. The equations hold without them:
/// they are -inverse (gradient + mixed x) where x are the changes of parameters `at`.
struct view_latents {
    size_t capture;
    int camera;
    std::vector<int> at;  // indices among the parameters of the place
    matrix inverse, mixed;
    vector gradient;
};

/// Equations of one board position. Its parameters are shared ones (`columns`), then its pose.
struct place_equations {
    std::vector<int> columns;
    std::vector<view_latents> latents;
    matrix normal;
    vector gradient;
    double squares = 0;  // sum of squared residuals in sigmas, after the loss
    long residuals = 0;

    bool empty() const { return residuals == 0; }
    long shared_count() const { return long(columns.size()); }
    long own_count() const { return normal.rows() - shared_count(); }
};

struct zoom_weights {
    double loss_scale = 0;  // Cauchy's, in standard deviations; 0: least squares
    int threads = 1;
};

/// Called with the index of a capture; false: it is left out. Empty: all count.
using zoom_filter = std::function<bool(size_t)>;

/// Those of all places, computed in parallel.
std::vector<place_equations> all_equations(const zoom_problem &problem, const zoom_layout &layout,
                                           const zoom_prior &prior, const zoom_weights &weights,
                                           const zoom_estimate &estimate,
                                           const zoom_filter &filter = nullptr);

/// The shared parameters' equations, with the prior: `matrix` and `gradient` at the estimate.
struct shared_equations {
    matrix normal;
    vector gradient;
};
shared_equations reduced(const std::vector<place_equations> &places, const zoom_layout &layout,
                         const zoom_prior &prior, const std::vector<double> &shared,
                         double damping);
void add_reduced(const place_equations &place, double damping, double sign, shared_equations *sum);

/// Half of the sum of squares of residuals and prior.
double cost_of(const zoom_problem &problem, const zoom_layout &layout, const zoom_prior &prior,
               const zoom_weights &weights, const zoom_estimate &estimate);

struct zoom_fit_summary {
    bool converged = false;
    double cost = 0;
    int iterations = 0;
};

/// Minimises from `estimate`, storing the result there. `between` is called before each step and
/// may throw.
zoom_fit_summary fit_zoom(const zoom_problem &problem, const zoom_layout &layout,
                          const zoom_prior &prior, const zoom_weights &weights, int max_iterations,
                          const std::function<void()> &between, zoom_estimate *estimate);

/// Inverse of symmetric equations with their diagonal scaled to 1.
matrix scaled_inverse(const matrix &A);
vector scaled_solution(const matrix &A, const vector &b);

}  // namespace calib

#endif
