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

/// Why pairs do not fit together although each camera's pictures do.
enum class calibrate_pair_fault {
    none,         // not so: a camera's own pictures do not fit, there are few pairs, or most agree
    one_mirrors,  // most pairs agree about the rig once the right pictures are mirrored back
    apart,        // no such thing: left and right did not show the board at the same place
};

/// Compares where each camera alone saw the boards of a dozen pairs. `progress` is called at the
/// start of each step and may throw to abort.
calibrate_pair_fault calibrate_find_pair_fault(const calib::observations &seen, int threads,
                                               const std::function<void(const char *)> &progress);

/// Whether one camera mirrors, before all pairs are solved, which is slow for many that do not fit:
/// solves a dozen of them, both ways if they do not fit.
bool calibrate_one_camera_mirrors_at_a_glance(const calib::observations &seen, int threads,
                                              const std::function<void(const char *)> &progress);

#endif
