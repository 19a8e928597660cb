// SPDX-License-Identifier: Apache-2.0
/// `vergence reconstruct --debug DIR`: pictures of the matcher's intermediate results, and a page
/// that explains them.
#ifndef VERGENCE_TOOLS_HOST_DEBUG_DEBUG_HPP
#define VERGENCE_TOOLS_HOST_DEBUG_DEBUG_HPP

#include "daemon/surface/reconstruct_debug.h"

/// For reconstruct_outputs; static storage.
const reconstruct_debug_maker *debug_maker();

#endif
