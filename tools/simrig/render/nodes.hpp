// SPDX-License-Identifier: Apache-2.0
/// Light of a frame where it is far out of focus: seen at nodes, and cubic between them.
#ifndef VERGENCE_TOOLS_SIMRIG_RENDER_NODES_HPP
#define VERGENCE_TOOLS_SIMRIG_RENDER_NODES_HPP

#include <array>
#include <functional>
#include <unordered_map>

#include "tools/simrig/render/motion.hpp"
#include "tools/simrig/render/sampler.hpp"

namespace world {

/// Of one thread: what a node shows depends on nothing but its place, so that it does not matter
/// who looks first. For windows that leave no pixels out. Refers to all that it is made of.
class Nodes {
  public:
    Nodes(const Scene &scene, const RigCamera &rig_camera, const FrameRequest &request,
          std::function<View(Vec2 pixel)> view_at, std::uint64_t key);

    /// The distance of nodes in pixels that this radius of the blur allows; 0: it is too small.
    static int pitch_for(double blur_px);
    /// Mean luminance over a pixel and the pupil; `pixel` as green sees it, on the array.
    double luminance(Vec2 pixel, int channel, int pitch);

  private:
    const Colour &node(int pitch, int column, int row);
    Colour seen(int pitch, int x, int y);

    const Scene &scene_;
    const RigCamera &rig_camera_;
    const FrameRequest &request_;
    std::function<View(Vec2)> view_at_;
    std::uint64_t key_;
    std::unordered_map<std::uint64_t, Colour> nodes_;
    std::map<int, Motion> rows_;
};

}  // namespace world

#endif
