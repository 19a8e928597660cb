// SPDX-License-Identifier: Apache-2.0
#include "calib/zoom/zoom_order.hpp"

#include <algorithm>
#include <cmath>

#include "calib/solve/solve_parallel.hpp"
#include "core/invariant.h"

namespace calib {

namespace {

// Functions that have the same number of terms, and the fewest of them that make sense.
struct order_group {
    int first, second;  // -1: none
    int min;
};

const order_group GROUPS[] = {{ZOOM_FOCAL, -1, 2},    {ZOOM_CENTRE_X, ZOOM_CENTRE_Y, 1},
                              {ZOOM_RADIAL_2, -1, 1}, {ZOOM_RADIAL_4, -1, 0},
                              {ZOOM_RADIAL_6, -1, 0}, {ZOOM_TANGENTIAL_1, ZOOM_TANGENTIAL_2, 0},
                              {ZOOM_PUPIL, -1, 0},    {ZOOM_FOCUS_DIOPTRE, -1, 1}};

// Equations of the terms, mounts and other parameters that are not deviations of settings.
struct quadratic {
    matrix normal;
    vector gradient;
};

// The deviations `from` on are eliminated; their prior must be in the equations.
quadratic without_effects(const shared_equations &sum, long from) {
    const long count = sum.normal.rows() - from;
    const matrix mixed = sum.normal.topRightCorner(from, count);
    const matrix inverse = scaled_inverse(sum.normal.bottomRightCorner(count, count));
    const matrix across = product(mixed, inverse);
    return {sum.normal.topLeftCorner(from, from) - product(across, mixed.transpose()),
            sum.gradient.head(from) - across * sum.gradient.tail(count)};
}

// One setting left out: what the others say and what it says itself.
struct fold {
    quadratic train, test;
};

class chooser {
  public:
    chooser(const zoom_problem &problem, const zoom_layout &layout, const zoom_prior &prior,
            const zoom_weights &weights, const zoom_estimate &estimate)
        : problem_(problem),
          layout_(layout),
          prior_(prior),
          weights_(weights),
          estimate_(estimate),
          from_(layout.first_effect()) {}

    zoom_orders run(const std::function<void()> &between) {
        const int settings = layout_.settings(LEFT);
        folds_.resize(size_t(std::max(0, settings - 2)));
        zoom_weights alone = weights_;
        alone.threads = 1;
        parallel_pieces(
            weights_.threads, int(folds_.size()),
            [&](int k) { folds_[size_t(k)] = fold_of(k + 1, alone); }, between);
        zoom_orders orders = layout_.orders();
        for (int round = 0; round < 3 && !folds_.empty(); round++) {
            const zoom_orders before = orders;
            for (const order_group &group : GROUPS) {
                if (between) {
                    between();
                }
                choose(group, &orders);
            }
            if (orders == before) {
                break;
            }
        }
        return orders;
    }

  private:
    fold fold_of(int setting, const zoom_weights &weights) const {
        fold result;
        for (const bool train : {true, false}) {
            const auto filter = [&](size_t capture) {
                return (problem_.captures[capture].setting[LEFT] != setting) == train;
            };
            const std::vector<place_equations> places =
                all_equations(problem_, layout_, prior_, weights, estimate_, filter);
            zoom_prior prior = prior_;
            for (long i = 0; i < from_ && !train; i++) {
                prior.sigma[size_t(i)] = INFINITY;
            }
            (train ? result.train : result.test) =
                without_effects(reduced(places, layout_, prior, estimate_.shared, 0), from_);
        }
        return result;
    }

    // Costs of the left-out settings, up to the same constants for all orders.
    std::vector<double> scores(const zoom_orders &orders) const {
        std::vector<bool> free(size_t(from_), true);
        for (int camera = 0; camera < CAMERAS; camera++) {
            for (int function = 0; function < ZOOM_FUNCTIONS; function++) {
                const int first = layout_.terms_at(camera, function);
                const int fewer = orders[size_t(function)] - (function == ZOOM_PUPIL ? 1 : 0);
                for (int i = std::max(0, fewer); i < layout_.estimated_terms(function); i++) {
                    free[size_t(first + i)] = false;
                }
            }
        }
        std::vector<long> kept, gone;
        for (long i = 0; i < from_; i++) {
            (free[size_t(i)] ? kept : gone).push_back(i);
        }
        std::vector<double> result;
        for (const fold &one : folds_) {
            result.push_back(score(one, kept, gone));
        }
        return result;
    }

