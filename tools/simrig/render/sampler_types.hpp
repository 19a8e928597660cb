// SPDX-License-Identifier: Apache-2.0
/// The types of sampler.hpp.
#ifndef VERGENCE_TOOLS_SIMRIG_RENDER_SAMPLER_TYPES_HPP
#define VERGENCE_TOOLS_SIMRIG_RENDER_SAMPLER_TYPES_HPP

#include <array>
#include <cstdint>
#include <vector>

#include "tools/simrig/render/shade.hpp"
#include "tools/simrig/render/tile.hpp"
#include "tools/simrig/world/random.hpp"

namespace world {

/// Where a uniform number falls: the pixel's width, softened by the lens's spot. Strata of 2, 4 and
/// 8 equal shares have known middles and variances.
class Aperture {
  public:
    /// `spot_rms_px` 0: the pixel alone. Offsets are in pixels from its middle.
    explicit Aperture(double spot_rms_px);

    double offset(unsigned share16) const { return quantile_[share16 >> 6]; }
    /// level -1: the whole; 0, 1, 2: 2, 4, 8 strata.
    double middle(int level, unsigned stratum) const {
        return middle_[static_cast<std::size_t>(level + 1)][stratum];
    }
    double variance(int level) const { return variance_[static_cast<std::size_t>(level + 1)]; }
    double reach() const { return quantile_[1023]; }

  private:
    std::array<double, 1024> quantile_;
    std::array<std::array<double, 8>, 4> middle_;
    std::array<double, 4> variance_;
};

/// What rays of one frame share.
struct View {
    const Scene *scene = nullptr;
    const Aperture *pixel_alone = nullptr;
    const Aperture *with_spot = nullptr;
    double spot_px = 0;  ///< rms radius of the lens's spot
    double texture = 1;  ///< see SurfacePlace
};

/// One pixel's rays through one camera state.
struct PixelView {
    Vec2 slopes;                    ///< direction through the pixel's middle
    double step[4] = {0, 0, 0, 0};  ///< change of slopes with the pixel: x/x, x/y, y/x, y/y
    double pixel_slope = 0;         ///< size of a pixel in slopes
    double pupil_radius_mm = 0;
    double focus_mm = 1;
};

/// Light at the corners of a block that a flat sheet covers: left and right above, then below.
struct BlockLight {
    LocalLight corner[4];
};

/// A body that curves little where it fills a block: what middle rays hit at the block's corners.
struct Patch {
    const Candidate *candidate = nullptr;  ///< null: none
    BlockLight light;
    Vec3 normal[4];
    double z[4];
};

/// One pixel at one moment of its exposure.
struct PixelMoment {
    PixelView view;
    const std::vector<Candidate> *candidates = nullptr;
    double z_from = 0;                        ///< where it starts smooth: nothing is nearer
    const BlockLight *block_light = nullptr;  ///< light on the one sheet, or null
    const Patch *patch = nullptr;             ///< shape of the one body, or null
    Vec2 block_place;                         ///< place of the pixel in the block, 0..1
};

struct PixelTask {
    const std::vector<PixelMoment> *moments = nullptr;  ///< one when nothing moves
    int channel = 1;
    bool starts_smooth = false;      ///< no edge of an object is near at any moment
    std::uint64_t key = 0;           ///< random key of this pixel
    double electrons_per_luminance;  ///< scale of the pixel's own noise
    double min_noise_e2 = 64;
};

}  // namespace world

#endif
