// SPDX-License-Identifier: Apache-2.0
/// One sentence about a solution.
#ifndef VERGENCE_CALIB_SOLVE_SOLVE_VERDICT_HPP
#define VERGENCE_CALIB_SOLVE_SOLVE_VERDICT_HPP

#include <string>

#include "calib/base/solution.hpp"
#include "calib/bundle/bundle.hpp"

namespace calib {

/// The verdict on a failed solution.
verdict rejection(const std::string &reason);

/// The verdict on a solution whose other members are complete.
verdict assess_solution(const bundle &data, const bundle_state &state, const solution &found);

/// How the two sides of the print differ, or the pixels' sides by a percent or more, of the camera
/// where they do most; "" when they do not.
std::string stretch_of(const bundle &data, const bundle_state &state, const solution &found);
std::string pixels_of(const bundle &data, const solution &found);

/// "left camera", "right camera", or "camera" where there is one only.
const char *camera_name(const bundle &data, int camera);

}  // namespace calib

#endif
