// SPDX-License-Identifier: Apache-2.0
/// A scene: bodies and sheets with their materials, lights, and the light on them.
#ifndef VERGENCE_TOOLS_SIMRIG_SCENE_SCENE_HPP
#define VERGENCE_TOOLS_SIMRIG_SCENE_SCENE_HPP

#include <memory>
#include <string>
#include <vector>

#include "tools/simrig/scene/light_map.hpp"
#include "tools/simrig/scene/material.hpp"
#include "tools/simrig/scene/solid.hpp"

namespace world {

struct Object {
    std::string name;
    int id = 0;  ///< 1, 2, ... in the file's order; 0 is nothing
    Pose world_object;
    Pose object_world;
    std::unique_ptr<Solid> solid;  ///< null: the object is a sheet
    Sheet sheet;
    Material material;
    LightMap light;
    Vec3 middle_mm;  ///< centre of a sphere around the object, in the world
    double reach_mm = 0;

    Ray local(const Ray &ray) const {
        return {object_world * ray.origin_mm, object_world.rotation * ray.direction};
    }
};

/// A bright rectangle, such as a window; light leaves both sides.
struct AreaLight {
    Vec3 centre_mm;
    Vec3 half_u_mm;
    Vec3 half_v_mm;
    Colour luminance;  ///< lux per steradian
    Vec2 panes{0, 0};  ///< bars that its mirror image shows: how many panes along u and v
};

struct Scene {
    std::vector<std::unique_ptr<Object>> objects;
    std::vector<AreaLight> lights;
    Colour ambient;         ///< luminance of the room in directions where nothing is hit
    Colour floor_ambient;   ///< the same seen downwards
    Vec3 up{0, -1, 0};      ///< upward direction in the world
    double bounce_lux = 0;  ///< typical illuminance, for light that comes back from surfaces
};

struct Hit {
    double t = -1;
    const Object *object = nullptr;
};

/// Reads the text of a scene file called `name`, without its images, noise and light. Throws
/// BadFile.
Scene parse_scene(const std::string &name, const std::string &text);

/// Reads a scene file, loads the images beside it and computes its light. Throws BadFile.
Scene load_scene(const std::string &path);
/// The same with another text for the file.
Scene load_scene(const std::string &path, const std::string &text);

/// The nearest surface along a ray before t_far, to `tolerance` mm; object is null if none.
Hit nearest_hit(const Scene &scene, const Ray &ray, double t_far, double tolerance);

/// Computes every object's light map. Part of load_scene.
void light_scene(Scene &scene);

}  // namespace world

#endif
