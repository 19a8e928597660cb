// SPDX-License-Identifier: Apache-2.0
// Band-limited noise from which all surfaces are made.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/simrig/world/vec.hpp"

namespace world {

// A periodic picture of noise with prefiltered copies. Mean 0, standard deviation 1 over all.
class NoiseTile {
  public:
    // `fall`: amplitude of an octave over that of the next coarser one.
    // The finest waves are 8 texels long, so that linear interpolation shows no grid.
    NoiseTile(std::uint64_t seed, double fall);

    // Value at a place (in texels; it repeats after kSize) as a filter of this rms radius sees it.
    double at(double x, double y, double rms_texels) const;

    static constexpr int kSize = 512;

  private:
    static constexpr int kLevels = 7;
    double at_level(int level, double x, double y) const;
    std::vector<std::int16_t> level_[kLevels];
};

// Isotropic tiles of independent noise: 0 rough (all octaves alike), 1 and 2 soft (finer octaves
// weaker). They are made once, at the first call.
const NoiseTile &noise_tile(int number);

// One layer on a surface: turned by an angle that is no fraction of a turn, `period_mm` long.
struct NoiseLayer {
    const NoiseTile *tile = nullptr;
    double along = 0;  // texels a mm, cosine and sine part
    double across = 0;
    double shift_x = 0;
    double shift_y = 0;
    double texels_per_mm = 0;

    NoiseLayer() = default;
    // `number` picks turn and shift; layers of different numbers do not line up.
    NoiseLayer(int tile_number, double period_mm, int number);

    double at(double u_mm, double v_mm, double rms_mm) const {
        return tile->at(along * u_mm + across * v_mm + shift_x,
                        along * v_mm - across * u_mm + shift_y, rms_mm * texels_per_mm);
    }
};

}  // namespace world
