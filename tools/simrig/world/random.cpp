// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/world/random.hpp"

#include <cmath>
#include <vector>

#include "tools/simrig/world/vec.hpp"

namespace world {
namespace {

// Sobol's first two dimensions (van der Corput, and the one with Pascal's triangle modulo 2).
std::array<std::uint16_t, 2> sobol_pair(unsigned index) {
    unsigned x = 0;
    unsigned y = 0;
    unsigned column = 0x8000u;
    for (unsigned bit = 0; bit < 16; bit++) {
        if (((index >> bit) & 1u) != 0) {
            x ^= 0x8000u >> bit;
            y ^= column;
        }
        column ^= column >> 1;
    }
    return {static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y)};
}

// Both pairs are the same sequence; the second one's base-4 digits are turned by the digits before
// them, so that no place in the pixel always goes with the same place in the pupil.
std::array<SobolPoint, kMostSamples> make_sobol() {
    std::array<SobolPoint, kMostSamples> points{};
    for (unsigned n = 0; n < kMostSamples; n++) {
        const unsigned a = n & 3u;
        const unsigned b = (n >> 2) & 3u;
        const unsigned c = n >> 4;
        const unsigned turned =
            ((a * 3 + 1) & 3u) | (((b + a + 2) & 3u) << 2) | (((c + 2 * b + a + 1) & 3u) << 4);
        const auto first = sobol_pair(n);
        const auto second = sobol_pair(turned);
        points[n] = {first[0], first[1], second[0], second[1]};
    }
    return points;
}

// Inverse of the normal distribution: Newton on erfc from a rough start.
double normal_quantile(double probability) {
    double x = 0;
    for (int i = 0; i < 60; i++) {
        const double error = 0.5 * std::erfc(-x / std::sqrt(2.0)) - probability;
        const double density = std::exp(-0.5 * x * x) / std::sqrt(2 * kPi);
        const double step = error / density;
        x -= std::fmin(std::fmax(step, -0.5), 0.5);
    }
    return x;
}

constexpr unsigned kSteps = 4096;

std::vector<double> make_quantiles() {
    std::vector<double> table(kSteps + 1);
    for (unsigned i = 1; i < kSteps; i++) {
        table[i] = normal_quantile(static_cast<double>(i) / kSteps);
    }
    table[0] = normal_quantile(0.5 / kSteps / 16);
    table[kSteps] = -table[0];
    return table;
}

}  // namespace

const std::array<SobolPoint, kMostSamples> &sobol_points() {
    static const std::array<SobolPoint, kMostSamples> points = make_sobol();
    return points;
}

double normal_from_bits(std::uint32_t bits) {
    static const std::vector<double> table = make_quantiles();
    const unsigned cell = bits >> 20;
    const double within = static_cast<double>(bits & 0xFFFFFu) * (1.0 / 1048576.0);
    return table[cell] + within * (table[cell + 1] - table[cell]);
}

}  // namespace world
