// SPDX-License-Identifier: Apache-2.0
#include "calib/solve/model_choice.hpp"

#include <algorithm>
#include <cmath>

#include "calib/solve/seed_pose.hpp"
#include "calib/solve/solve_parallel.hpp"
#include "core/error.h"
#include "core/invariant.h"

namespace calib {

namespace {

const size_t FOLDS = 5;

// A candidate's solution on everything, and the error of each board position when held out.
struct contender {
    model_candidate candidate;
    bundle_state state;
    double squares = 0;               // sum of squared residuals in sigmas, with nothing held out
    std::vector<double> cost;         // mean squared residual in sigmas, by used position
    std::vector<double> squares_px2;  // sum of squared residuals in px, by used position
    std::vector<int> corners;
    bool possible = true;  // its lenses fold nowhere, and its parameters are determined
};

std::vector<size_t> used_captures(const bundle &data) {
    std::vector<size_t> result;
    for (size_t i = 0; i < data.captures.size(); i++) {
        if (data.used(i)) {
            result.push_back(i);
        }
    }
    return result;
}

bundle_options options_for(const model_candidate &candidate) {
    bundle_options options = options_of(candidate.model, candidate.target, 0);
    options.tolerance = ROUGH_TOLERANCE;
    return options;
}

void score_held_out(const bundle &data, size_t capture, const bundle_state &state, size_t position,
                    contender *result) {
    INVARIANT(position < result->cost.size() && capture < data.captures.size());
    rigid pose = state.T_left_board[capture];
    if (fit_pose(data, data.captures[capture], state, 0, &pose) < 0) {
        pose = result->state.T_left_board[capture];
    }
    double cost = 0, squares = 0;
    int corners = 0;
    for (int camera = 0; camera < data.cameras; camera++) {
        const bundle_view &view = data.captures[capture][size_t(camera)];
        for (const bundle_corner &corner : view.corners) {
            double residual[2];
            if (view.used && corner.used &&
                corner_residual(data, camera, corner, state, pose, residual)) {
                const double square = residual[0] * residual[0] + residual[1] * residual[1];
                cost += square / (corner.sigma_px * corner.sigma_px);
                squares += square;
                corners++;
            }
        }
    }
    result->cost[position] = cost / std::max(1, corners);
    result->squares_px2[position] = squares;
    result->corners[position] = corners;
}

void run_fold(const bundle &data, const std::vector<size_t> &used, size_t fold, contender *result) {
    INVARIANT(fold < FOLDS && result->cost.size() == used.size());
    bundle taught = data;
    for (size_t k = fold; k < used.size(); k += FOLDS) {
        for (bundle_view &view : taught.captures[used[k]]) {
            view.used = false;
        }
    }
    bundle_state state = result->state;
    adjust(taught, options_for(result->candidate), &state);
    for (size_t k = fold; k < used.size(); k += FOLDS) {
        score_held_out(data, used[k], state, k, result);
    }
}

// Solves and cross-validates all candidates.
void contend(const bundle &data, int threads, const std::function<void()> &between,
             std::vector<contender> *contenders) {
    const std::vector<size_t> used = used_captures(data);
    parallel_pieces(
        threads, int(contenders->size()),
        [&](int k) {
            contender &one = (*contenders)[size_t(k)];
            forget_absent(data, one.candidate, &one.state);
            one.squares = 2 * adjust(data, options_for(one.candidate), &one.state).cost;
            for (int camera = 0; camera < data.cameras; camera++) {
                const lens lens = lens_from_state(data.frame[camera], one.state.lens[camera]);
                one.possible = one.possible && lens_validate(&lens) == ERROR_OK;
            }
            one.cost.assign(used.size(), 0.0);
            one.squares_px2.assign(used.size(), 0.0);
            one.corners.assign(used.size(), 0);
        },
        between);
    const int folds = int(std::min(FOLDS, used.size()));
    parallel_pieces(
        threads, int(contenders->size()) * folds,
        [&](int k) { run_fold(data, used, size_t(k % folds), &(*contenders)[size_t(k / folds)]); },
        between);
}

double mean_of(const std::vector<double> &values) {
    INVARIANT(!values.empty());
    double sum = 0;
    for (const double value : values) {
        sum += value;
    }
    return sum / double(values.size());
}

// Mean and standard error of the difference of two candidates, over positions.
struct difference {
    double mean, error;
};

difference compare(const contender &one, const contender &other) {
    INVARIANT(one.cost.size() == other.cost.size());
    std::vector<double> differences(one.cost.size());
    for (size_t k = 0; k < differences.size(); k++) {
        differences[k] = one.cost[k] - other.cost[k];
    }
    const double middle = mean_of(differences);
    double square = 0;
    for (const double value : differences) {
        square += (value - middle) * (value - middle);
    }
    const double count = double(differences.size());
    return {middle, std::sqrt(square / std::max(1.0, count - 1) / count)};
}

double held_out_rms_px(const contender &one) {
    double squares = 0;
    long corners = 0;
    for (size_t k = 0; k < one.cost.size(); k++) {
        squares += one.squares_px2[k];
        corners += one.corners[k];
    }
    return std::sqrt(squares / double(std::max(1L, corners)));
}

int parameters_of(const bundle &data, const model_candidate &candidate) {
    return data.cameras * candidate.model.count() + candidate.target.count();
}

// True when the residuals show what the simpler candidate omits: their squares grow by more than
// two variances for each parameter that it omits.
// Source: H. Akaike, "A new look at the statistical model identification", 1974.
bool is_contradicted(const bundle &data, const contender &simpler, const contender &best) {
    double residuals = 0;
    for (const int corners : best.corners) {
        residuals += 2 * corners;
    }
    const double freedom = residuals - double(POSE_PARAMETERS * best.corners.size()) -
                           parameters_of(data, best.candidate);
    const double variance = best.squares / std::max(1.0, freedom);
    const int missing =
        parameters_of(data, best.candidate) - parameters_of(data, simpler.candidate);
    return simpler.squares - best.squares > 2 * std::max(0, missing) * variance;
}

// The candidate with the smallest error when held out. Those before `default_index` must beat it by
// more than chance. Error bars ignore a distortion that is left out although it exists, while a
// distortion estimated needlessly inflates them only where nothing is known.
size_t find_best(const std::vector<contender> &contenders, size_t default_index) {
    INVARIANT(default_index < contenders.size());
    size_t best = default_index;
    for (size_t k = 0; k < contenders.size(); k++) {
        if (!contenders[k].possible) {
            continue;
        }
        const difference to_default = compare(contenders[k], contenders[default_index]);
        if (mean_of(contenders[k].cost) < mean_of(contenders[best].cost) &&
            (k > default_index || to_default.mean < -to_default.error)) {
            best = k;
        }
    }
    return best;
}

// Candidates are in order of simplicity; returns the index of the chosen one.
size_t elect(const bundle &data, const std::vector<contender> &contenders, size_t default_index,
             std::vector<model_score> *scores) {
    while (default_index > 0 && !contenders[default_index].possible) {
        default_index--;
    }
    const size_t best = find_best(contenders, default_index);
    const size_t simplest = std::min(best, default_index);
    INVARIANT(simplest <= best && best < contenders.size());
    size_t chosen = best;
    for (size_t k = contenders.size(); k-- > 0;) {
        const difference to_best = compare(contenders[k], contenders[best]);
        if (contenders[k].possible && k < best && k >= simplest && to_best.mean <= to_best.error &&
            !is_contradicted(data, contenders[k], contenders[best])) {
            chosen = k;
        }
        scores->push_back({contenders[k].candidate.model, contenders[k].candidate.target,
                           held_out_rms_px(contenders[k]), to_best.mean, to_best.error, false});
    }
    (*scores)[scores->size() - 1 - chosen].chosen = true;
    return chosen;
}

// Whether the corners reach so far off the axis that a lens may follow no polynomial.
bool is_wide(const bundle &data, const bundle_state &state) {
    static const double wide = 0.8;
    for (int camera = 0; camera < data.cameras; camera++) {
        const double focal_px = std::exp(state.lens[camera].value[LOG_FOCAL]);
        if (state.lens[camera].kind != LENS_BROWN_CONRADY ||
            data.frame[camera].radius_px > wide * focal_px) {
            return true;
        }
    }
    return false;
}

bool is_clearly_better(const contender &one, const contender &other) {
    static const double share = 0.9, errors = 3;
    const difference off = compare(one, other);
    return one.possible && mean_of(one.cost) < share * mean_of(other.cost) &&
           off.mean < -errors * off.error;
}

// The rational and the equidistant model against the winner of the others.
contender elect_wide(const bundle &data, const contender &winner, int threads,
                     const std::function<void()> &between, std::vector<model_score> *scores) {
    std::vector<contender> contenders;
    for (const lens_model::kind kind : {lens_model::RATIONAL, lens_model::EQUIDISTANT}) {
        if (kind != winner.candidate.model.distortion) {
            contenders.push_back({winner.candidate, winner.state, 0, {}, {}, {}, true});
            contenders.back().candidate.model.distortion = kind;
        }
    }
    contend(data, threads, between, &contenders);
    const contender *best = &winner;
    for (const contender &one : contenders) {
        best = is_clearly_better(one, *best) || (!best->possible && one.possible) ? &one : best;
    }
    for (const contender &one : contenders) {
        const difference to_winner = compare(one, winner);
        scores->push_back({one.candidate.model, one.candidate.target, held_out_rms_px(one),
                           to_winner.mean, to_winner.error, &one == best});
    }
    for (size_t i = 0; best != &winner && i + contenders.size() < scores->size(); i++) {
        (*scores)[i].chosen = false;
    }
    return *best;
}

}  // namespace

void forget_absent(const bundle &data, const model_candidate &candidate, bundle_state *state) {
    for (int camera = 0; camera < data.cameras; camera++) {
        lens_state &lens = state->lens[camera];
        lens = converted(data.frame[camera], lens, candidate.model.lens());
        for (int parameter = 0; parameter < LENS_PARAMETERS; parameter++) {
            if (!candidate.model.estimates(parameter)) {
                lens.value[size_t(parameter)] = 0;
            }
        }
    }
    for (int parameter = 0; parameter < WARP_PARAMETERS; parameter++) {
        state->warp_mm[parameter] *= candidate.target.estimates(parameter) ? 1 : 0;
    }
}

model_candidate basic_model() {
    return {{lens_model::K1, true}, {}};
}

model_choice choose_model(const bundle &data, const bundle_state &state,
                          std::optional<lens_model::kind> distortion, int threads,
                          const std::function<void()> &between) {
    INVARIANT(state.T_left_board.size() == data.captures.size());
    model_choice result;
    const bool equidistant = state.lens[LEFT].kind == LENS_EQUIDISTANT;
    const lens_model::kind first = equidistant ? lens_model::EQUIDISTANT : lens_model::K1_K2_P1_P2;
    const auto shape_of = [&](bool square_pixels, board_model target) {
        return model_candidate{{distortion.value_or(first), square_pixels}, target};
    };
    std::vector<contender> contenders;
    // What either could explain is more likely an error of the print than of the pixels.
    for (const model_candidate &candidate :
         {shape_of(true, {false, false}), shape_of(true, {false, true}),
          shape_of(true, {true, false}), shape_of(false, {false, false}),
          shape_of(true, {true, true}), shape_of(false, {true, false})}) {
        contenders.push_back({candidate, state, 0, {}, {}, {}, true});
    }
    contend(data, threads, between, &contenders);
    contender winner = contenders[elect(data, contenders, 0, &result.scores)];
    if (!distortion && !equidistant) {
        contenders.clear();
        for (int kind = 0; kind <= lens_model::K1_K2_P1_P2_K3; kind++) {
            contenders.push_back({winner.candidate, winner.state, 0, {}, {}, {}, true});
            contenders.back().candidate.model.distortion = lens_model::kind(kind);
        }
        contend(data, threads, between, &contenders);
        for (model_score &score : result.scores) {
            score.chosen = false;
        }
        winner = contenders[elect(data, contenders, lens_model::K1_K2_P1_P2, &result.scores)];
    }
    if (!distortion && is_wide(data, winner.state)) {
        winner = elect_wide(data, winner, threads, between, &result.scores);
    }
    result.chosen = winner.candidate;
    result.held_out_rms_px = held_out_rms_px(winner);
    result.state = winner.state;
    return result;
}

}  // namespace calib
