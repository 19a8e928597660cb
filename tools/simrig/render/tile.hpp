// SPDX-License-Identifier: Apache-2.0
/// Finds the objects that a small block of pixels can see, and from which depth on.
#ifndef VERGENCE_TOOLS_SIMRIG_RENDER_TILE_HPP
#define VERGENCE_TOOLS_SIMRIG_RENDER_TILE_HPP

#include <vector>

#include "tools/simrig/scene/scene.hpp"
#include "tools/simrig/world/camera.hpp"

namespace world {

/// Every ray of the block from every point of the pupil: around the middle ray, at depth z, within
/// pupil_radius * |1 - z / focus| + spread * z.
struct Beam {
    Vec2 middle;  ///< slopes
    double spread = 0;
    double pupil_radius_mm = 0;
    double focus_mm = 0;

    double radius(double z) const {
        return pupil_radius_mm * std::fabs(1 - z / focus_mm) + spread * z;
    }
};

/// The beam of array pixels low..high, their whole area and `margin_px` around.
Beam beam_of(const Camera &camera, Vec2 low, Vec2 high, double margin_px);

struct Candidate {
    const Object *object = nullptr;
    Pose object_camera;
    double z_near = 0;  ///< minimum depth
    double z_far = 0;
    PartMask parts = 0;
    bool covers = false;  ///< a flat sheet that the whole beam hits
    bool hides = false;   ///< a body that stops the whole beam before z_hidden
    double z_hidden = 0;
};

/// Objects that the beam may hit, by z_near. `object_camera`: of all objects, in the scene's order.
void find_candidates(const Scene &scene, const std::vector<Pose> &object_camera, const Beam &beam,
                     std::vector<Candidate> &found);

}  // namespace world

#endif
