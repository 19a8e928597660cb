// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/world/random.hpp"

#include <cmath>
#include <vector>

#include "tools/simrig/world/vec.hpp"

namespace world {
namespace {

// A digital net: coordinate d of point n is the XOR of the columns of n's bits. The pixel's two are
// Sobol's first ones (van der Corput, and the one with Pascal's triangle modulo 2); the pupil's
// were searched for, so that no place in the pixel goes with the same places in the pupil.
// random.hpp states their properties, and a test checks them.
constexpr unsigned kBits = 6;
constexpr unsigned kColumns[4][kBits] = {
    {0x20, 0x10, 0x08, 0x04, 0x02, 0x01},
    {0x20, 0x30, 0x28, 0x3C, 0x22, 0x33},
    {0x20, 0x10, 0x18, 0x3C, 0x32, 0x21},
    {0x20, 0x30, 0x18, 0x24, 0x32, 0x13},
};

// Each bit XORed with all above it: two numbers that differ first in one bit then differ in all
// below it, too. The net remains one. But points that fall into one stratum become pairs that lie
// opposite to each other, for any number of the pixel, and cause no error where light has a slope.
std::uint16_t mirrored_below(unsigned value) {
    for (unsigned shift = 1; shift < 16; shift *= 2) {
        value ^= value >> shift;
    }
    return static_cast<std::uint16_t>(value);
}

std::array<RayPoint, kMaxSamples> make_points() {
    std::array<RayPoint, kMaxSamples> points{};
    for (unsigned n = 0; n < kMaxSamples; n++) {
        for (std::size_t d = 0; d < 4; d++) {
            unsigned value = 0;
            for (unsigned bit = 0; bit < kBits; bit++) {
                value ^= ((n >> bit) & 1u) != 0 ? kColumns[d][bit] : 0;
            }
            points[n][d] = mirrored_below(value << (16 - kBits));
        }
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

const std::array<RayPoint, kMaxSamples> &ray_points() {
    static const std::array<RayPoint, kMaxSamples> points = make_points();
    return points;
}

double normal_from_bits(std::uint32_t bits) {
    static const std::vector<double> table = make_quantiles();
    const unsigned cell = bits >> 20;
    const double within = static_cast<double>(bits & 0xFFFFFu) * (1.0 / 1048576.0);
    return table[cell] + within * (table[cell + 1] - table[cell]);
}

}  // namespace world
