// SPDX-License-Identifier: Apache-2.0
/// Observations in the solver's form, in an order independent of the caller's.
#ifndef VERGENCE_CALIB_SOLVE_SOLVE_INPUT_HPP
#define VERGENCE_CALIB_SOLVE_SOLVE_INPUT_HPP

#include <string>
#include <vector>

#include "calib/base/solution.hpp"
#include "calib/bundle/bundle.hpp"

namespace calib {

/// "" or what is wrong with the observations as a whole, or with a corner's values.
std::string check_observations(const observations &seen);

struct ordered_bundle {
    bundle data;
    std::vector<size_t> caller;  // index in the caller's input of each position of the bundle
};

/// Positions sorted by their names, then by their corners. Corners without a sigma get 0.1 px.
ordered_bundle order_observations(const observations &seen);

}  // namespace calib

#endif
