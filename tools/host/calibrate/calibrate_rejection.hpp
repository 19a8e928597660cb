// SPDX-License-Identifier: Apache-2.0
/// Explains why too few pictures can be used: the most common reason and a hint.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_REJECTION_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_REJECTION_HPP

#include <string>

#include "tools/host/calibrate/calibrate_views.hpp"

/// One line with the reason why nothing can be solved from these views; "" if the solver should
/// try.
std::string calibrate_rejection_text(const calibrate_views &views);

/// The board size that a reason says was found instead of the requested one. False if the reason
/// says something else.
bool calibrate_rejection_size(const std::string &reason, int *columns, int *rows);

#endif
