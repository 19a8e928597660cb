// SPDX-License-Identifier: Apache-2.0
/// Converts light on a pixel to its value.
#ifndef VERGENCE_TOOLS_SIMRIG_RENDER_SENSOR_HPP
#define VERGENCE_TOOLS_SIMRIG_RENDER_SENSOR_HPP

#include <cstdint>

#include "tools/simrig/render/frame.hpp"

namespace world {

/// Position in the GRBG pair, 0 G (red row), 1 R, 2 B, 3 G (blue row), and its channel 0 R 1 G 2 B.
inline int bayer_place(int array_column, int array_row) {
    return (array_row & 1) * 2 + (array_column & 1);
}
inline int bayer_channel(int place) {
    constexpr int kChannels[4] = {1, 0, 2, 1};
    return kChannels[place];
}

/// Equivalent exposure time in steady light: the integral of the mains' flicker over it.
double lit_time_us(const Mains &mains, double start_us, double exposure_us);

/// Mean electrons of a pixel for one lux on it during the exposure.
double electrons_per_lux(const Sensor &sensor, int channel, double lit_us);

class PixelReader {
  public:
    PixelReader(const Sensor &sensor, const Gains &gains, std::uint64_t key);

    /// Electrons in one pixel: response of this very pixel, photon noise, full well.
    double collected(double mean_electrons, int array_column, int array_row) const;
    /// The number for collected electrons (the mean of `binned` pixels); each row has
    /// noise of its own.
    std::uint16_t number(double electrons, int binned, int place, int array_column,
                         int array_row) const;

  private:
    const Sensor &sensor_;
    const Gains &gains_;
    std::uint64_t key_;
    double dn_per_electron_;
};

}  // namespace world

#endif
