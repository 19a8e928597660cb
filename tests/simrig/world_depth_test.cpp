// SPDX-License-Identifier: Apache-2.0
// The depth map against a search along each ray that knows only "inside or outside".
#include <doctest/doctest.h>

#include <functional>

#include "tests/simrig/world_harness.hpp"

using namespace world_harness;

namespace {

// Takes a point in the object's frame.
using Inside = std::function<bool(double x, double y, double z)>;

constexpr double kStepMm = 0.1;

// First depth at which the ray is inside: steps, then halving.
double searched_depth(const world::Camera &camera, const world::Object &object, world::Vec2 pixel,
                      double z_begin, double z_end, const Inside &inside) {
    const world::Vec2 s = camera.slopes_of(pixel);
    const auto in = [&](double z) {
        const world::Vec3 p =
            object.object_world * (camera.world_camera * world::Vec3{s.x * z, s.y * z, z});
        return inside(p.x, p.y, p.z);
    };
    for (double z = z_begin; z < z_end; z += kStepMm) {
        if (!in(z)) {
            continue;
        }
        double out = z - kStepMm;
        for (int i = 0; i < 40; i++) {
            const double middle = 0.5 * (out + z);
            (in(middle) ? z : out) = middle;
        }
        return z;
    }
    return 0;
}

struct Compared {
    double worst_mm = 0;
    int hits = 0;
    int edge_pixels = 0;
};

Compared compare(const std::string &object_text, const Inside &inside, double zoom) {
    const world::Scene scene =
        scene_of(even_light() + "materials:\n  - m: {kind: clay, colours: [[0.5, 0.5, 0.5]]}\n" +
                 "  - p: {kind: paper, colours: [[0.5, 0.5, 0.5]]}\nobjects:\n" + object_text);
    const world::Rig rig = world::load_rig(file("rigs/default.yaml"));
    world::Mechanics m = straight(rig, zoom, 1800, 700);
    world::FrameRequest request = steady(m);
    request.window = {0, 0, 2048, 1536, 16, 16, 1, 1};
    const world::Truth truth = world::truth(scene, rig, world::Side::kLeft, request);
    Compared compared;
    const int stride = zoom > 600 ? 2 : 1;
    for (int row = 0; row < truth.rows; row += stride) {
        for (int column = 0; column < truth.columns; column += stride) {
            const double ours = static_cast<double>(
                truth.depth_mm[static_cast<std::size_t>(row * truth.columns + column)]);
            const double theirs =
                searched_depth(truth.camera(row), *scene.objects[0],
                               request.window.centre(column, row), 1640, 1960, inside);
            if (ours == 0 && theirs == 0) {
                continue;
            }
            const double error = std::fabs(ours - theirs);
            // A ray that scratches an edge by less than the search's step is missed by it.
            if (error > 1) {
                compared.edge_pixels++;
                continue;
            }
            compared.hits++;
            compared.worst_mm = std::max(compared.worst_mm, error);
        }
    }
    return compared;
}

void check(const std::string &object_text, const Inside &inside) {
    for (const double zoom : {480.0, 850.0}) {
        const Compared c = compare(object_text, inside, zoom);
        MESSAGE("zoom " << zoom << ": worst " << c.worst_mm << " mm of " << c.hits << ", "
                        << c.edge_pixels << " at edges");
        CHECK(c.hits > 300);
        CHECK(c.worst_mm <= 0.01);
        CHECK(c.edge_pixels <= 1 + c.hits / 200);
    }
}

std::string solid(const std::string &parts, double blend) {
    return "  - solid:\n      name: s\n      material: m\n      position_mm: [3, 10, 0]\n"
           "      turn_deg: [13, 37, -8]\n      blend_mm: " +
           std::to_string(blend) + "\n      parts:\n" + parts;
}

// Distance from a point to the nearest sphere of a row of spheres.
double to_limb(double x, double y, double z, const double (&a)[3], const double (&b)[3], double r,
               double s) {
    double best = 1e30;
    for (int i = 0; i <= 400; i++) {
        const double t = i / 400.0;
        const double dx = x - a[0] - t * (b[0] - a[0]);
        const double dy = y - a[1] - t * (b[1] - a[1]);
        const double dz = z - a[2] - t * (b[2] - a[2]);
        best = std::min(best, std::sqrt(dx * dx + dy * dy + dz * dz) - r - t * (s - r));
    }
    return best;
}

// A rectangle with round corners.
bool in_rounded(double x, double y, double half_x, double half_y, double round) {
    x = std::fabs(x);
    y = std::fabs(y);
    if (x > half_x || y > half_y) {
        return false;
    }
    if (x <= half_x - round || y <= half_y - round) {
        return true;
    }
    const double dx = x - half_x + round;
    const double dy = y - half_y + round;
    return dx * dx + dy * dy <= round * round;
}

}  // namespace

