// SPDX-License-Identifier: Apache-2.0
/// Independent pieces of work on several threads. Each piece is computed alone, in its own memory,
/// so results do not depend on the number of threads.
#ifndef VERGENCE_CALIB_SOLVE_SOLVE_PARALLEL_HPP
#define VERGENCE_CALIB_SOLVE_SOLVE_PARALLEL_HPP

#include <functional>

namespace calib {

/// Calls `piece(0)` to `piece(count - 1)`, each once, on up to `threads` threads; returns when all
/// are done. Pieces must not throw and must not share output. `between`, if set, is called on the
/// calling thread before each of its own pieces; an exception from it ends the work early and is
/// passed on to the caller.
void parallel_pieces(int threads, int count, const std::function<void(int)> &piece,
                     const std::function<void()> &between = nullptr);

}  // namespace calib

#endif
