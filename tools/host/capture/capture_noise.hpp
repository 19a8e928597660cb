// SPDX-License-Identifier: Apache-2.0
/// The noise of a corner, from frames of a board at rest: what no model of a lens can explain.
#ifndef VERGENCE_TOOLS_HOST_CAPTURE_CAPTURE_NOISE_HPP
#define VERGENCE_TOOLS_HOST_CAPTURE_CAPTURE_NOISE_HPP

#include <array>
#include <vector>

#include "calib/base/board.hpp"
#include "daemon/session/session_pairs.h"

/// Views of the left and of the right camera at one moment.
using capture_still = std::array<calib::board_view, 2>;

/// The rms distance of a corner from its mean place in each camera, of the corners that all frames
/// show. False: the board moved between them, or they share too few corners.
bool capture_noise_of(const std::vector<capture_still> &stills, session_corner_noise *noise);

#endif