    double score(const fold &one, const std::vector<long> &kept,
                 const std::vector<long> &gone) const {
        vector step = vector::Zero(from_);
        for (const long i : gone) {
            step[i] = -estimate_.shared[size_t(i)];
        }
        const vector gradient = one.train.gradient + one.train.normal * step;
        const long count = long(kept.size());
        matrix A(count, count);
        vector b(count);
        for (long i = 0; i < count; i++) {
            b[i] = -gradient[kept[size_t(i)]];
            for (long k = 0; k < count; k++) {
                A(i, k) = one.train.normal(kept[size_t(i)], kept[size_t(k)]);
            }
        }
        const vector solved = scaled_solution(A, b);
        for (long i = 0; i < count; i++) {
            step[kept[size_t(i)]] = solved[i];
        }
        return 0.5 * step.dot(one.test.normal * step) + one.test.gradient.dot(step);
    }

    void choose(const order_group &group, zoom_orders *orders) const {
        const int max = layout_.orders()[size_t(group.first)];
        std::vector<std::vector<double>> all;
        std::vector<double> sums;
        std::vector<int> tried;
        for (int order = group.min; order <= max; order++) {
            if (group.first == ZOOM_PUPIL && order == 1) {
                continue;  // the pupil has no constant term
            }
            zoom_orders other = *orders;
            other[size_t(group.first)] = order;
            if (group.second >= 0) {
                other[size_t(group.second)] = order;
            }
            all.push_back(scores(other));
            double sum = 0;
            for (const double one : all.back()) {
                sum += one;
            }
            sums.push_back(sum);
            tried.push_back(order);
        }
        if (all.empty()) {
            return;
        }
        const size_t best = size_t(std::min_element(sums.begin(), sums.end()) - sums.begin());
        for (size_t i = 0; i <= best; i++) {
            if (i == best || is_as_good(all[i], all[best])) {
                (*orders)[size_t(group.first)] = tried[i];
                if (group.second >= 0) {
                    (*orders)[size_t(group.second)] = tried[i];
                }
                return;
            }
        }
    }

    static bool is_as_good(const std::vector<double> &one, const std::vector<double> &best) {
        const double count = double(one.size());
        double mean = 0, squares = 0;
        for (size_t i = 0; i < one.size(); i++) {
            mean += (one[i] - best[i]) / count;
        }
        for (size_t i = 0; i < one.size(); i++) {
            squares += (one[i] - best[i] - mean) * (one[i] - best[i] - mean);
        }
        // The last term: a tenth of a standard deviation of one corner does not count.
        return mean <= std::sqrt(squares / std::max(1.0, count * (count - 1))) || mean < 0.005;
    }

    const zoom_problem &problem_;
    const zoom_layout &layout_;
    const zoom_prior &prior_;
    const zoom_weights &weights_;
    const zoom_estimate &estimate_;
    const long from_;
    std::vector<fold> folds_;
};

}  // namespace

zoom_orders richest_orders(const zoom_problem &problem) {
    const zoom_orders richest = {7, 3, 6, 6, 6, 6, 5, 5, 5, 5};
    const int settings =
        int(std::min(problem.side[LEFT].settings.size(), problem.side[RIGHT].settings.size()));
    zoom_orders orders;
    for (size_t function = 0; function < ZOOM_FUNCTIONS; function++) {
        orders[function] = std::min(richest[function], std::max(2, settings / 2 + 1));
    }
    return orders;
}

zoom_orders choose_orders(const zoom_problem &problem, const zoom_layout &layout,
                          const zoom_prior &prior, const zoom_weights &weights,
                          const zoom_estimate &estimate, const std::function<void()> &between) {
    return chooser(problem, layout, prior, weights, estimate).run(between);
}

std::vector<double> with_orders(const zoom_layout &from, const std::vector<double> &values,
                                const zoom_layout &to, double otherwise) {
    std::vector<double> result(size_t(to.size()), otherwise);
    const auto copy = [&](int count, int source, int target) {
        std::copy_n(values.begin() + source, count, result.begin() + target);
    };
    for (int camera = 0; camera < CAMERAS; camera++) {
        for (int function = 0; function < ZOOM_FUNCTIONS; function++) {
            copy(std::min(from.estimated_terms(function), to.estimated_terms(function)),
                 from.terms_at(camera, function), to.terms_at(camera, function));
            for (int k = 0; k < from.settings(camera); k++) {
                const int source = from.effect_at(camera, function, k);
                const int target = to.effect_at(camera, function, k);
                if (source >= 0 && target >= 0) {
                    copy(1, source, target);
                }
            }
        }
        copy(ZOOM_FOCUS_TERMS, from.focus_at(camera), to.focus_at(camera));
        const int mounts = camera == LEFT ? int(ZOOM_ROTATION_X) : int(ZOOM_MOUNT_PARAMETERS);
        copy(mounts, from.mount_at(camera, 0), to.mount_at(camera, 0));
        copy(from.visits(), from.pan_at(camera, 0), to.pan_at(camera, 0));
    }
    copy(from.boards() * WARP_PARAMETERS, from.warp_at(0), to.warp_at(0));
    return result;
}

}  // namespace calib
