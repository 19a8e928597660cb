// SPDX-License-Identifier: Apache-2.0
/// Observations in the form that the solver works on, in an order that does not depend on the
/// caller's.
#ifndef VERGENCE_CALIB_SOLVE_SOLVE_INPUT_HPP
#define VERGENCE_CALIB_SOLVE_SOLVE_INPUT_HPP

#include <string>
#include <vector>

#include "calib/bundle/bundle.hpp"
#include "calib/solve/solve.hpp"

namespace calib {

/// "" or what is wrong with the observations as a whole, or with a corner's numbers.
std::string check_observations(const observations &seen);

struct ordered_bundle {
    bundle data;
    std::vector<size_t> caller;  // the caller's sighting of each of the bundle's
};

/// Sightings sorted by their names, then by their corners. Corners without a sigma get 0.1 px.
ordered_bundle order_observations(const observations &seen);

}  // namespace calib

#endif
