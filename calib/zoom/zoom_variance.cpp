// SPDX-License-Identifier: Apache-2.0
#include "calib/zoom/zoom_variance.hpp"

#include <algorithm>
#include <cmath>

#include "core/invariant.h"

namespace calib {

namespace {

// Sum of squares and of posterior variances of deviations that have one common variance.
struct spread {
    double squares = 0, posterior = 0;
    int count = 0;

    void add(double value, double variance) {
        squares += value * value;
        posterior += variance;
        count++;
    }

    // The next standard deviation after `sigma`, at most a factor of 4 from it.
    double next(double sigma, double min) const {
        if (count == 0) {
            return sigma;
        }
        const double determined = count - posterior / (sigma * sigma);
        const double likely =
            determined > 0.2 * count ? squares / determined : (squares + posterior) / count;
        return std::max(min, std::clamp(std::sqrt(likely), sigma / 4, sigma * 4));
    }
};

// Deviations smaller than these do not matter.
const double MIN_EFFECT[ZOOM_FUNCTIONS] = {0.1, 0.02, 0.02, 0.01, 0.01, 0.01, 0.01, 0.01, 0.01};
const zoom_latents MIN_LATENT = {0.002, 0.01, 0.01, 5e-7};

// `all`: covariance of the place's parameters.
void add_latents(const view_latents &view, const matrix &all, const zoom_prior &prior,
                 zoom_covariance *sum) {
    const long count = long(view.at.size());
    matrix near(count, count);
    for (long i = 0; i < count; i++) {
        for (long k = 0; k < count; k++) {
            near(i, k) = all(view.at[size_t(i)], view.at[size_t(k)]);
        }
    }
    const matrix own = view.inverse + carried(product(view.inverse, view.mixed), near);
    for (size_t i = 0; i < LATENTS; i++) {
        const double sigma = prior.latent_sigma[size_t(view.camera)][i];
        const double variance = own(long(i), long(i));
        sum->latent_variance[view.capture][size_t(view.camera)][i] = variance;
        sum->own_freedom += 1 - variance / (sigma * sigma);
    }
}

}  // namespace

zoom_covariance covariance_of(const zoom_problem &problem, const zoom_layout &layout,
                              const zoom_prior &prior, const zoom_weights &weights,
                              const zoom_estimate &estimate) {
    const std::vector<place_equations> places =
        all_equations(problem, layout, prior, weights, estimate);
    zoom_covariance result;
    result.shared = scaled_inverse(reduced(places, layout, prior, estimate.shared, 0).normal);
    result.latent_variance.assign(problem.captures.size(), {});
    for (size_t k = 0; k < places.size(); k++) {
        const place_equations &place = places[k];
        if (place.empty()) {
            continue;
        }
        const long count = place.shared_count(), own_count = place.own_count();
        const matrix inverse = scaled_inverse(place.normal.bottomRightCorner(own_count, own_count));
        matrix here(count, count);
        for (long i = 0; i < count; i++) {
            for (long j = 0; j < count; j++) {
                here(i, j) = result.shared(place.columns[size_t(i)], place.columns[size_t(j)]);
            }
        }
        const matrix by_shared = product(inverse, place.normal.bottomLeftCorner(own_count, count));
        matrix all(count + own_count, count + own_count);
        all.topLeftCorner(count, count) = here;
        all.bottomLeftCorner(own_count, count) = -product(by_shared, here);
        all.topRightCorner(count, own_count) = all.bottomLeftCorner(own_count, count).transpose();
        all.bottomRightCorner(own_count, own_count) = inverse + carried(by_shared, here);
        result.own_freedom += int(POSE_PARAMETERS);
        for (const view_latents &view : place.latents) {
            add_latents(view, all, prior, &result);
        }
    }
    return result;
}

namespace {

// Deviations of one function at all settings. Both lenses are of one kind.
double update_effects(const zoom_layout &layout, const zoom_estimate &estimate,
                      const zoom_covariance &covariance, int function, zoom_prior *prior) {
    spread all;
    std::vector<int> places;
    for (int camera = 0; camera < CAMERAS; camera++) {
        for (int k = 0; k < layout.settings(camera); k++) {
            const int at = layout.effect_at(camera, function, k);
            if (at >= 0) {
                all.add(estimate.shared[size_t(at)], covariance.shared(at, at));
                places.push_back(at);
            }
        }
    }
    if (places.empty()) {
        return 0;
    }
    const double sigma = prior->sigma[size_t(places[0])];
    const double next = all.next(sigma, MIN_EFFECT[function]);
    for (const int at : places) {
        prior->sigma[size_t(at)] = next;
    }
    return std::fabs(std::log(next / sigma));
}

double update_latent(const zoom_problem &problem, const zoom_estimate &estimate,
                     const zoom_covariance &covariance, size_t camera, size_t latent,
                     zoom_prior *prior) {
    spread all;
    for (size_t i = 0; i < problem.captures.size(); i++) {
        if (problem.captures[i].view[camera].used) {
            all.add(estimate.latent[i][camera][latent],
                    covariance.latent_variance[i][camera][latent]);
        }
    }
    double &sigma = prior->latent_sigma[camera][latent];
    const double before = sigma;
    sigma = all.next(sigma, MIN_LATENT[latent]);
    return std::fabs(std::log(sigma / before));
}

}  // namespace

double update_variances(const zoom_problem &problem, const zoom_layout &layout,
                        const zoom_estimate &estimate, const zoom_covariance &covariance,
                        zoom_prior *prior) {
    double change = 0;
    for (int function = 0; function < ZOOM_FUNCTIONS; function++) {
        change = std::max(change, update_effects(layout, estimate, covariance, function, prior));
    }
    for (size_t latent = 0; latent < LATENTS && prior->has_latents(); latent++) {
        for (size_t camera = 0; camera < CAMERAS; camera++) {
            change = std::max(change,
                              update_latent(problem, estimate, covariance, camera, latent, prior));
        }
    }
    return change;
}

double corner_noise_ratio(const zoom_problem &problem, const zoom_layout &layout,
                          const zoom_prior &prior, const zoom_estimate &estimate,
                          const zoom_covariance &covariance) {
    double squares = 0, freedom = covariance.own_freedom;
    long residuals = 0;
    for (size_t i = 0; i < problem.captures.size(); i++) {
        for (int camera = 0; camera < CAMERAS; camera++) {
            const bundle_view &view = problem.captures[i].view[size_t(camera)];
            if (!view.used) {
                continue;
            }
            const posed_camera posed = fitted_camera(problem, layout, estimate, i, camera);
            for (const bundle_corner &corner : view.corners) {
                double r[2];
                if (corner.used &&
                    zoom_residual(problem, layout, estimate, posed, i, camera, corner, r)) {
                    squares += (r[0] * r[0] + r[1] * r[1]) / (corner.sigma_px * corner.sigma_px);
                    residuals += 2;
                }
            }
        }
    }
    for (size_t i = 0; i < prior.sigma.size(); i++) {
        freedom += std::max(
            0.0, 1 - covariance.shared(long(i), long(i)) / (prior.sigma[i] * prior.sigma[i]));
    }
    INVARIANT(residuals > 0);
    return std::sqrt(squares / std::max(1.0, double(residuals) - freedom));
}

}  // namespace calib
