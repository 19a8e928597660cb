// SPDX-License-Identifier: Apache-2.0
/// One camera that mirrors its pictures (previews of webcams do): a plain board looks the same in a
/// mirror, so that each picture by itself seems right, and nothing fits together.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_MIRROR_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_MIRROR_HPP

#include <functional>

#include "calib/solve/solve.hpp"

/// Whether at least half of `pairs` pairs fit together in a solution, and well: no reason to ask
/// for more.
bool calibrate_pairs_fit(const calib::solution &found, int pairs);

/// Whether the pairs fit together when the right camera's pictures are mirrored back: a larger part
/// of them than in `as_they_are`, the solution of the pairs as they are, or much better. A dozen
/// pairs are tried. `progress` is told what begins, and may throw to give up.
bool calibrate_one_camera_mirrors(const calib::observations &seen, int threads,
                                  const calib::solution &as_they_are,
                                  const std::function<void(const char *)> &progress);

/// The same before the pairs are solved as they are, which takes long when they are many and do not
/// fit: a dozen of them are solved both ways.
bool calibrate_one_camera_mirrors_at_a_glance(const calib::observations &seen, int threads,
                                              const std::function<void(const char *)> &progress);

#endif
