// SPDX-License-Identifier: Apache-2.0
#include "calib/zoom/zoom_solve.hpp"

#include "calib/zoom/zoom_check.hpp"
#include "calib/zoom/zoom_order.hpp"
#include "core/invariant.h"

namespace calib {

namespace {

const double LOSS = 3, FIRST_LOSS = 30;
const double FIXED_AXES = 0.03;  // share of their standard deviations
const int VARIANCE_ROUNDS = 12, CLEANING_ROUNDS = 6;

class zoom_solver {
  public:
    zoom_solver(const zoom_observations &seen, const zoom_options &options)
        : seen_(seen), options_(options) {}

    zoom_solution run() {
        result_.failure = make_problem(seen_, &result_.problem);
        if (!result_.failure.empty()) {
            return result_;
        }
        result_.settings = solve_each(seen_, result_.problem, options_.threads, [this](int, int) {
            show_stage("calibrating each zoom alone");
        });
        if (!draw_straight_lines() || options_.paper) {
            return result_;
        }
        const zoom_orders orders = richest_orders(result_.problem);
        result_.failure =
            seed_zoom(seen_, result_.settings, &result_.problem, orders, &result_.estimate);
        if (!result_.failure.empty()) {
            return result_;
        }
        result_.layout = zoom_layout(result_.problem, orders);
        result_.prior = wide_prior(result_.problem, result_.layout, result_.estimate);
        fit_with_fixed_axes();
        fit(LOSS, 60);
        clean();
        estimate_variances();
        choose();
        estimate_variances();
        // With the variances known, the limits are those of the final model.
        if (reject_outliers()) {
            estimate_variances();
        }
        widen();
        describe_zoom(&result_);
        check_rig(&result_);
        check_fit(&result_);
        if (options_.leave_out) {
            check_left_out(&result_, options_.threads,
                           [this] { show_stage("predicting zooms that are left out"); });
        }
        return result_;
    }

  private:
    // Error bars cover what the corners' own noise does not explain.
    void widen() {
        const double ratio = result_.noise_ratio;
        result_.covariance.shared *= ratio > 1 ? ratio * ratio : 1;
    }

    // The paper's way. False: there is nothing to draw lines through.
    bool draw_straight_lines() {
        const zoom_orders orders = {2, 1, 2, 2, 2, 2, 0, 2, 2, 0};
        zoom_solution lines;
        lines.problem = result_.problem;
        lines.settings = result_.settings;
        lines.failure = seed_zoom(seen_, lines.settings, &lines.problem, orders, &lines.estimate);
        result_.failure = lines.failure;
        if (!lines.failure.empty()) {
            return false;
        }
        lines.layout = zoom_layout(lines.problem, orders);
        lines.prior = wide_prior(lines.problem, lines.layout, lines.estimate);
        lines.covariance.shared = matrix::Zero(lines.layout.size(), lines.layout.size());
        describe_zoom(&lines);
        if (options_.paper) {
            result_ = lines;
        }
        result_.paper = lines.rig;
        return true;
    }

    void show_stage(const char *what) const {
        if (options_.progress) {
            options_.progress(what);
        }
    }

    zoom_weights weights(double loss) const { return {loss, options_.threads}; }

    void fit(double loss, int iterations) {
        fit_zoom(
            result_.problem, result_.layout, result_.prior, weights(loss), iterations,
            [this] { show_stage("solving all zooms together"); }, &result_.estimate);
    }

    // From far off. Free pan axes, which corners determine badly, would be led astray by outliers;
    // the wide loss keeps a setting from being drawn to its one wrong picture.
    void fit_with_fixed_axes() {
        const zoom_prior prior = result_.prior;
        for (int camera = 0; camera < CAMERAS; camera++) {
            for (int i = ZOOM_AXIS_DIRECTION_X; i <= ZOOM_PAN_SCALE; i++) {
                result_.prior.sigma[size_t(result_.layout.mount_at(camera, i))] *= FIXED_AXES;
            }
        }
        fit(FIRST_LOSS, 30);
        result_.prior = prior;
    }

    bool reject_outliers() {
        const double scale = zoom_robust_scale(result_.problem, result_.layout, result_.estimate);
        return assess_zoom(&result_.problem, result_.layout, result_.estimate, scale,
                           &result_.rejections);
    }

    void clean() {
        for (int round = 0; round < CLEANING_ROUNDS && reject_outliers(); round++) {
            show_stage("rejecting outliers");
            fit(LOSS, 20);
        }
    }

    void choose() {
        const zoom_orders orders = choose_orders(
            result_.problem, result_.layout, result_.prior, weights(0), result_.estimate,
            [this] { show_stage("choosing the lens functions' terms"); });
        const zoom_layout layout(result_.problem, orders);
        result_.estimate.shared = with_orders(result_.layout, result_.estimate.shared, layout, 0);
        result_.prior.mean = with_orders(result_.layout, result_.prior.mean, layout, 0);
        result_.prior.sigma = with_orders(result_.layout, result_.prior.sigma, layout, 1);
        result_.layout = layout;
    }

    void estimate_variances() {
        for (int round = 0; round < VARIANCE_ROUNDS; round++) {
            fit(0, 20);
            result_.covariance = covariance_of(result_.problem, result_.layout, result_.prior,
                                               weights(0), result_.estimate);
            const double change =
                update_variances(result_.problem, result_.layout, result_.estimate,
                                 result_.covariance, &result_.prior);
            if (change < 0.1) {
                break;
            }
        }
        fit(0, 20);
        result_.covariance = covariance_of(result_.problem, result_.layout, result_.prior,
                                           weights(0), result_.estimate);
        result_.noise_ratio = corner_noise_ratio(result_.problem, result_.layout, result_.prior,
                                                 result_.estimate, result_.covariance);
    }

    const zoom_observations &seen_;
    const zoom_options &options_;
    zoom_solution result_;
};

}  // namespace

zoom_solution solve_zoom(const zoom_observations &seen, const zoom_options &options) {
    return zoom_solver(seen, options).run();
}

}  // namespace calib
