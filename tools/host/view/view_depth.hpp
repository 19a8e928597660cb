// SPDX-License-Identifier: Apache-2.0
/// Live depth: a pair of the view, rectified and matched at a part of its size.
#ifndef VERGENCE_TOOLS_HOST_VIEW_VIEW_DEPTH_HPP
#define VERGENCE_TOOLS_HOST_VIEW_VIEW_DEPTH_HPP

#include <cstdint>
#include <memory>
#include <string>

struct view_picture;

/// What the page gets: a line of JSON, then little-endian arrays of its `width` x `height`:
/// disparity in 1/256 px (int32), its standard deviation in 1/256 px (uint16; only if `refined`),
/// reason (uint8), and the rectified left and right image (uint8).
struct view_depth {
    std::uint64_t number = 0;
    std::string bytes;
    std::string error;
};

struct view_depth_request {
    double near_mm = 0, far_mm = 0;  ///< 0 0: the depths of the calibration
    bool refined = false;  ///< with exact disparities and deviations, which takes twice the time
};

class view_depth_maker {
  public:
    /// All of one thread.
    view_depth_maker();
    ~view_depth_maker();
    view_depth_maker(const view_depth_maker &) = delete;
    view_depth_maker &operator=(const view_depth_maker &) = delete;

    std::shared_ptr<view_depth> make(const view_picture &picture, const view_depth_request &asked);

  private:
    struct state;
    std::unique_ptr<state> state_;
};

#endif
