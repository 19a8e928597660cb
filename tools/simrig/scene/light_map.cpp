// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/scene/light_map.hpp"

#include <algorithm>

namespace world {
namespace {

using Numbers = double[12];

Arriving unpacked(const Numbers &v) {
    return {{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}}, {{v[6], v[7], v[8]}}, {v[9], v[10], v[11]}};
}

}  // namespace

void LightMap::allocate(const Vec3 &low_mm, double step_mm, const int (&nodes)[3]) {
    low_mm_ = low_mm;
    step_mm_ = step_mm;
    std::copy(nodes, nodes + 3, nodes_);
    values_.assign(index(0, 0, nodes[2]), 0.0F);
}

Vec3 LightMap::node_place(int x, int y, int z) const {
    return low_mm_ +
           step_mm_ * Vec3{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
}

void LightMap::set(int x, int y, int z, const Arriving &a) {
    const double v[kNumbers] = {a.lamp[0].x,         a.lamp[0].y,         a.lamp[0].z,
                                a.lamp[1].x,         a.lamp[1].y,         a.lamp[1].z,
                                a.around.channel[0], a.around.channel[1], a.around.channel[2],
                                a.slope.x,           a.slope.y,           a.slope.z};
    float *to = &values_[index(x, y, z)];
    for (std::size_t i = 0; i < kNumbers; i++) {
        to[i] = static_cast<float>(v[i]);
    }
}

Arriving LightMap::get(int x, int y, int z) const {
    Numbers v;
    const float *from = &values_[index(x, y, z)];
    std::copy(from, from + kNumbers, v);
    return unpacked(v);
}

Arriving LightMap::at(const Vec3 &place_mm) const {
    const Vec3 q = (1 / step_mm_) * (place_mm - low_mm_);
    const double place[3] = {q.x, q.y, q.z};
    int cell[3];
    double part[3];
    for (int k = 0; k < 3; k++) {
        const double bounded = std::min(std::max(place[k], 0.0), nodes_[k] - 1.0);
        cell[k] = std::min(static_cast<int>(bounded), std::max(nodes_[k] - 2, 0));
        part[k] = bounded - cell[k];
    }
    Numbers sum = {};
    const int layers = nodes_[2] > 1 ? 2 : 1;
    for (int dz = 0; dz < layers; dz++) {
        const double layer_weight = dz == 0 ? 1 - part[2] : part[2];
        const double wz = layers == 1 ? 1 : layer_weight;
        for (int dy = 0; dy < 2; dy++) {
            const double wy = wz * (dy == 0 ? 1 - part[1] : part[1]);
            const float *a = &values_[index(cell[0], cell[1] + dy, cell[2] + dz)];
            const float *b = a + kNumbers;
            const double wa = wy * (1 - part[0]);
            const double wb = wy * part[0];
            for (std::size_t i = 0; i < kNumbers; i++) {
                sum[i] += wa * static_cast<double>(a[i]) + wb * static_cast<double>(b[i]);
            }
        }
    }
    return unpacked(sum);
}

void LightMap::smooth() {
    const std::vector<float> old = values_;
    // Adds the neighbours of (x, y) in one row, weighted 1 2 1; returns the sum of the weights.
    const auto add_row = [&](int x, int y, int z, double row_weight, Numbers &sum) {
        double weight = 0;
        for (int near = std::max(x - 1, 0); near <= std::min(x + 1, nodes_[0] - 1); near++) {
            const double w = row_weight * (near == x ? 2.0 : 1.0);
            const float *from = &old[index(near, y, z)];
            for (std::size_t i = 0; i < kNumbers; i++) {
                sum[i] += w * static_cast<double>(from[i]);
            }
            weight += w;
        }
        return weight;
    };
    for (int z = 0; z < nodes_[2]; z++) {
        for (int y = 0; y < nodes_[1]; y++) {
            for (int x = 0; x < nodes_[0]; x++) {
                Numbers sum = {};
                double weight = 0;
                for (int near = std::max(y - 1, 0); near <= std::min(y + 1, nodes_[1] - 1);
                     near++) {
                    weight += add_row(x, near, z, near == y ? 2.0 : 1.0, sum);
                }
                float *to = &values_[index(x, y, z)];
                for (std::size_t i = 0; i < kNumbers; i++) {
                    to[i] = static_cast<float>(sum[i] / weight);
                }
            }
        }
    }
}

}  // namespace world
