// SPDX-License-Identifier: Apache-2.0
/// The position of a corner that does not look like two crossing edges: ink that spreads, motion
/// blur, overexposure. All of these leave it the same after half a turn.
#ifndef VERGENCE_CALIB_DETECT_DETECT_SYMMETRY_HPP
#define VERGENCE_CALIB_DETECT_DETECT_SYMMETRY_HPP

#include <optional>

#include "calib/detect/detect_fit.hpp"

namespace calib::detect {

/// The centre of symmetry near the guess. Blur is that of the steepest edge near it. Returns
/// nothing when the search does not converge near the guess or half a turn changes too much.
std::optional<corner_fit> fit_symmetry(const plane &level, const corner_guess &guess);

}  // namespace calib::detect

#endif
