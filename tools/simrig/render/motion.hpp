// SPDX-License-Identifier: Apache-2.0
/// The camera while rows are exposed: at as many moments as its motion and their blur ask for.
#ifndef VERGENCE_TOOLS_SIMRIG_RENDER_MOTION_HPP
#define VERGENCE_TOOLS_SIMRIG_RENDER_MOTION_HPP

#include <array>
#include <map>
#include <vector>

#include "tools/simrig/render/frame.hpp"
#include "tools/simrig/render/tile.hpp"

namespace world {

/// A camera state with what follows from it.
struct State {
    Camera camera;
    Camera colour[3];  ///< the same in red, green and blue
    std::vector<Pose> object_camera;
    std::vector<Candidate> candidates;  ///< of the block at hand
};

/// Of the rows [row_begin, row_end) of a frame, which it refers to.
class Motion {
  public:
    Motion(const Scene &scene, const RigCamera &rig_camera, const FrameRequest &request,
           int row_begin, int row_end);

    /// Whether the rows may share their moments: between the first and the last of them the image
    /// changes little.
    bool rows_alike() const;

    /// 1 to 16 moments, a power of two: how many states a block around this pixel needs that sees
    /// these candidates. One where the image moves little against its blur.
    int moments(Vec2 pixel, const std::vector<Candidate> &candidates) const;

    /// The least radius of the blur of what these candidates can show, throughout the exposure.
    double least_blur_px(const std::vector<Candidate> &candidates) const;

    /// The states at equally spaced moments of the exposure.
    std::vector<State> &states(int count);

  private:
    struct Depths {
        double near_mm, far_mm;
    };
    static Depths depths_of(const std::vector<Candidate> &candidates);
    double change_px(Vec2 pixel, const Depths &depths) const;

    const Scene &scene_;
    const RigCamera &rig_camera_;
    const FrameRequest &request_;
    double start_us_;     // when the middle row's exposure begins
    double duration_us_;  // from the first row's beginning to the last row's end
    double shutter_us_;   // from the first row's beginning to that of the last
    bool stands_ = true;
    std::array<Camera, 5> sampled_;
    std::map<int, std::vector<State>> states_;
};

double row_start_us(const FrameRequest &request, int row);

}  // namespace world

#endif