TEST_CASE("depth of a cylinder with a rounded rim") {
    check(
        solid("        - can: {centre_mm: [0, 0, 0], radius_mm: 40, height_mm: 60, "
              "rounding_mm: 2.5}\n",
              0),
        [](double x, double y, double z) { return in_rounded(std::hypot(x, z), y, 40, 30, 2.5); });
}

TEST_CASE("depth of a vessel and its handle") {
    check(solid("        - shell: {radius_mm: 40, height_mm: 60, wall_mm: 5, floor_mm: 7, "
                "rounding_mm: 2}\n"
                "        - arc: {centre_mm: [40, -30, 0], radius_mm: 22, half_angle_deg: 95, "
                "half_section_mm: [4, 7], rounding_mm: 3}\n",
                0),
          [](double x, double y, double z) {
              const double r = std::hypot(x, z);
              const bool ring = in_rounded(r - 37.5, -y - 30, 2.5, 30, 2);
              const bool foot = in_rounded(r, -y - 3.5, 40, 3.5, 2);
              const double hx = x - 40;
              const double hy = y + 30;
              const double angle = std::fabs(std::atan2(hy, hx));
              const bool handle =
                  angle <= world::radians(95) && in_rounded(std::hypot(hx, hy) - 22, z, 4, 7, 3);
              return ring || foot || handle;
          });
}

TEST_CASE("depth of boxes and balls joined sharply") {
    check(solid("        - box: {centre_mm: [0, -10, 0], size_mm: [60, 40, 30]}\n"
                "        - ball: {centre_mm: [10, -40, -5], radius_mm: 20}\n",
                0),
          [](double x, double y, double z) {
              const bool box = std::fabs(x) <= 30 && std::fabs(y + 10) <= 20 && std::fabs(z) <= 15;
              const double bx = x - 10;
              const double by = y + 40;
              const double bz = z + 5;
              return box || bx * bx + by * by + bz * bz <= 400;
          });
}

TEST_CASE("depth of limbs blended into each other") {
    const double a[3] = {-20, 0, 0};
    const double b[3] = {15, -30, 8};
    const double c[3] = {20, 10, -10};
    // One zoom: the search over the spheres is slow.
    const Compared compared = compare(
        solid("        - limb: {from_mm: [-20, 0, 0], to_mm: [15, -30, 8], radius_from_mm: 12, "
              "radius_to_mm: 6}\n"
              "        - ball: {centre_mm: [20, 10, -10], radius_mm: 17}\n",
              9),
        [&](double x, double y, double z) {
            const double ball = std::sqrt((x - c[0]) * (x - c[0]) + (y - c[1]) * (y - c[1]) +
                                          (z - c[2]) * (z - c[2])) -
                                17;
            const double far_limb =
                std::max({std::fabs(x) - 40, std::fabs(y) - 50, std::fabs(z) - 30});
            if (far_limb > 0) {
                return false;
            }
            // A bound first: the row of spheres lies within 40 mm of its middle.
            const double middle =
                std::sqrt((x + 2.5) * (x + 2.5) + (y + 15) * (y + 15) + (z - 4) * (z - 4));
            const double limb = middle > 50 ? 10 : to_limb(x, y, z, a, b, 12, 6);
            const double h = std::max(9 - std::fabs(limb - ball), 0.0) / 9;
            return std::min(limb, ball) - h * h * 9 / 4 <= 0;
        },
        400);
    MESSAGE("worst " << compared.worst_mm << " mm of " << compared.hits);
    CHECK(compared.hits > 100);
    CHECK(compared.worst_mm <= 0.01);
}

