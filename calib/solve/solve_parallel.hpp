// SPDX-License-Identifier: Apache-2.0
/// Independent pieces of work on several threads. Each piece is computed alone, in its own memory,
/// so results do not depend on how many threads there are.
#ifndef VERGENCE_CALIB_SOLVE_SOLVE_PARALLEL_HPP
#define VERGENCE_CALIB_SOLVE_SOLVE_PARALLEL_HPP

#include <functional>

namespace calib {

/// Calls `piece(0)` to `piece(count - 1)`, each once, on up to `threads` threads; returns when all
/// are done. Pieces must not throw and must not share what they write. `between`, if any, is called
/// on the calling thread before each of its own pieces; what it throws ends the work early and goes
/// on to the caller.
void parallel_pieces(int threads, int count, const std::function<void(int)> &piece,
                     const std::function<void()> &between = nullptr);

}  // namespace calib

#endif
