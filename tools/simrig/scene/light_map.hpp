// SPDX-License-Identifier: Apache-2.0
/// Light that arrives at an object: computed once, because lights and objects do not move.
#ifndef VERGENCE_TOOLS_SIMRIG_SCENE_LIGHT_MAP_HPP
#define VERGENCE_TOOLS_SIMRIG_SCENE_LIGHT_MAP_HPP

#include <cstddef>
#include <vector>

#include "tools/simrig/world/vec.hpp"

namespace world {

/// Light at a place in free space: from each lamp a vector (its illuminance on a surface is the dot
/// product with the normal), and from everything else a mean and a slope.
struct Arriving {
    Vec3 lamp[2];   ///< white part, lux
    Colour around;  ///< illuminance on a surface of any direction
    Vec3 slope;     ///< changes of it with the normal
};

/// Light on a surface.
struct Lit {
    Colour lux;
    Vec3 lamp_direction[2];  ///< times illuminance, for highlights
    Vec3 towards;            ///< sum of the lamps' vectors
};

class LightMap {
  public:
    /// Values at the nodes of a box of `nodes` from `low_mm`, `step_mm` apart (object's frame).
    /// A sheet has one layer along z.
    void allocate(const Vec3 &low_mm, double step_mm, const int (&nodes)[3]);
    Vec3 node_place(int x, int y, int z) const;
    void set(int x, int y, int z, const Arriving &arriving);
    Arriving get(int x, int y, int z) const;
    int nodes(int axis) const { return nodes_[axis]; }

    /// Linear between the nodes. In the object's frame.
    Arriving at(const Vec3 &place_mm) const;
    double step_mm() const { return step_mm_; }
    /// Mean of each node with its neighbours in a layer: smooths the sampling noise.
    void smooth();

  private:
    static constexpr std::size_t kNumbers = 12;
    std::size_t index(int x, int y, int z) const {
        return kNumbers * static_cast<std::size_t>((z * nodes_[1] + y) * nodes_[0] + x);
    }
    Vec3 low_mm_;
    double step_mm_ = 1;
    int nodes_[3] = {0, 0, 0};
    std::vector<float> values_;
};

}  // namespace world

#endif
