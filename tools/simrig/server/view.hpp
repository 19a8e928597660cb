// SPDX-License-Identifier: Apache-2.0
/// Images of what both cameras see, and a drawing of rig and scene.
#ifndef VERGENCE_SIMRIG_SERVER_VIEW_HPP
#define VERGENCE_SIMRIG_SERVER_VIEW_HPP

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "tools/simrig/render/frame.hpp"
#include "tools/simrig/scene/scene.hpp"

namespace simrig {

struct View {
    std::array<world::Mechanics, 2> mechanics;  ///< left, right
    uint64_t seed = 1;
    int threads = 1;
};

/// The rig at rest as its file has it, zoomed `zoom` times (1 to 10) and focused at `focus_mm` from
/// the entrance pupils.
View view_at(const world::Rig &rig, double zoom, double focus_mm);

/// Writes `prefix`left.png, right.png (demosaiced) and rig.svg (see rig_drawing()). done: called
/// with the number of kViewFiles written so far. Throws std::runtime_error with one line when a
/// file cannot be written.
constexpr int kViewFiles = 3;
void write_view(const world::Scene &scene, const world::Rig &rig, const View &view,
                const std::string &prefix, const std::function<void(int)> &done = {});

/// The rig and its scene from above and from the side, to one scale, as an SVG drawing: cameras,
/// what each can see, objects, distances in mm.
std::string rig_drawing(const world::Scene &scene, const world::Rig &rig, const View &view);

/// Outlines of objects as a drawing shows them: seen along one axis of the world, from far away.

/// Which two coordinates of the world a drawing shows.
enum class Plane { kTop, kSide };  ///< z and x, z and y

world::Vec2 flattened(Plane plane, const world::Vec3 &point_mm);

using Outline = std::vector<world::Vec2>;

/// One convex outline for each part of a body; one for a sheet.
std::vector<Outline> outlines_of(const world::Object &object, Plane plane);

}  // namespace simrig

#endif
