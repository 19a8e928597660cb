// SPDX-License-Identifier: Apache-2.0
/// Pixels whose rays all hit one smooth surface: one ray, and the texture through a filter.
#ifndef VERGENCE_TOOLS_SIMRIG_RENDER_SMOOTH_HPP
#define VERGENCE_TOOLS_SIMRIG_RENDER_SMOOTH_HPP

#include "tools/simrig/render/ray.hpp"

namespace world {

/// The middle ray of such a pixel at one moment: its mean luminance, and what it hit in `memory`.
/// False: the texture needs more rays.
bool smooth_luminance(const View &view, const PixelTask &task, const PixelMoment &moment,
                      Remembered &memory, double &luminance);

/// `views`: of the block's corners, in the order of BlockLight, and of its middle.
Patch find_patch(const View &view, const PixelView (&views)[5],
                 const std::vector<Candidate> &candidates);

}  // namespace world

#endif
