// SPDX-License-Identifier: Apache-2.0
/// Ready-made scenes, described in the pixels and disparities of a rectified rig's left image.
#ifndef VERGENCE_TESTS_SYNTHETIC_SCENES_HPP
#define VERGENCE_TESTS_SYNTHETIC_SCENES_HPP

#include "synthetic/pair.hpp"

namespace synthetic {

/// Builds surfaces for one rectified rig. Disparities include the rig's disparity at infinity.
class Builder {
  public:
    Builder(const Rig &rig, uint64_t seed) : rig_(rig), random_(seed) {}

    /// Noise with cells of `cell_px` in the image at that disparity.
    Texture noise(double disparity_px, double cell_px, double contrast, double coarse_share = 0.3);
    Texture stripes(double disparity_px, double period_px, double contrast) const;
    static Texture constant(double mean);

    /// disparity = at_centre + slope_x (x - cx) + slope_y (y - cy), without bounds.
    Surface plane(double at_centre_px, double slope_x, double slope_y,
                  const Texture &texture) const;

    /// Fronto-parallel piece that covers columns [x, x + width) and rows [y, y + height) of the
    /// left image (pixel edges: x - 0.5 is the left edge of column x).
    Surface piece(double disparity_px, double x, double y, double width, double height,
                  const Texture &texture) const;

    /// Sphere whose nearest point is at (x, y) with that disparity; radius in pixels there.
    Surface sphere(double disparity_px, double x, double y, double radius_px,
                   const Texture &texture) const;

    /// The same window cut into a plane instead.
    Rectangle window(double disparity_px, double x, double y, double width, double height) const;

    double depth_mm(double disparity_px) const;
    Random &random() { return random_; }

  private:
    Rig rig_;
    Random random_;
};

/// Textures of a whole scene.
struct Look {
    double cell_px = 3.0;
    double contrast = 0.15;
};

/// Planes, a sphere, steps, thin bars and a hole in front of a slanted wall, disparities from
/// `nearest - 28` to `nearest` px in an image of at least 160x120.
Scene everything(const Rig &rig, double nearest_px, const Look &look, uint64_t seed);

/// One wall: disparity = at_centre + slope_x (x - cx) + slope_y (y - cy).
Scene wall(const Rig &rig, double at_centre_px, double slope_x, double slope_y, const Look &look,
           uint64_t seed);

/// A fronto-parallel foreground rectangle in front of a fronto-parallel wall.
Scene step(const Rig &rig, double near_px, double far_px, const Look &look, uint64_t seed);

}  // namespace synthetic

#endif
