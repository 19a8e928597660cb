// SPDX-License-Identifier: Apache-2.0
#include "calib/zoom/zoom_equations.hpp"

#include <algorithm>
#include <cmath>

#include "calib/solve/solve_parallel.hpp"
#include "core/invariant.h"

namespace calib {

namespace {

struct one_view {
    size_t capture;
    int camera;
    view_block block;
};

// Sums up the equations of one place.
class place_sum {
  public:
    place_sum(const zoom_problem &problem, const zoom_layout &layout, const zoom_prior &prior,
              const zoom_estimate &estimate, size_t place)
        : problem_(problem),
          layout_(layout),
          prior_(prior),
          estimate_(estimate),
          of_(problem.places[place]),
          place_of_(size_t(layout.size()), -1) {}

    place_equations run(const std::vector<one_view> &views) {
        for (const one_view &view : views) {
            for (const int column : view.block.columns) {
                want(column);
            }
        }
        for (int i = 0; i < WARP_PARAMETERS; i++) {
            want(layout_.warp_at(of_.board) + i);
        }
        const long count = sum_.shared_count() + POSE_PARAMETERS;
        sum_.normal = matrix::Zero(count, count);
        sum_.gradient = vector::Zero(count);
        for (const one_view &view : views) {
            add_view(view);
            add_focused(view);
        }
        return sum_;
    }

  private:
    void want(int column) {
        if (place_of_[size_t(column)] < 0) {
            place_of_[size_t(column)] = int(sum_.columns.size());
            sum_.columns.push_back(column);
        }
    }

    int own(int index) const { return int(sum_.columns.size()) + index; }

    // Adds a view's quadratic form, carried over to the parameters of its place and without its
    // latents, which are the last ones of `D`.
    void add_view(const one_view &view) {
        const view_block &block = view.block;
        const long columns = long(block.columns.size());
        const long count = columns + POSE_PARAMETERS + WARP_PARAMETERS;
        const long latents = prior_.has_latents() ? long(LATENTS) : 0;
        std::vector<int> at;
        for (const int column : block.columns) {
            at.push_back(place_of_[size_t(column)]);
        }
        for (int i = 0; i < POSE_PARAMETERS; i++) {
            at.push_back(own(i));
        }
        for (int i = 0; i < WARP_PARAMETERS; i++) {
            at.push_back(place_of_[size_t(layout_.warp_at(of_.board) + i)]);
        }
        matrix D = matrix::Zero(VIEW_PARAMETERS, count + latents);
        D.topLeftCorner(VIEW_BOARD_AT, columns) = block.by_column.leftCols(columns);
        D.block(VIEW_BOARD_AT, columns, count - columns, count - columns).setIdentity();
        D.topRightCorner(VIEW_BOARD_AT, latents) = block.by_column.rightCols(latents);
        matrix normal = product(D.transpose(), product(block.normal, D));
        vector gradient = D.transpose() * block.gradient;
        if (latents > 0) {
            eliminate(view, at, &normal, &gradient);
        }
        for (long i = 0; i < count; i++) {
            for (long k = 0; k < count; k++) {
                sum_.normal(at[size_t(i)], at[size_t(k)]) += normal(i, k);
            }
            sum_.gradient[at[size_t(i)]] += gradient[i];
        }
        sum_.squares += block.squares;
        sum_.residuals += block.residuals;
    }

    void eliminate(const one_view &view, const std::vector<int> &at, matrix *normal,
                   vector *gradient) {
        const long count = long(at.size());
        matrix own = normal->bottomRightCorner(LATENTS, LATENTS);
        vector own_gradient = gradient->tail(LATENTS);
        for (int i = 0; i < LATENTS; i++) {
            const double sigma = prior_.latent_sigma[size_t(view.camera)][size_t(i)];
            const double off = estimate_.latent[view.capture][size_t(view.camera)][size_t(i)];
            own(i, i) += 1 / (sigma * sigma);
            own_gradient[i] += off / (sigma * sigma);
            sum_.squares += off * off / (sigma * sigma);
        }
        const matrix mixed = normal->bottomLeftCorner(LATENTS, count);
        const matrix inverse = scaled_inverse(own);
        const matrix across = product(mixed.transpose(), inverse);
        normal->topLeftCorner(count, count) -= product(across, mixed);
        gradient->head(count) -= across * own_gradient;
        sum_.latents.push_back({view.capture, view.camera, at, inverse, mixed, own_gradient});
    }

