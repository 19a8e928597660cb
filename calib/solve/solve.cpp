// SPDX-License-Identifier: Apache-2.0
#include "calib/solve/solve.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/bundle/bundle.hpp"
#include "calib/solve/model_choice.hpp"
#include "calib/solve/noise_floor.hpp"
#include "calib/solve/robust.hpp"
#include "calib/solve/solve_fit.hpp"
#include "calib/solve/solve_input.hpp"
#include "calib/solve/solve_result.hpp"
#include "calib/solve/solve_start.hpp"
#include "calib/solve/solve_verdict.hpp"
#include "calib/solve/uncertainty.hpp"
#include "core/invariant.h"

namespace calib {

namespace {

const int CLEANING_ROUNDS = 8, FINAL_ROUNDS = 4;
const int WARP_FROM = 6;  // board positions
const double SCATTERED_Z = 4;
const double MIN_SCATTER_PX = 1e-3;  // rounding also scatters
const double MISFIT_PX = 0.5;        // a larger floor of the noise is a misfit
const double AGREE_SIGMAS = 0.05;    // two starts whose results are closer than this agree

int count_views(const bundle &data, int camera) {
    int views = 0;
    for (const auto &capture : data.captures) {
        views += capture[size_t(camera)].used;
    }
    return views;
}

int fewest_views(const bundle &data) {
    return data.cameras == 1 ? count_views(data, LEFT)
                             : std::min(count_views(data, LEFT), count_views(data, RIGHT));
}

// The model used while outliers are searched: rich enough that no good corner looks like one.
bundle_options cleaning_options(const bundle &data, bool equidistant) {
    const int views = fewest_views(data);
    if (views < MIN_FOR_CHOICE) {
        return options_of(
            equidistant ? lens_model{lens_model::EQUIDISTANT, true} : basic_model().model,
            basic_model().target, LOSS);
    }
    const bool shape = views >= WARP_FROM;
    return options_of({equidistant ? lens_model::EQUIDISTANT : lens_model::K1_K2_P1_P2, false},
                      {shape, shape}, LOSS);
}

// The share of the residuals that a fit leaves.
double freedom_share(const bundle &data, const bundle_options &options) {
    INVARIANT(data.cameras == 1 || data.cameras == CAMERAS);
    double residuals = 0, parameters = 0;
    for (const bool one : options.free_lens) {
        parameters += one ? data.cameras : 0;
    }
    for (size_t i = 0; i < data.captures.size(); i++) {
        parameters += data.used(i) ? POSE_PARAMETERS : 0;
        for (const bundle_view &view : data.captures[i]) {
            residuals += view.used ? 2 * view.used_count() : 0;
        }
    }
    return std::max(1 - parameters / std::max(residuals, 1.0), 0.1);
}

// Robust scale, corrected for what the fit absorbed from the residuals.
double noise_scale(const bundle &data, const bundle_state &state, const bundle_options &options) {
    INVARIANT(state.T_left_board.size() == data.captures.size());
    return robust_scale(data, state) / std::sqrt(freedom_share(data, options));
}

class solver {
  public:
    solver(const observations &seen, const solve_options &options)
        : seen_(seen),
          options_(options),
          ordered_(order_observations(seen)),
          floor_(ordered_.data) {}

    solution run() {
        records_ = inspect_views(&data());
        INVARIANT(records_.size() == data().captures.size());
        show_stage("initial solution");
        const std::string failure = begin(1, 1, wide_start_of(), records_, &data(), &state_);
        if (!failure.empty()) {
            return failed(failure);
        }
        INVARIANT(state_.T_left_board.size() == data().captures.size());
        started_wide_ = state_.lens[LEFT].kind == LENS_EQUIDISTANT;
        clean();
        const int fewest = fewest_views(data());
        if (fewest < 3) {
            return failed("too few boards: outlier rejection left only " + std::to_string(fewest) +
                          (fewest == 1 ? " usable view" : " usable views") + " of one camera");
        }
        const bool few = fewest < MIN_FOR_CHOICE;
        choose();
        finish();
        if (few && fewest_views(data()) >= MIN_FOR_CHOICE) {  // some views are right after all
            choose();
            finish();
        }
        show_stage("second start");
        const start_test again = options_.second_start ? start_again() : start_test{};
        return report(error_model(data(), final_options(), state_), again);
    }

