// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "tools/simrig/server/view.hpp"

namespace simrig {

namespace {

using world::Part;
using world::PartKind;
using world::Vec2;
using world::Vec3;

constexpr int kAround = 32;

/// A point of a part and the radius around it: outlines are hulls of these.
struct Knob {
    Vec3 point_mm;
    double radius_mm;
};

Vec3 along(int axis, double length) {
    return {axis == 0 ? length : 0, axis == 1 ? length : 0, axis == 2 ? length : 0};
}

void add_ring(std::vector<Knob> &knobs, const Vec3 &middle, int axis, double radius_mm) {
    for (int i = 0; i < kAround; i++) {
        const double angle = 2 * world::kPi * i / kAround;
        const Vec3 u = along((axis + 1) % 3, radius_mm * std::cos(angle));
        const Vec3 v = along((axis + 2) % 3, radius_mm * std::sin(angle));
        knobs.push_back({middle + u + v, 0});
    }
}

std::vector<Knob> knobs_of(const Part &part) {
    std::vector<Knob> knobs;
    switch (part.kind) {
        case PartKind::kBall:
            return {{part.a, part.r}};
        case PartKind::kLimb:
            return {{part.a, part.r}, {part.b, part.s}};
        case PartKind::kBox:
            for (int corner = 0; corner < 8; corner++) {
                const Vec3 half = {(corner & 1) != 0 ? part.b.x : -part.b.x,
                                   (corner & 2) != 0 ? part.b.y : -part.b.y,
                                   (corner & 4) != 0 ? part.b.z : -part.b.z};
                knobs.push_back({part.a + half, 0});
            }
            return knobs;
        case PartKind::kCan:
            add_ring(knobs, part.a + along(part.axis, part.s), part.axis, part.r);
            add_ring(knobs, part.a - along(part.axis, part.s), part.axis, part.r);
            return knobs;
        case PartKind::kShell:
            add_ring(knobs, part.a, 1, part.r);
            add_ring(knobs, part.a - along(1, part.s), 1, part.r);
            return knobs;
        case PartKind::kArc:
            break;
    }
    for (int i = 0; i <= kAround; i++) {
        const double angle = part.s * (2.0 * i / kAround - 1);
        const Vec3 out = {part.r * std::cos(angle), part.r * std::sin(angle), 0};
        knobs.push_back({part.a + out, std::max(part.b.x, part.b.y)});
    }
    return knobs;
}

double turn(Vec2 a, Vec2 b, Vec2 c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Andrew's monotone chain.
Outline hull(Outline points) {
    std::sort(points.begin(), points.end(),
              [](Vec2 a, Vec2 b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
    Outline chain;
    for (int pass = 0; pass < 2; pass++) {
        const size_t begin = chain.size();
        for (const Vec2 point : points) {
            while (chain.size() >= begin + 2 &&
                   turn(chain[chain.size() - 2], chain.back(), point) <= 0) {
                chain.pop_back();
            }
            chain.push_back(point);
        }
        chain.pop_back();
        std::reverse(points.begin(), points.end());
    }
    return chain;
}

Outline outline_of(const std::vector<Knob> &knobs, const world::Pose &world_object, Plane plane) {
    Outline points;
    for (const Knob &knob : knobs) {
        const Vec2 middle = flattened(plane, world_object * knob.point_mm);
        const int around = knob.radius_mm > 0 ? kAround : 1;
        for (int i = 0; i < around; i++) {
            const double angle = 2 * world::kPi * i / around;
            points.push_back(middle + knob.radius_mm * Vec2{std::cos(angle), std::sin(angle)});
        }
    }
    return hull(points);
}

}  // namespace

Vec2 flattened(Plane plane, const Vec3 &point_mm) {
    return {point_mm.z, plane == Plane::kTop ? point_mm.x : point_mm.y};
}

std::vector<Outline> outlines_of(const world::Object &object, Plane plane) {
    std::vector<Outline> outlines;
    if (object.solid) {
        for (const Part &part : object.solid->parts()) {
            outlines.push_back(outline_of(knobs_of(part), object.world_object, plane));
        }
        return outlines;
    }
    const world::Sheet &sheet = object.sheet;
    std::vector<Knob> knobs;
    for (int i = 0; i <= kAround; i++) {
        const double x = sheet.half_chord_mm * (2.0 * i / kAround - 1);
        const double z = 0.5 * sheet.bend_per_mm * x * x;
        knobs.push_back({{x, -sheet.half_mm.y, z}, 0});
        knobs.push_back({{x, sheet.half_mm.y, z}, 0});
    }
    outlines.push_back(outline_of(knobs, object.world_object, plane));
    return outlines;
}

}  // namespace simrig