TEST_CASE("depth of flat and bent sheets") {
    for (const double bend : {0.0, 1 / 700.0, -1 / 500.0}) {
        const std::string text =
            "  - sheet: {name: s, material: p, position_mm: [3, 10, 0], turn_deg: [20, -25, 5], "
            "size_mm: [120, 90]" +
            (bend == 0 ? std::string() : ", bend_radius_mm: " + std::to_string(1 / bend)) + "}\n";
        check(text, [bend](double x, double y, double z) {
            if (z < 0.5 * bend * x * x || z > 0.5 * bend * x * x + 0.3) {
                return false;
            }
            // Just behind the front within its edges; the length along the bend as a sum of chords.
            double along = 0;
            const double slope_end = bend * std::fabs(x);
            for (int i = 0; i < 64; i++) {
                const double slope = slope_end * (i + 0.5) / 64;
                along += std::fabs(x) / 64 * std::sqrt(1 + slope * slope);
            }
            return along <= 60 && std::fabs(y) <= 45;
        });
    }
}

namespace {

// What a ray meets first by searching, and how far: objects as in three_bodies(); 0 is nothing.
std::pair<int, double> searched_object(const world::Camera &camera, const world::Scene &scene,
                                       world::Vec2 pixel) {
    // A bent sheet, a rounded can before it, and a ball half before both.
    const double bend = 1 / 700.0;
    static const Inside inside[] = {
        [bend](double x, double y, double z) {
            const bool on = std::fabs(x) <= 100 && std::fabs(y) <= 60;
            return on && z >= 0.5 * bend * x * x && z <= 0.5 * bend * x * x + 0.3;
        },
        [](double x, double y, double z) { return in_rounded(std::hypot(x, z), y, 25, 30, 4); },
        [](double x, double y, double z) { return x * x + y * y + z * z <= 20 * 20; },
    };
    std::pair<int, double> first = {0, 1e30};
    for (std::size_t i = 0; i < scene.objects.size(); i++) {
        const double z = searched_depth(camera, *scene.objects[i], pixel, 1640, 1960, inside[i]);
        if (z > 0 && z < first.second) {
            first = {static_cast<int>(i) + 1, z};
        }
    }
    return first;
}

world::Scene three_bodies() {
    return scene_of(
        even_light() +
        "materials:\n  - m: {kind: clay, colours: [[0.5, 0.5, 0.5]]}\n"
        "  - p: {kind: paper, colours: [[0.5, 0.5, 0.5]]}\nobjects:\n"
        // Longer along the bend than the search's piece of it: edges are not compared.
        "  - sheet: {name: back, material: p, position_mm: [0, 0, 60], turn_deg: [8, -12, 3], "
        "size_mm: [200.7, 120], bend_radius_mm: 700}\n"
        "  - solid: {name: can, material: m, position_mm: [-20, 5, 10], turn_deg: [20, 0, 25], "
        "parts: [{can: {centre_mm: [0, 0, 0], radius_mm: 25, height_mm: 60, rounding_mm: 4}}]}\n"
        "  - solid: {name: ball, material: m, position_mm: [15, -10, -20], parts: [{ball: "
        "{centre_mm: [0, 0, 0], radius_mm: 20}}]}\n");
}

}  // namespace

