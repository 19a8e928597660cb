// SPDX-License-Identifier: Apache-2.0
/// Band-limited noise for all surface textures.
#ifndef VERGENCE_TOOLS_SIMRIG_SCENE_NOISE_TILE_HPP
#define VERGENCE_TOOLS_SIMRIG_SCENE_NOISE_TILE_HPP

#include <cstdint>
#include <cstring>
#include <vector>

#include "tools/simrig/world/vec.hpp"

namespace world {

/// A periodic picture of noise with prefiltered copies. Mean 0, standard deviation 1 over all.
class NoiseTile {
  public:
    /// `fall`: amplitude of an octave over that of the next coarser one.
    /// The finest waves are 8 texels long, so that linear interpolation shows no grid.
    NoiseTile(std::uint64_t seed, double fall);

    /// Value at a place (in texels; it repeats after kSize) as a filter of this rms radius sees it.
    double at(double x, double y, double rms_texels) const;

    static constexpr int kSize = 512;

  private:
    static constexpr int kLevels = 7;
    static constexpr double kUnit = 4096;  ///< scale of stored numbers: 8 standard deviations fit
    double at_level(int level, double x, double y) const;
    std::vector<std::int16_t> level_[kLevels];
};

inline double NoiseTile::at_level(int level, double x, double y) const {
    const int size = kSize >> level;
    const int mask = size - 1;
    const double scale = 1.0 / (1 << level);
    const double xs = x * scale;
    const double ys = y * scale;
    int xi = static_cast<int>(xs);
    xi -= xs < xi;
    int yi = static_cast<int>(ys);
    yi -= ys < yi;
    const double fx = xs - xi;
    const double fy = ys - yi;
    const std::int16_t *data = level_[level].data();
    const std::int16_t *upper = data + static_cast<std::ptrdiff_t>(yi & mask) * size;
    const std::int16_t *lower = data + static_cast<std::ptrdiff_t>((yi + 1) & mask) * size;
    const int x0 = xi & mask;
    const int x1 = (xi + 1) & mask;
    const double a = upper[x0] + fx * (upper[x1] - upper[x0]);
    const double b = lower[x0] + fx * (lower[x1] - lower[x0]);
    return (a + fy * (b - a)) * (1 / kUnit);
}

inline double NoiseTile::at(double x, double y, double rms_texels) const {
    /// Level n has seen Gaussians of variance 0.81 (4^n - 1) / 3 texels^2.
    const double ratio = 1 + rms_texels * rms_texels * (3 / 0.81);
    /// log4 of the ratio, linear between powers of two: it only blends two levels.
    std::uint64_t bits = 0;
    std::memcpy(&bits, &ratio, sizeof bits);
    const double log2 = static_cast<double>(static_cast<std::int64_t>(bits)) * (1.0 / (1LL << 52));
    const double place = 0.5 * (log2 - 1023);
    if (place >= kLevels - 1) {
        const double fade = 1 / (place - (kLevels - 2));
        return at_level(kLevels - 1, x, y) * fade * fade;
    }
    /// Levels are blended in the middle between them only: half of the work for an invisible
    /// difference.
    const int level = static_cast<int>(place);
    const double part = (place - level - 0.3) * 2.5;
    if (part <= 0) {
        return at_level(level, x, y);
    }
    const double coarse = at_level(level + 1, x, y);
    return part >= 1 ? coarse : coarse + (1 - part) * (at_level(level, x, y) - coarse);
}

/// Isotropic tiles of independent noise: 0 rough (all octaves alike), 1 and 2 soft (finer octaves
/// weaker). Computed once, at the first call.
const NoiseTile &noise_tile(int number);

/// One layer on a surface: rotated by an irrational part of a turn, `period_mm` long.
struct NoiseLayer {
    const NoiseTile *tile = nullptr;
    double along = 0;  ///< texels a mm, cosine and sine part
    double across = 0;
    double shift_x = 0;
    double shift_y = 0;
    double texels_per_mm = 0;

    NoiseLayer() = default;
    /// `number` picks turn and shift; layers of different numbers do not line up.
    NoiseLayer(int tile_number, double period_mm, int number);

    double at(double u_mm, double v_mm, double rms_mm) const {
        return tile->at(along * u_mm + across * v_mm + shift_x,
                        along * v_mm - across * u_mm + shift_y, rms_mm * texels_per_mm);
    }
};

}  // namespace world

#endif