  private:
    bundle &data() { return ordered_.data; }

    void show_stage(const char *what) const {
        if (options_.progress) {
            options_.progress(what);
        }
    }

    solution failed(const std::string &reason) {
        solution result = describe(seen_, ordered_, records_, state_);
        result.verdict =
            rejection(is_wider_than_model()
                          ? "the lenses are wider than --model can describe: omit it; " + reason
                          : reason);
        return result;
    }

    bool is_model_given() const {
        return !options_.choose_model || options_.distortion.has_value();
    }

    // A given model that is none of those for wide lenses leaves out many views of one, or fits
    // none well.
    bool is_wider_than_model() {
        int views = 0, used = 0;
        for (const auto &capture : data().captures) {
            for (const bundle_view &view : capture) {
                views += !view.empty();
                used += view.used;
            }
        }
        if (!is_model_given() || wide_start_of() != wide_start::NEVER ||
            (4 * used > 3 * views && floor_.px() < MISFIT_PX)) {
            return false;
        }
        bundle all = order_observations(seen_).data;
        const view_records records = inspect_views(&all);
        bundle_state state;
        return begin(1, 1, wide_start::IF_BETTER, records, &all, &state).empty() &&
               state.lens[LEFT].kind == LENS_EQUIDISTANT;
    }

    // A model that is asked for decides on the start, too.
    wide_start wide_start_of() const {
        const lens_model::kind asked = options_.choose_model
                                           ? options_.distortion.value_or(lens_model::RATIONAL)
                                           : options_.model.distortion;
        if (asked == lens_model::EQUIDISTANT) {
            return wide_start::ALWAYS;
        }
        return asked == lens_model::RATIONAL ? wide_start::IF_BETTER : wide_start::NEVER;
    }

    std::string begin(double left_factor, double right_factor, wide_start wide,
                      const view_records &records, bundle *data, bundle_state *state) {
        start_options start;
        start.wide = wide;
        start.threads = options_.threads;
        start.focal_factor[LEFT] = left_factor;
        start.focal_factor[RIGHT] = right_factor;
        start.robust = cleaning_options(*data, false);
        start.robust_wide = cleaning_options(*data, true);
        return find_start(data, records, start, state);
    }

    void clean() {
        for (int round = 0; round < CLEANING_ROUNDS; round++) {
            show_stage("rejecting outliers");
            bundle_options options = cleaning_options(data(), started_wide_);
            floor_.update(state_, freedom_share(data(), options), &data());
            const double scale = noise_scale(data(), state_, options);
            INVARIANT(scale > 0);
            const bool changed = assess(&data(), &state_, seen_.target, scale, &records_);
            options.loss_scale = LOSS * scale;
            options.tolerance = ROUGH_TOLERANCE;
            adjust(data(), options, &state_);
            if (!changed && round > 0) {
                break;
            }
        }
    }

    void choose() {
        if (!options_.choose_model) {
            chosen_ = {options_.model, options_.target};
        } else if (fewest_views(data()) < MIN_FOR_CHOICE) {
            chosen_ = basic_model();
            chosen_.model.distortion = options_.distortion.value_or(
                started_wide_ ? lens_model::EQUIDISTANT : chosen_.model.distortion);
        } else {
            const model_choice choice =
                choose_model(data(), state_, options_.distortion, options_.threads,
                             [this] { show_stage("choosing the model"); });
            chosen_ = choice.chosen;
            state_ = choice.state;
            scores_ = choice.scores;
            INVARIANT(!scores_.empty() && state_.T_left_board.size() == data().captures.size());
            held_out_rms_px_ = choice.held_out_rms_px;
            return;
        }
        forget_absent(data(), chosen_, &state_);
    }

    bundle_options final_options() const { return options_of(chosen_.model, chosen_.target, 0); }