TEST_CASE("normals and objects are those of a search along rays") {
    const world::Scene scene = three_bodies();
    const world::Rig rig = world::load_rig(file("rigs/default.yaml"));
    world::FrameRequest request = steady(straight(rig, 480, 1800, 700));
    request.window = {0, 0, 2048, 1536, 16, 16, 1, 1};
    const world::Truth truth = world::truth(scene, rig, world::Side::kLeft, request);
    const auto searched = [&](world::Vec2 pixel) {
        return searched_object(truth.camera(0), scene, pixel);
    };
    int checked[4] = {};
    int other_object = 0;
    int other_normal = 0;
    for (int row = 0; row < truth.rows; row += 2) {
        for (int column = 0; column < truth.columns; column += 2) {
            const auto pixel = static_cast<std::size_t>(row * truth.columns + column);
            const world::Vec2 centre = request.window.centre(column, row);
            const auto [object, z] = searched(centre);
            other_object += object != truth.id[pixel];
            checked[object]++;
            // From depths of neighbouring rays, where they hit the same side of the same object.
            world::Vec3 point[4];
            bool same = object != 0 && object == truth.id[pixel];
            for (int i = 0; i < 4 && same; i++) {
                const double off = i % 2 == 0 ? -1 : 1;
                const world::Vec2 beside = {centre.x + (i < 2 ? off : 0),
                                            centre.y + (i < 2 ? 0 : off)};
                const auto [its_object, its_z] = searched(beside);
                const world::Vec2 s = truth.camera(0).slopes_of(beside);
                point[i] = its_z * world::Vec3{s.x, s.y, 1};
                same = its_object == object && std::fabs(its_z - z) < 2;
            }
            if (same) {
                const world::Vec3 n =
                    world::unit(world::cross(point[3] - point[2], point[1] - point[0]));
                const double along = n.x * static_cast<double>(truth.normal[3 * pixel]) +
                                     n.y * static_cast<double>(truth.normal[3 * pixel + 1]) +
                                     n.z * static_cast<double>(truth.normal[3 * pixel + 2]);
                other_normal += along < std::cos(world::radians(2));
            }
        }
    }
    MESSAGE("nothing " << checked[0] << ", sheet " << checked[1] << ", can " << checked[2]
                       << ", ball " << checked[3] << "; another object " << other_object
                       << ", another normal " << other_normal);
    CHECK(checked[1] > 100);
    CHECK(checked[2] > 40);
    CHECK(checked[3] > 40);
    // Rays that scratch an edge, and the can's rim, whose curvature a pixel sees.
    CHECK(other_object <= 4);
    CHECK(other_normal <= 6);
}

TEST_CASE("normals are those of the depth map") {
    const world::Scene scene = world::load_scene(file("scenes/figurine.yaml"));
    const world::Rig rig = perfect_rig();
    world::Mechanics m = straight(rig, 850, 1800, 700);
    m.pan_rad = rig.camera[0].pan_rad;
    world::FrameRequest request = steady(m);
    request.window = {900, 700, 200, 200, 1, 1, 1, 1};
    const world::Truth truth = world::truth(scene, rig, world::Side::kLeft, request);
    const world::Camera &camera = truth.camera(0);
    const auto point = [&](int column, int row) {
        const world::Vec2 s = camera.slopes_of(request.window.centre(column, row));
        const double z = static_cast<double>(
            truth.depth_mm[static_cast<std::size_t>(row * truth.columns + column)]);
        return z * world::Vec3{s.x, s.y, 1};
    };
    int checked = 0;
    for (int row = 10; row < 190; row += 7) {
        for (int column = 10; column < 190; column += 7) {
            const auto pixel = static_cast<std::size_t>(row * truth.columns + column);
            const world::Vec3 a = point(column + 8, row) - point(column - 8, row);
            const world::Vec3 b = point(column, row + 8) - point(column, row - 8);
            if (truth.id[pixel] != 3 || world::length(a) > 3 || world::length(b) > 3) {
                continue;
            }
            const world::Vec3 from_depth = world::unit(world::cross(b, a));
            const world::Vec3 normal = {static_cast<double>(truth.normal[3 * pixel]),
                                        static_cast<double>(truth.normal[3 * pixel + 1]),
                                        static_cast<double>(truth.normal[3 * pixel + 2])};
            CHECK(world::dot(from_depth, normal) > 0.999);
            checked++;
        }
    }
    CHECK(checked > 200);
}
