// SPDX-License-Identifier: Apache-2.0
/// Outlines of objects as a drawing shows them: seen along one axis of the world, from far away.
#ifndef VERGENCE_SIMRIG_SERVER_OUTLINE_HPP
#define VERGENCE_SIMRIG_SERVER_OUTLINE_HPP

#include <vector>

#include "tools/simrig/scene/scene.hpp"

namespace simrig {

/// Which two coordinates of the world a drawing shows.
enum class Plane { kTop, kSide };  ///< z and x, z and y

world::Vec2 flattened(Plane plane, const world::Vec3 &point_mm);

using Outline = std::vector<world::Vec2>;

/// One convex outline for each part of a body; one for a sheet.
std::vector<Outline> outlines_of(const world::Object &object, Plane plane);

}  // namespace simrig

#endif
