// SPDX-License-Identifier: Apache-2.0
/// The solver's results in the caller's terms and order.
#ifndef VERGENCE_CALIB_SOLVE_SOLVE_RESULT_HPP
#define VERGENCE_CALIB_SOLVE_SOLVE_RESULT_HPP

#include "calib/base/solution.hpp"
#include "calib/bundle/bundle.hpp"
#include "calib/solve/robust.hpp"
#include "calib/solve/solve_input.hpp"
#include "calib/solve/uncertainty.hpp"

namespace calib {

/// Lenses, rig, boards, residuals and rejections of a state. If `state` has no poses yet, only the
/// rejections are filled in.
solution describe(const observations &seen, const ordered_bundle &ordered,
                  const view_records &records, const bundle_state &state);

/// Fills in everything that follows from the error model.
void describe_errors(const bundle &data, const bundle_state &state, const error_model &errors,
                     solution *result);

}  // namespace calib

#endif
