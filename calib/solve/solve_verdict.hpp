// SPDX-License-Identifier: Apache-2.0
/// One sentence about a solution.
#ifndef VERGENCE_CALIB_SOLVE_SOLVE_VERDICT_HPP
#define VERGENCE_CALIB_SOLVE_SOLVE_VERDICT_HPP

#include <string>

#include "calib/bundle/bundle.hpp"
#include "calib/solve/solve.hpp"

namespace calib {

/// The verdict on a failed solution.
verdict rejection(const std::string &reason);

/// The verdict on a solution whose other members are complete.
verdict assess_solution(const bundle &data, const bundle_state &state, const solution &found);

}  // namespace calib

#endif
