// SPDX-License-Identifier: Apache-2.0
/// Chooses the estimated parameters by cross-validation: how well do they predict board positions
/// that were held out?
#ifndef VERGENCE_CALIB_SOLVE_MODEL_CHOICE_HPP
#define VERGENCE_CALIB_SOLVE_MODEL_CHOICE_HPP

#include <functional>
#include <optional>
#include <vector>

#include "calib/base/solution.hpp"
#include "calib/bundle/bundle.hpp"

namespace calib {

struct model_candidate {
    lens_model model;
    board_model target;
};

struct model_choice {
    model_candidate chosen;
    double held_out_rms_px = 0;
    std::vector<model_score> scores;
    bundle_state state;  // the least-squares solution of the chosen model
};

/// Minimum number of board positions for a choice; with fewer, `basic_model` is used.
const int MIN_FOR_CHOICE = 5;
model_candidate basic_model();

/// Converts the lenses to a candidate's kind, and sets the parameters that it does not estimate to
/// their neutral values.
void forget_absent(const bundle &data, const model_candidate &candidate, bundle_state *state);

/// Scores candidates by cross-validation over five folds of the used positions and takes the
/// simplest one within one standard error of the best, the error being that of the mean difference
/// to the best over the positions. A candidate whose own residuals show that something is missing
/// is excluded, since they carry more information than the few positions. Pixels and board are
/// chosen first (square or not, flat or bent, print stretched or not), with k1 k2 p1 p2, then the
/// distortion; a model simpler than k1 k2 p1 p2 must be better by more than one standard error.
/// Where the field is wide, the rational and the equidistant model are candidates, too: they must
/// be better than all others by a tenth and by more than three standard errors. If the lenses of
/// `state` are equidistant, they stay so unless the rational model is as much better.
/// With a given `distortion` only pixels and board are chosen. `state` is the initial solution;
/// `between` is called now and then on the calling thread and may throw.
model_choice choose_model(const bundle &data, const bundle_state &state,
                          std::optional<lens_model::kind> distortion, int threads,
                          const std::function<void()> &between);

}  // namespace calib

#endif