    void add_focused(const one_view &view) {
        const focus_row row =
            focus_row_of(problem_, layout_, view.capture, view.camera, view.block.posed,
                         estimate_.T_instrument_board[problem_.captures[view.capture].place]);
        if (row.columns.empty()) {
            return;
        }
        const double weight = 1 / (row.sigma * row.sigma);
        for (size_t i = 0; i < row.columns.size(); i++) {
            const int at = place_of_[size_t(row.columns[i])];
            sum_.gradient[at] += weight * row.derivatives[i] * row.residual;
            for (size_t k = 0; k < row.columns.size(); k++) {
                sum_.normal(at, place_of_[size_t(row.columns[k])]) +=
                    weight * row.derivatives[i] * row.derivatives[k];
            }
        }
        sum_.squares += weight * row.residual * row.residual;
    }

    const zoom_problem &problem_;
    const zoom_layout &layout_;
    const zoom_prior &prior_;
    const zoom_estimate &estimate_;
    const zoom_problem::place &of_;
    std::vector<int> place_of_;  // index in `sum_.columns`; -1: not wanted
    place_equations sum_;
};

place_equations equations_of(const zoom_problem &problem, const zoom_layout &layout,
                             const zoom_prior &prior, const zoom_weights &weights,
                             const zoom_estimate &estimate, size_t place,
                             const zoom_filter &filter) {
    std::vector<one_view> views;
    for (const size_t index : problem.places[place].captures) {
        for (int camera = 0; camera < CAMERAS; camera++) {
            if (problem.captures[index].view[size_t(camera)].used && (!filter || filter(index))) {
                views.push_back(
                    {index, camera,
                     view_block_of(problem, layout, weights.loss_scale, estimate, index, camera)});
            }
        }
    }
    return place_sum(problem, layout, prior, estimate, place).run(views);
}

}  // namespace

std::vector<place_equations> all_equations(const zoom_problem &problem, const zoom_layout &layout,
                                           const zoom_prior &prior, const zoom_weights &weights,
                                           const zoom_estimate &estimate,
                                           const zoom_filter &filter) {
    std::vector<place_equations> result(problem.places.size());
    parallel_pieces(weights.threads, int(result.size()), [&](int place) {
        result[size_t(place)] =
            equations_of(problem, layout, prior, weights, estimate, size_t(place), filter);
    });
    return result;
}

matrix scaled_inverse(const matrix &A) {
    const vector scale = A.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const matrix inner = inverse_symmetric(scale.asDiagonal() * A * scale.asDiagonal());
    return scale.asDiagonal() * inner * scale.asDiagonal();
}

vector scaled_solution(const matrix &A, const vector &b) {
    const vector scale = A.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    return scale.asDiagonal() *
           solve_symmetric(scale.asDiagonal() * A * scale.asDiagonal(), scale.asDiagonal() * b);
}

namespace {

matrix damped_own(const place_equations &place, double damping) {
    matrix own = place.normal.bottomRightCorner(place.own_count(), place.own_count());
    own.diagonal() *= 1 + damping;
    return own;
}

}  // namespace

void add_reduced(const place_equations &place, double damping, double sign, shared_equations *sum) {
    if (place.empty()) {
        return;
    }
    const long count = place.shared_count(), own = place.own_count();
    const matrix inverse = scaled_inverse(damped_own(place, damping));
    const matrix mixed = place.normal.topRightCorner(count, own);
    const matrix across = product(mixed, inverse);
    const matrix normal =
        place.normal.topLeftCorner(count, count) - product(across, mixed.transpose());
    const vector gradient = place.gradient.head(count) - across * place.gradient.tail(own);
    for (long i = 0; i < count; i++) {
        for (long k = 0; k < count; k++) {
            sum->normal(place.columns[size_t(i)], place.columns[size_t(k)]) += sign * normal(i, k);
        }
        sum->gradient[place.columns[size_t(i)]] += sign * gradient[i];
    }
}

shared_equations reduced(const std::vector<place_equations> &places, const zoom_layout &layout,
                         const zoom_prior &prior, const std::vector<double> &shared,
                         double damping) {
    const long count = layout.size();
    shared_equations sum{matrix::Zero(count, count), vector::Zero(count)};
    for (const place_equations &place : places) {
        add_reduced(place, damping, 1, &sum);
    }
    for (long i = 0; i < count; i++) {
        const double weight = 1 / (prior.sigma[size_t(i)] * prior.sigma[size_t(i)]);
        sum.normal(i, i) += weight;
        sum.gradient[i] += weight * (shared[size_t(i)] - prior.mean[size_t(i)]);
    }
    return sum;
}

double cost_of(const zoom_problem &problem, const zoom_layout &layout, const zoom_prior &prior,
               const zoom_weights &weights, const zoom_estimate &estimate) {
    std::vector<double> of_place(problem.places.size());
    parallel_pieces(weights.threads, int(of_place.size()), [&](int place) {
        of_place[size_t(place)] =
            squares_of(problem, layout, prior, weights.loss_scale, estimate, size_t(place));
    });
    double sum = 0;
    for (const double squares : of_place) {
        sum += squares;
    }
    for (size_t i = 0; i < prior.mean.size(); i++) {
        const double off = (estimate.shared[i] - prior.mean[i]) / prior.sigma[i];
        sum += off * off;
    }
    return 0.5 * sum;
}

namespace {

// The estimate after a step of the shared parameters and what follows for each place.
zoom_estimate moved(const zoom_estimate &from, const std::vector<place_equations> &places,
                    const vector &step, double damping) {
    zoom_estimate result = from;
    for (long i = 0; i < step.size(); i++) {
        result.shared[size_t(i)] += step[i];
    }
    for (size_t k = 0; k < places.size(); k++) {
        const place_equations &place = places[k];
        if (place.empty()) {
            continue;
        }
        vector here(long(place.columns.size()));
        for (size_t i = 0; i < place.columns.size(); i++) {
            here[long(i)] = step[place.columns[i]];
        }
        const vector right =
            -(place.gradient.tail(place.own_count()) +
              place.normal.bottomLeftCorner(place.own_count(), place.shared_count()) * here);
        const vector own = scaled_solution(damped_own(place, damping), right);
        if (!own.allFinite() || own.head(POSE_PARAMETERS).norm() > 10) {
            continue;
        }
        result.T_instrument_board[k] = moved_board(from.T_instrument_board[k], own.data());
        orthonormalise(result.T_instrument_board[k].R);
        vector all(here.size() + own.size());
        all << here, own;
        for (const view_latents &view : place.latents) {
            vector near(long(view.at.size()));
            for (size_t i = 0; i < view.at.size(); i++) {
                near[long(i)] = all[view.at[i]];
            }
            const vector change = -view.inverse * (view.gradient + view.mixed * near);
            for (size_t i = 0; i < LATENTS; i++) {
                result.latent[view.capture][size_t(view.camera)][i] += change[long(i)];
            }
        }
    }
    return result;
}

}  // namespace

zoom_fit_summary fit_zoom(const zoom_problem &problem, const zoom_layout &layout,
                          const zoom_prior &prior, const zoom_weights &weights, int max_iterations,
                          const std::function<void()> &between, zoom_estimate *estimate) {
    INVARIANT(int(estimate->shared.size()) == layout.size());
    zoom_fit_summary summary;
    summary.cost = cost_of(problem, layout, prior, weights, *estimate);
    double damping = 1e-6;
    while (!summary.converged && summary.iterations < max_iterations) {
        summary.iterations++;
        const std::vector<place_equations> places =
            all_equations(problem, layout, prior, weights, *estimate);
        bool better = false;
        while (!better && !summary.converged && damping < 1e8) {
            if (between) {
                between();
            }
            shared_equations sum = reduced(places, layout, prior, estimate->shared, damping);
            matrix normal = sum.normal;
            normal.diagonal() *= 1 + damping;
            const vector step = scaled_solution(normal, -sum.gradient);
            const double gain = -step.dot(sum.gradient);
            const zoom_estimate tried = moved(*estimate, places, step, damping);
            const double cost =
                step.allFinite() ? cost_of(problem, layout, prior, weights, tried) : INFINITY;
            better = cost < summary.cost;
            summary.converged = gain < 1e-4 && (!better || summary.cost - cost < 1e-3);
            if (better) {
                *estimate = tried;
                summary.cost = cost;
                damping = std::max(1e-9, 0.1 * damping);
            } else {
                damping = std::max(1e-7, 10 * damping);
            }
        }
        if (!better) {
            break;
        }
    }
    return summary;
}

}  // namespace calib
