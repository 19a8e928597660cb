// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/render/shade.hpp"

#include <algorithm>

namespace world {
namespace {

double smooth_step(double x) {
    const double t = std::clamp(x, 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

// The lamps are wide: around the edge of their light the surface does not darken at once.
double wrapped_cosine(const Vec3 &normal, const Vec3 &lamp) {
    const double x = dot(normal, lamp);
    const double soft = 0.12 * length(lamp);
    if (x >= soft) {
        return x;
    }
    return x <= -soft ? 0 : (x + soft) * (x + soft) / (4 * soft);
}

// Part of the lamp's picture that a mirror in this direction shows, bars between panes included.
double mirrored(const AreaLight &lamp, const Vec3 &place, const Vec3 &direction, double blur_rad) {
    const Vec3 facing = cross(lamp.half_u_mm, lamp.half_v_mm);
    const Vec3 to = lamp.centre_mm - place;
    const double t = dot(to, facing) / dot(direction, facing);
    if (!(t > 0)) {
        return 0;
    }
    const Vec3 off = t * direction - to;
    const double uu = dot(lamp.half_u_mm, lamp.half_u_mm);
    const double vv = dot(lamp.half_v_mm, lamp.half_v_mm);
    const double u = dot(off, lamp.half_u_mm) / uu;
    const double v = dot(off, lamp.half_v_mm) / vv;
    const double wide_u = 2 * blur_rad * t / std::sqrt(uu);
    const double wide_v = 2 * blur_rad * t / std::sqrt(vv);
    const double edge_u = smooth_step((1 - std::fabs(u)) / wide_u + 0.5);
    const double edge_v = smooth_step((1 - std::fabs(v)) / wide_v + 0.5);
    if (edge_u * edge_v <= 0) {
        return 0;
    }
    // A bar is 0.05 of the half size wide; softened it becomes fainter.
    const auto bar = [](double x, double panes, double wide) {
        const double place_in_panes = 0.5 * (x + 1) * panes;
        const double nearest = std::round(place_in_panes);
        if (nearest <= 0 || nearest >= panes) {
            return 0.0;
        }
        const double off_bar = std::fabs(place_in_panes - nearest) * 2 / panes;
        const double width = std::max(wide, 0.01);
        return smooth_step((0.05 - off_bar) / width + 0.5) * std::min(1.0, 0.1 / width);
    };
    const double clear = (1 - bar(u, lamp.panes.x, wide_u)) * (1 - bar(v, lamp.panes.y, wide_v));
    return edge_u * edge_v * clear;
}

// Reflection of a mirror: the room, brighter above, and the lamps where unobstructed.
void add_sheen(const Scene &scene, const Object &object, const Arriving &arriving,
               const Vec3 &place, const Vec3 &normal, const Vec3 &from_eye, LocalLight &light) {
    const Material &material = object.material;
    const double cosine = std::clamp(-dot(normal, from_eye), 0.0, 1.0);
    const double grazing = 1 - cosine;
    const double g2 = grazing * grazing;
    const double strength = material.gloss + (1 - material.gloss) * g2 * g2 * grazing * 0.6;
    const Vec3 away_local = from_eye + 2 * cosine * normal;
    const Vec3 away = object.world_object.rotation * away_local;
    const Vec3 at = object.world_object * place;
    const double upward = 0.5 + 0.5 * dot(away, scene.up);
    const double sky = smooth_step((upward - 0.4) * 5);
    const double open = std::min(
        1.0, arriving.around.channel[1] /
                 (kPi * 0.5 * (scene.ambient.channel[1] + scene.floor_ambient.channel[1]) + 1e-9));
    for (int c = 0; c < 3; c++) {
        const double floor_light = scene.floor_ambient.channel[c];
        light.sheen[c] =
            open * (floor_light + sky * (upward * scene.ambient.channel[c] - floor_light));
    }
    for (std::size_t i = 0; i < scene.lights.size(); i++) {
        const AreaLight &lamp = scene.lights[i];
        const double part = mirrored(lamp, at, away, material.gloss_blur_rad);
        if (part <= 0) {
            continue;
        }
        const Vec3 to = lamp.centre_mm - at;
        const double r2 = dot(to, to);
        const Vec3 facing = cross(lamp.half_u_mm, lamp.half_v_mm);
        const double full =
            lamp.luminance.channel[1] * 4 * std::fabs(dot(to, facing)) / (r2 * std::sqrt(r2));
        const double seen = std::min(1.0, length(arriving.lamp[i]) / (0.9 * full));
        for (int c = 0; c < 3; c++) {
            light.sheen[c] += part * seen * lamp.luminance.channel[c];
        }
    }
    for (double &channel : light.sheen) {
        channel *= strength;
    }
}

}  // namespace

LocalLight light_at(const Scene &scene, const Object &object, const Vec3 &place, const Vec3 &normal,
                    const Vec3 &from_eye) {
    const bool is_sheet = object.solid == nullptr;
    // A body's light is looked up slightly outside, where the map's nodes are free.
    const Arriving arriving =
        object.light.at(is_sheet ? place : place + 0.75 * object.light.step_mm() * normal);
    LocalLight light;
    const double slope = dot(normal, arriving.slope);
    const double around = std::max(arriving.around.channel[1], 1e-9);
    for (int c = 0; c < 3; c++) {
        light.lux[c] = arriving.around.channel[c] * std::max(1 + slope / around, 0.05);
    }
    double upright = slope + around;
    Vec3 sum = arriving.slope;
    for (std::size_t i = 0; i < scene.lights.size(); i++) {
        const Colour &colour = scene.lights[i].luminance;
        const double lux = wrapped_cosine(normal, arriving.lamp[i]) / colour.channel[1];
        for (int c = 0; c < 3; c++) {
            light.lux[c] += lux * colour.channel[c];
        }
        upright += lux * colour.channel[1];
        sum = sum + arriving.lamp[i];
    }
    light.slant = {sum.x / upright, sum.y / upright};
    if (object.material.gloss > 0) {
        add_sheen(scene, object, arriving, place, normal, from_eye, light);
    }
    return light;
}

}  // namespace world
