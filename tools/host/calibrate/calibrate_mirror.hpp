// SPDX-License-Identifier: Apache-2.0
/// Detects one camera that mirrors its pictures (webcam previews do). A plain board looks the same
/// in a mirror, so each picture seems right separately, but the pairs do not fit together.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_MIRROR_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_MIRROR_HPP

#include <functional>

#include "calib/solve/solve.hpp"

/// Whether at least half of `pairs` pairs fit together well in a solution, so that no further check
/// is needed.
bool calibrate_pairs_fit(const calib::solution &found, int pairs);

/// Whether the pairs fit together when the right camera's pictures are mirrored back: a larger
/// share of them than in `as_they_are`, the solution of the unmirrored pairs, or much better. Tries
/// a dozen pairs. `progress` is called at the start of each step and may throw to abort.
bool calibrate_one_camera_mirrors(const calib::observations &seen, int threads,
                                  const calib::solution &as_they_are,
                                  const std::function<void(const char *)> &progress);

/// The same before the unmirrored pairs are solved, which is slow for many pairs that do not fit:
/// solves a dozen of them both ways.
bool calibrate_one_camera_mirrors_at_a_glance(const calib::observations &seen, int threads,
                                              const std::function<void(const char *)> &progress);

#endif
