// SPDX-License-Identifier: Apache-2.0
/// Random numbers of the devices: the same for a seed on every machine.
#ifndef VERGENCE_SIMRIG_DEVICES_NOISE_HPP
#define VERGENCE_SIMRIG_DEVICES_NOISE_HPP

#include <cmath>
#include <cstdint>

namespace simrig {

/// Steele's splitmix64.
class Noise {
  public:
    explicit Noise(uint64_t seed) : state_(seed) {}

    uint64_t next() {
        uint64_t z = state_ += 0x9E3779B97F4A7C15u;
        z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
        z = (z ^ z >> 27) * 0x94D049BB133111EBu;
        return z ^ z >> 31;
    }
    /// 0 <= x < 1
    double uniform() { return double(next() >> 11) * 0x1p-53; }
    /// Mean 0, sigma 1 (Box and Muller).
    double gauss() {
        const double radius = std::sqrt(-2 * std::log(1 - uniform()));
        return radius * std::cos(2 * 3.14159265358979323846 * uniform());
    }
    bool chance(double probability) { return uniform() < probability; }

  private:
    uint64_t state_;
};

}  // namespace simrig

#endif
