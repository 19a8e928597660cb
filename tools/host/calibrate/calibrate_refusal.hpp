// SPDX-License-Identifier: Apache-2.0
/// What to say when too few pictures can be used: the commonest reason, and what helps against it.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_REFUSAL_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_REFUSAL_HPP

#include <string>

#include "tools/host/calibrate/calibrate_views.hpp"

/// One line that says why nothing can be solved from these views; "" where the solver should try.
std::string calibrate_refusal_text(const calibrate_views &views);

/// The size of board that a reason says was found instead of the one asked for. False when it says
/// something else.
bool calibrate_refusal_size(const std::string &reason, int *columns, int *rows);

#endif
