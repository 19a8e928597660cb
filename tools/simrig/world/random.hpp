// SPDX-License-Identifier: Apache-2.0
/// Random numbers are hashes of what they belong to: independent of threads and windows.
#ifndef VERGENCE_SIMRIG_WORLD_RANDOM_HPP
#define VERGENCE_SIMRIG_WORLD_RANDOM_HPP

#include <array>
#include <cstdint>

namespace world {

/// Finaliser of splitmix64 (Steele, Lea, Flood 2014): every input bit reaches every output bit.
constexpr std::uint64_t mixed(std::uint64_t x) {
    x += 0x9E3779B97F4A7C15u;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
    return x ^ (x >> 31);
}

constexpr std::uint64_t mixed(std::uint64_t a, std::uint64_t b) {
    return mixed(mixed(a) ^ b);
}

/// [0, 1) from the upper 53 bits.
constexpr double unit_interval(std::uint64_t bits) {
    return static_cast<double>(bits >> 11) * (1.0 / 9007199254740992.0);
}

/// A stream of independent numbers for work outside the pixels' loops.
class Random {
  public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    std::uint64_t bits() { return mixed(state_++); }
    double uniform() { return unit_interval(bits()); }
    double uniform(double low, double high) { return low + (high - low) * uniform(); }

  private:
    std::uint64_t state_;
};

/// 64 points for pixel (x, y) and pupil (u, v), 16 bits each. Of pixel and of pupil every prefix of
/// 4, 16 and 64 has one point in each square of a grid of 2, 4 and 8; so have 16 and 64 of (x, u)
/// and of (y, v), which is what the blurred outline of a body asks for; and each quarter of the
/// pixel has met each quarter of the pupil after 16. All keep that when each number is XORed with
/// one of the pixel's own.
constexpr int kMaxSamples = 64;
using RayPoint = std::array<std::uint16_t, 4>;
const std::array<RayPoint, kMaxSamples> &ray_points();

/// Value of the standard normal distribution at a probability (table of its inverse, linear between
/// 4096 steps of probability with finer tails). `bits`: 32 random bits. Its variance is 1 to 1e-4.
double normal_from_bits(std::uint32_t bits);

}  // namespace world

#endif
