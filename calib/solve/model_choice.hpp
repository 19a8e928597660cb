// SPDX-License-Identifier: Apache-2.0
/// Chooses what is estimated by asking how well positions of the board that were held out are
/// explained by what the others taught.
#ifndef VERGENCE_CALIB_SOLVE_MODEL_CHOICE_HPP
#define VERGENCE_CALIB_SOLVE_MODEL_CHOICE_HPP

#include <functional>
#include <optional>
#include <vector>

#include "calib/bundle/bundle.hpp"
#include "calib/solve/solve.hpp"

namespace calib {

struct model_candidate {
    lens_model model;
    board_model target;
};

struct model_choice {
    model_candidate chosen;
    double held_out_rms_px = 0;
    std::vector<model_score> scores;
    bundle_state state;  // the least-squares solution of the chosen one
};

/// Fewest positions of the board from which a model is chosen; with fewer `modest_model` is taken.
const int LEAST_FOR_CHOICE = 5;
model_candidate modest_model();

/// Sets what a candidate does not estimate to what its absence means.
void forget_absent(const model_candidate &candidate, bundle_state *state);

/// Scores candidates by cross-validation over five folds of the used positions and takes the
/// simplest that is within one standard error of the best, the error being that of the mean
/// difference to the best over the positions; but not one whose own residuals say that something is
/// missing, for they tell more than the few positions do. Pixels and board are chosen first (square
/// or not, flat or bent, print stretched or not), with k1 k2 p1 p2, then the distortion; a simpler
/// one than k1 k2 p1 p2 must be better by more than one standard error. With a `distortion` only
/// pixels and board are chosen. `state` is a solution to begin with; `between` is called now and
/// then on the calling thread and may throw.
model_choice choose_model(const bundle &data, const bundle_state &state,
                          std::optional<lens_model::kind> distortion, int threads,
                          const std::function<void()> &between);

}  // namespace calib

#endif
