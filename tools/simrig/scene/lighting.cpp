// SPDX-License-Identifier: Apache-2.0
// Sends rays from every node of every light map to the lamps and around.
#include <algorithm>
#include <atomic>
#include <thread>

#include "tools/simrig/scene/scene.hpp"
#include "tools/simrig/world/random.hpp"

namespace world {
namespace {

constexpr double kGolden = 0.6180339887498949;

double wrapped(double x) {
    return x - std::floor(x);
}

bool blocked(const Scene &scene, const Ray &ray, double t_far) {
    return nearest_hit(scene, ray, t_far, 0.02).object != nullptr;
}

// Whether an object may obstruct the lamp: spheres around objects against the cone.
bool may_be_blocked(const Scene &scene, const AreaLight &lamp, const Vec3 &place) {
    const Vec3 to = lamp.centre_mm - place;
    const double distance = length(to);
    const Vec3 direction = (1 / distance) * to;
    const double lamp_reach = length(lamp.half_u_mm) + length(lamp.half_v_mm);
    for (const auto &object : scene.objects) {
        if (object->solid == nullptr) {
            // Sheets are behind what they light, except boards.
            if (object->reach_mm < 1000) {
                return true;
            }
            continue;
        }
        const Vec3 off = object->middle_mm - place;
        const double along = dot(off, direction);
        const double reach = object->reach_mm + lamp_reach * std::max(along, 0.0) / distance;
        if (along > -object->reach_mm && dot(off, off) - along * along < reach * reach) {
            return true;
        }
    }
    return false;
}

Vec3 from_lamp(const Scene &scene, const AreaLight &lamp, const Vec3 &place, std::uint64_t key,
               int side) {
    const Vec3 normal = cross(lamp.half_u_mm, lamp.half_v_mm);
    const double area = 4 * length(normal);
    const Vec3 facing = unit(normal);
    const double jitter_u = unit_interval(mixed(key));
    const double jitter_v = unit_interval(mixed(key + 1));
    Vec3 sum;
    const bool free = !may_be_blocked(scene, lamp, place);
    for (int j = 0; j < side; j++) {
        for (int i = 0; i < side; i++) {
            const double u = 2 * (i + wrapped(jitter_u + kGolden * j)) / side - 1;
            const double v = 2 * (j + wrapped(jitter_v + kGolden * i)) / side - 1;
            const Vec3 to = lamp.centre_mm + u * lamp.half_u_mm + v * lamp.half_v_mm - place;
            const double distance = length(to);
            const Vec3 direction = (1 / distance) * to;
            if (!free && blocked(scene, {place, direction}, distance)) {
                continue;
            }
            const double solid_angle =
                std::fabs(dot(direction, facing)) * area / (distance * distance);
            sum = sum + solid_angle * direction;
        }
    }
    return (lamp.luminance.channel[1] / (side * side)) * sum;
}

// Luminance that comes from a direction, lamps left out.
Colour seen_from(const Scene &scene, const Ray &ray) {
    const Hit hit = nearest_hit(scene, ray, 1500, 0.1);
    const double upward = 0.5 + 0.5 * dot(ray.direction, scene.up);
    Colour light;
    for (int c = 0; c < 3; c++) {
        light.channel[c] =
            hit.object != nullptr
                ? mean_reflectance(hit.object->material).channel[c] * scene.bounce_lux / kPi
                : scene.floor_ambient.channel[c] +
                      upward * (scene.ambient.channel[c] - scene.floor_ambient.channel[c]);
    }
    return light;
}

// On a surface that faces one way: directions in proportion to their cosine.
void from_front(const Scene &scene, const Vec3 &place, const Vec3 &normal, std::uint64_t key,
                int count, Arriving &arriving) {
    const Vec3 side =
        unit(cross(normal, std::fabs(normal.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
    const Vec3 other = cross(normal, side);
    const double turn = 2 * kPi * unit_interval(mixed(key + 2));
    const double shift = unit_interval(mixed(key + 3));
    for (int n = 0; n < count; n++) {
        const double r2 = (n + shift) / count;
        const double r = std::sqrt(r2);
        const double a = turn + 2 * kPi * kGolden * n;
        const Vec3 direction =
            r * std::cos(a) * side + r * std::sin(a) * other + std::sqrt(1 - r2) * normal;
        const Colour light = seen_from(scene, {place, direction});
        for (int c = 0; c < 3; c++) {
            arriving.around.channel[c] += kPi / count * light.channel[c];
        }
    }
}

// In free space: from everywhere, as a mean and a slope.
void from_around(const Scene &scene, const Vec3 &place, std::uint64_t key, int count,
                 Arriving &arriving) {
    const double turn = 2 * kPi * unit_interval(mixed(key + 2));
    const double shift = unit_interval(mixed(key + 3));
    Vec3 slope;
    for (int n = 0; n < count; n++) {
        const double y = 1 - 2 * (n + shift) / count;
        const double r = std::sqrt(std::max(1 - y * y, 0.0));
        const double a = turn + 2 * kPi * kGolden * n;
        const Vec3 direction = {r * std::cos(a), y, r * std::sin(a)};
        const Colour light = seen_from(scene, {place, direction});
        for (int c = 0; c < 3; c++) {
            arriving.around.channel[c] += kPi / count * light.channel[c];
        }
        slope = slope + light.channel[1] * direction;
    }
    arriving.slope = (2 * kPi / count) * slope;
}

Arriving gathered(const Scene &scene, const Object &object, const Vec3 &place, const Vec3 *normal,
                  std::uint64_t key) {
    const bool fine = object.solid == nullptr;
    Arriving arriving;
    for (std::size_t i = 0; i < scene.lights.size(); i++) {
        arriving.lamp[i] =
            from_lamp(scene, scene.lights[i], place, key + 16 * (i + 1), fine ? 5 : 4);
        arriving.lamp[i] = object.object_world.rotation * arriving.lamp[i];
    }
    if (normal != nullptr) {
        from_front(scene, place, *normal, key, 40, arriving);
    } else {
        from_around(scene, place, key, 32, arriving);
    }
    arriving.slope = object.object_world.rotation * arriving.slope;
    return arriving;
}

// Fine where shadows of bodies nearby have edges, coarse elsewhere.
double sheet_step_mm(const Scene &scene, const Object &object) {
    double nearest = 1e30;
    for (const auto &other : scene.objects) {
        if (other->solid != nullptr) {
            const Vec3 middle = object.object_world * other->middle_mm;
            nearest = std::min(nearest, std::fabs(middle.z) - other->reach_mm);
        }
    }
    const Sheet &sheet = object.sheet;
    const double longest = 2 * std::max(sheet.half_chord_mm, sheet.half_mm.y);
    return std::max(longest / 500, nearest < 50 ? 4.0 : 16.0);
}

void allocate_sheet(const Scene &scene, Object &object) {
    const Sheet &sheet = object.sheet;
    const double step = sheet_step_mm(scene, object);
    const int nodes[3] = {2 + static_cast<int>(2 * sheet.half_chord_mm / step),
                          2 + static_cast<int>(2 * sheet.half_mm.y / step), 1};
    object.light.allocate({-sheet.half_chord_mm, -sheet.half_mm.y, 0}, step, nodes);
}

void allocate_solid(Object &object) {
    const Vec3 low = object.solid->low();
    const Vec3 size = object.solid->high() - low;
    const double step = std::max({size.x, size.y, size.z}) / 36;
    const Vec3 start = low - 3 * Vec3{step, step, step};
    const auto count = [step](double mm) { return 7 + static_cast<int>(mm / step); };
    const int nodes[3] = {count(size.x), count(size.y), count(size.z)};
    object.light.allocate(start, step, nodes);
}

void light_sheet_row(const Scene &scene, Object &object, int y) {
    for (int x = 0; x < object.light.nodes(0); x++) {
        Vec3 place = object.light.node_place(x, y, 0);
        place.z = 0.5 * object.sheet.bend_per_mm * place.x * place.x;
        const Vec3 front = object.sheet.normal(place);
        const Vec3 normal = object.world_object.rotation * front;
        const std::uint64_t key = mixed(static_cast<std::uint64_t>(object.id),
                                        static_cast<std::uint64_t>(y * object.light.nodes(0) + x));
        object.light.set(
            x, y, 0,
            gathered(scene, object, object.world_object * (place + 0.05 * front), &normal, key));
    }
}

// Nodes inside the body move to just outside, where light can be.
void light_solid_layer(const Scene &scene, Object &object, int z) {
    const Solid &solid = *object.solid;
    const double step = object.light.step_mm();
    for (int y = 0; y < object.light.nodes(1); y++) {
        for (int x = 0; x < object.light.nodes(0); x++) {
            Vec3 place = object.light.node_place(x, y, z);
            double distance = solid.distance(place, solid.every_part());
            if (std::fabs(distance) > 3.2 * step) {
                continue;
            }
            for (int i = 0; i < 4 && distance < 0.4; i++) {
                place = place + (0.5 - distance) * solid.normal(place, solid.every_part());
                distance = solid.distance(place, solid.every_part());
            }
            const std::uint64_t key = mixed(static_cast<std::uint64_t>(object.id) + 1000,
                                            static_cast<std::uint64_t>((z * 4096 + y) * 4096 + x));
            object.light.set(x, y, z,
                             gathered(scene, object, object.world_object * place, nullptr, key));
        }
    }
}

}  // namespace

void light_scene(Scene &scene) {
    const unsigned threads = std::max(1U, std::min(4U, std::thread::hardware_concurrency()));
    for (const auto &object : scene.objects) {
        const bool is_solid = object->solid != nullptr;
        is_solid ? allocate_solid(*object) : allocate_sheet(scene, *object);
        const int layers = object->light.nodes(is_solid ? 2 : 1);
        std::atomic<int> next{0};
        const auto work = [&] {
            for (int n = next++; n < layers; n = next++) {
                is_solid ? light_solid_layer(scene, *object, n)
                         : light_sheet_row(scene, *object, n);
            }
        };
        std::vector<std::thread> pool;
        for (unsigned i = 1; i < threads; i++) {
            pool.emplace_back(work);
        }
        work();
        for (std::thread &thread : pool) {
            thread.join();
        }
        if (!is_solid) {
            object->light.smooth();
        }
    }
}

Hit nearest_hit(const Scene &scene, const Ray &ray, double t_far, double tolerance) {
    Hit best;
    best.t = t_far;
    for (const auto &object : scene.objects) {
        const Vec3 to = object->middle_mm - ray.origin_mm;
        const double along = dot(to, ray.direction);
        const double reach2 = object->reach_mm * object->reach_mm;
        if (dot(to, to) - along * along > reach2 || (along < 0 && dot(to, to) > reach2)) {
            continue;
        }
        const Ray local = object->local(ray);
        double t = -1;
        if (object->solid == nullptr) {
            t = object->sheet.trace(local);
        } else {
            double t_near = 0;
            double t_end = best.t;
            if (object->solid->clip(local, t_near, t_end)) {
                t = object->solid->trace(local, t_near, t_end, tolerance,
                                         object->solid->every_part());
            }
        }
        if (t > 0 && t < best.t) {
            best.t = t;
            best.object = object.get();
        }
    }
    return best;
}

}  // namespace world
