// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/scene/noise_tile.hpp"

#include <algorithm>
#include <cmath>

#include "tools/simrig/world/random.hpp"

namespace world {
namespace {

using Field = std::vector<double>;

// Periodic filter with these symmetric weights (centre first) along rows and columns.
Field filtered(const Field &in, int size, const std::vector<double> &weights) {
    const int reach = static_cast<int>(weights.size()) - 1;
    Field rows(in.size());
    Field out(in.size());
    const auto at = [size](int y, int x) {
        return static_cast<std::size_t>((y & (size - 1)) * size + (x & (size - 1)));
    };
    for (int y = 0; y < size; y++) {
        for (int x = 0; x < size; x++) {
            double sum = weights[0] * in[at(y, x)];
            for (int k = 1; k <= reach; k++) {
                sum += weights[static_cast<std::size_t>(k)] * (in[at(y, x - k)] + in[at(y, x + k)]);
            }
            rows[at(y, x)] = sum;
        }
    }
    for (int y = 0; y < size; y++) {
        for (int x = 0; x < size; x++) {
            double sum = weights[0] * rows[at(y, x)];
            for (int k = 1; k <= reach; k++) {
                sum += weights[static_cast<std::size_t>(k)] *
                       (rows[at(y - k, x)] + rows[at(y + k, x)]);
            }
            out[at(y, x)] = sum;
        }
    }
    return out;
}

std::vector<double> gaussian(double sigma) {
    std::vector<double> weights;
    double sum = 0;
    for (int k = 0; k <= static_cast<int>(std::ceil(3.5 * sigma)); k++) {
        weights.push_back(std::exp(-0.5 * k * k / (sigma * sigma)));
        sum += (k == 0 ? 1 : 2) * weights.back();
    }
    for (double &w : weights) {
        w /= sum;
    }
    return weights;
}

// Twice as many texels: zeros between, then a Gaussian that lets nothing of the old grid through.
Field doubled(const Field &in, int size) {
    Field spread(in.size() * 4, 0.0);
    for (int y = 0; y < size; y++) {
        for (int x = 0; x < size; x++) {
            spread[static_cast<std::size_t>(2 * y * 2 * size + 2 * x)] =
                4 * in[static_cast<std::size_t>(y * size + x)];
        }
    }
    return filtered(spread, 2 * size, gaussian(1.4));
}

void scale_to_unit(Field &field) {
    double mean = 0;
    for (const double v : field) {
        mean += v;
    }
    mean /= static_cast<double>(field.size());
    double square = 0;
    for (double &v : field) {
        v -= mean;
        square += v * v;
    }
    const double scale = 1 / std::sqrt(square / static_cast<double>(field.size()));
    for (double &v : field) {
        v *= scale;
    }
}

Field octave(Random &random, int size) {
    Field white(static_cast<std::size_t>(size * size));
    for (double &v : white) {
        v = normal_from_bits(static_cast<std::uint32_t>(random.bits()));
    }
    // Waves of about 8 to 20 texels.
    Field smooth = filtered(white, size, gaussian(1.9));
    scale_to_unit(smooth);
    return smooth;
}

std::vector<std::int16_t> stored(const Field &field, double unit) {
    std::vector<std::int16_t> out(field.size());
    for (std::size_t i = 0; i < field.size(); i++) {
        out[i] =
            static_cast<std::int16_t>(std::lround(std::clamp(field[i] * unit, -32767.0, 32767.0)));
    }
    return out;
}

}  // namespace

NoiseTile::NoiseTile(std::uint64_t seed, double fall) {
    Random random(mixed(seed));
    int size = 16;
    Field sum = octave(random, size);
    double amplitude = 1;
    while (size < kSize) {
        sum = doubled(sum, size);
        size *= 2;
        amplitude *= fall;
        const Field next = octave(random, size);
        for (std::size_t i = 0; i < sum.size(); i++) {
            sum[i] += amplitude * next[i];
        }
    }
    scale_to_unit(sum);
    level_[0] = stored(sum, kUnit);
    for (int level = 1; level < kLevels; level++) {
        const Field soft = filtered(sum, size, gaussian(0.9));
        Field half(soft.size() / 4);
        size /= 2;
        for (int y = 0; y < size; y++) {
            for (int x = 0; x < size; x++) {
                half[static_cast<std::size_t>(y * size + x)] =
                    soft[static_cast<std::size_t>(4 * y * size + 2 * x)];
            }
        }
        sum = half;
        level_[level] = stored(sum, kUnit);
    }
}

const NoiseTile &noise_tile(int number) {
    static const NoiseTile tiles[3] = {NoiseTile(11, 0.95), NoiseTile(12, 0.62),
                                       NoiseTile(13, 0.62)};
    return tiles[number];
}

NoiseLayer::NoiseLayer(int tile_number, double period_mm, int number)
    : tile(&noise_tile(tile_number)), texels_per_mm(NoiseTile::kSize / period_mm) {
    // Multiples of the golden angle never line up.
    const double turn = 2.399963229728653 * number + 0.3;
    along = texels_per_mm * std::cos(turn);
    across = texels_per_mm * std::sin(turn);
    shift_x = NoiseTile::kSize * unit_interval(mixed(static_cast<std::uint64_t>(2 * number)));
    shift_y = NoiseTile::kSize * unit_interval(mixed(static_cast<std::uint64_t>(2 * number + 1)));
}

}  // namespace world
