// SPDX-License-Identifier: Apache-2.0
/// Light that leaves a surface towards the camera.
#ifndef VERGENCE_TOOLS_SIMRIG_RENDER_SHADE_HPP
#define VERGENCE_TOOLS_SIMRIG_RENDER_SHADE_HPP

#include "tools/simrig/scene/scene.hpp"

namespace world {

/// Light that arrives at one place of an object.
struct LocalLight {
    double lux[3] = {0, 0, 0};    ///< illuminance of the surface, by channel
    double sheen[3] = {0, 0, 0};  ///< luminance of what the surface mirrors
    Vec2 slant;                   ///< see SurfacePlace
};

/// `place`, `normal` and `from_eye` (unit, from the eye to the place) in the object's frame.
LocalLight light_at(const Scene &scene, const Object &object, const Vec3 &place, const Vec3 &normal,
                    const Vec3 &from_eye);

}  // namespace world

#endif