    // Least squares on the good data, until the set of good data does not change.
    void finish() {
        const bundle_options options = final_options();
        floor_.update(state_, freedom_share(data(), options), &data());
        adjust(data(), options, &state_);
        for (int round = 0; round < FINAL_ROUNDS; round++) {
            bundle_state assessed = state_;
            const double scale = noise_scale(data(), state_, options);
            if (!assess(&data(), &assessed, seen_.target, scale, &records_)) {
                break;
            }
            state_ = assessed;
            adjust(data(), options, &state_);
        }
    }

    // Solves again from other focal lengths; if the results differ, the better one is kept.
    start_test start_again() {
        const error_model errors(data(), final_options(), state_);
        bundle copy = data();
        bundle_state other = state_;
        INVARIANT(other.T_left_board.size() == copy.captures.size());
        start_test result;
        result.done = true;
        const wide_start wide = started_wide_ ? wide_start::ALWAYS : wide_start::NEVER;
        if (!begin(1.35, 0.75, wide, records_, &copy, &other).empty()) {
            return result;
        }
        for (size_t i = 0; i < copy.captures.size(); i++) {
            if (!copy.used(i)) {
                other.T_left_board[i] = state_.T_left_board[i];
            }
        }
        forget_absent(data(), chosen_, &other);
        const double other_cost = adjust(data(), final_options(), &other).cost;
        const double own_cost = adjust(data(), final_options(), &state_).cost;
        result.cost_ratio = own_cost > 0 ? other_cost / own_cost : 1;
        for (int camera = 0; camera < data().cameras; camera++) {
            const double difference = std::fabs(other.lens[camera].value[LOG_FOCAL] -
                                                state_.lens[camera].value[LOG_FOCAL]);
            const double sigma = std::max(errors.lens_sigma(camera, LOG_FOCAL), 1e-9);
            result.focal_difference_sigma =
                std::max(result.focal_difference_sigma, difference / sigma);
        }
        result.agrees = result.focal_difference_sigma < AGREE_SIGMAS;
        if (!result.agrees && other_cost < own_cost) {
            state_ = other;
        }
        return result;
    }

    // Error bars including model misfit and scatter.
    error_model widened(const error_model &errors, double rms_px, fit_test *fit) {
        error_model result = errors;
        fit->scatter_ratio = errors.scatter_ratio();
        INVARIANT(fit->scatter_ratio >= 1 && fit->widened >= 1);
        fit->scatter_z = errors.scatter_z();
        fit->scattered = errors.scatter_z() > SCATTERED_Z && rms_px > MIN_SCATTER_PX;
        if (fit->scattered) {
            const double by_scatter = std::sqrt(errors.scatter_ratio());
            result.use_scatter();
            fit->widened = std::max(fit->widened, by_scatter);
            result.widen(fit->widened / by_scatter);
        } else {
            result.widen(fit->widened);
        }
        // Which side of a stretched print has the stated size is unknown.
        result.doubt_scale(0.5 * print_stretch(data(), state_));
        return result;
    }

    solution report(const error_model &errors, const start_test &again) {
        solution result = describe(seen_, ordered_, records_, state_);
        result.solved = true;
        result.model = chosen_.model;
        result.model_given = is_model_given();
        result.wider_than_model = is_wider_than_model();
        result.target = chosen_.target;
        result.scores = scores_;
        result.held_out_rms_px = held_out_rms_px_;
        result.fit = test_fit(data(), state_, errors.sigma0());
        result.fit.sigma_ratio = floor_.ratio();
        INVARIANT(floor_.px() >= 0 && floor_.ratio() >= 0);
        result.fit.floor_px = floor_.px();
        const error_model honest = widened(errors, result.rms_px, &result.fit);
        describe_errors(data(), state_, honest, &result);
        result.second_start = again;
        result.verdict = assess_solution(data(), state_, result);
        return result;
    }

    const observations &seen_;
    const solve_options &options_;
    ordered_bundle ordered_;
    noise_floor floor_;
    view_records records_;
    bundle_state state_;
    bool started_wide_ = false;
    model_candidate chosen_;
    std::vector<model_score> scores_;
    double held_out_rms_px_ = 0;
};

}  // namespace

solution solve(const observations &seen, const solve_options &options) {
    const std::string fault = check_observations(seen);
    if (!fault.empty()) {
        solution result;
        result.verdict = rejection(fault);
        return result;
    }
    return solver(seen, options).run();
}

}  // namespace calib
