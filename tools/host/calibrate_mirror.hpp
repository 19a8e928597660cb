// SPDX-License-Identifier: Apache-2.0
/// One camera that mirrors its pictures (previews of webcams do): a plain board looks the same in a
/// mirror, so that each picture by itself seems right, and nothing fits together.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_MIRROR_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_MIRROR_HPP

#include "calib/solve.hpp"

/// Whether the pairs fit together when the right camera's pictures are mirrored back, and more of
/// them than `pairs_used`. For pairs that did not fit as they are.
bool calibrate_one_camera_mirrors(const calib::observations &seen, int threads, int pairs_used);

#endif
