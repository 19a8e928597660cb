// SPDX-License-Identifier: Apache-2.0
/// A texture, blurred by discs of growing diameter: what a lens out of focus makes of it.
#ifndef VERGENCE_TESTS_FOCUS_BLUR_STACK_HPP
#define VERGENCE_TESTS_FOCUS_BLUR_STACK_HPP

#include <array>
#include <cstddef>
#include <vector>

#include "tools/simrig/devices/noise.hpp"

namespace focus {

enum class TextureKind { kPower, kEdges, kStep, kBars, kLights };
constexpr int kTextureKinds = 5;
extern const char *const kTextureNames[kTextureKinds];

/// What a window shows.
struct Texture {
    TextureKind kind = TextureKind::kPower;
    double slope = 1;       ///< exponent of kPower: the amplitude falls as 1 / frequency^slope
    double contrast = 0.1;  ///< rms over mean, before any blur
};

/// The part that each level of a stack has in an image; they follow one another.
struct BlurMix {
    std::size_t first = 0;
    std::vector<float> parts;
};

class BlurStack {
  public:
    /// The texture repeats itself after this many pixels in both directions.
    static constexpr std::size_t kSize = 256;

    /// Relative radiance, 1 on average, blurred by a Gaussian (rms in pixels) and by the discs.
    void build(const Texture &texture, double spot_px, simrig::Noise &noise);

    /// Adds `part` of an image blurred by a disc of this diameter.
    void add(BlurMix &mix, double diameter_px, double part) const;
    const float *level(std::size_t index) const { return levels_[index].data(); }
    double spot_px() const { return spot_px_; }

  private:
    double spot_px_ = 0;
    std::vector<std::vector<float>> levels_;
};

}  // namespace focus

#endif
