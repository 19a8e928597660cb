// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/render/tile.hpp"

#include <algorithm>

namespace world {
namespace {

constexpr double kFarMm = 1e6;

// Where the beam can meet a flat sheet. False when it cannot.
bool meet_flat(const Sheet &sheet, const Ray &local, double per_z, const Beam &beam,
               Candidate &candidate) {
    const double height = std::fabs(local.origin_mm.z);
    const double sinking = (local.origin_mm.z > 0 ? -local.direction.z : local.direction.z) * per_z;
    const double widening = beam.spread + beam.pupil_radius_mm / beam.focus_mm;
    if (sinking + widening <= 0) {
        return false;
    }
    candidate.z_near = std::max((height - beam.pupil_radius_mm) / (sinking + widening), 0.0);
    candidate.z_far =
        sinking > widening + 1e-9 ? (height + beam.pupil_radius_mm) / (sinking - widening) : kFarMm;
    const Vec3 a = local.origin_mm + candidate.z_near * per_z * local.direction;
    const Vec3 b = local.origin_mm + candidate.z_far * per_z * local.direction;
    const double r = std::max(beam.radius(candidate.z_near), beam.radius(candidate.z_far));
    const double x_low = std::min(a.x, b.x) - r;
    const double x_high = std::max(a.x, b.x) + r;
    const double y_low = std::min(a.y, b.y) - r;
    const double y_high = std::max(a.y, b.y) + r;
    const Vec2 half = sheet.half_mm;
    candidate.covers = candidate.z_far < kFarMm && x_low > -half.x && x_high < half.x &&
                       y_low > -half.y && y_high < half.y;
    return x_low <= half.x && x_high >= -half.x && y_low <= half.y && y_high >= -half.y;
}

// Depth along the ray at which the whole beam is surely inside the body; t_end when nowhere found.
double blocked_from(const Solid &solid, PartMask parts, const Ray &local, double per_z,
                    const Beam &beam, double t, double t_end) {
    for (int i = 0; i < 12 && t < t_end; i++) {
        const double d = solid.distance(local.origin_mm + t * local.direction, parts);
        const double inside = d + beam.radius(t / per_z) + 0.01;
        if (inside < 0) {
            return t;
        }
        t += inside + 0.02;
    }
    return t_end;
}

// Those of the parts that shape the surface within the beam between two depths.
PartMask parts_between(const Solid &solid, PartMask parts, const Ray &local, double per_z,
                       const Beam &beam, double t_near, double t_far) {
    PartMask kept = 0;
    for (PartMask left = parts; left != 0; left &= left - 1) {
        const int n = __builtin_ctz(left);
        const Part &part = solid.parts()[static_cast<std::size_t>(n)];
        double t = t_near;
        for (int i = 0; i < 8 && t <= t_far; i++) {
            const double free = part_distance(part, local.origin_mm + t * local.direction) -
                                beam.radius(t / per_z) - 1.3 * solid.blend_mm() - 0.05;
            if (free <= 0) {
                kept |= PartMask{1} << n;
                break;
            }
            t += 0.9 * free;
            if (i == 7) {
                kept |= PartMask{1} << n;
            }
        }
    }
    return kept;
}

// Walks along the middle ray as far as the whole beam is free. False when it never meets the body.
bool meet_solid(const Object &object, const Ray &local, double per_z, const Beam &beam,
                Candidate &candidate) {
    const Vec3 centre = 0.5 * (object.solid->low() + object.solid->high());
    const Vec3 to = centre - local.origin_mm;
    const double along = dot(to, local.direction);
    const double t_far = along + object.reach_mm;
    if (t_far <= 0) {
        return false;
    }
    double t = std::max(along - object.reach_mm, 0.0);
    const double widest = std::max(beam.radius(t / per_z), beam.radius(t_far / per_z));
    const double reach = object.reach_mm + widest;
    if (dot(to, to) - along * along > reach * reach) {
        return false;
    }
    candidate.parts = object.solid->parts_near(local, widest);
    if (candidate.parts == 0) {
        return false;
    }
    t = std::max(t - widest, 0.0);
    const double t_end = t_far + widest;
    const double slope = 1 + (beam.spread + beam.pupil_radius_mm / beam.focus_mm) / per_z;
    for (int i = 0; i < 40 && t <= t_end; i++) {
        const double free =
            object.solid->distance(local.origin_mm + t * local.direction, candidate.parts) -
            beam.radius(t / per_z);
        if (free < 0.02) {
            break;
        }
        t += free / slope;
    }
    if (t > t_end) {
        return false;
    }
    // The same from behind.
    double t_last = t_end;
    for (int i = 0; i < 20 && t_last > t; i++) {
        const double free =
            object.solid->distance(local.origin_mm + t_last * local.direction, candidate.parts) -
            beam.radius(t_last / per_z);
        if (free < 0.05) {
            break;
        }
        t_last -= free / slope;
    }
    const double t_blocked =
        blocked_from(*object.solid, candidate.parts, local, per_z, beam, t, t_end);
    candidate.parts = parts_between(*object.solid, candidate.parts, local, per_z, beam, t,
                                    t_blocked + 2 * widest);
    if (candidate.parts == 0) {
        return false;
    }
    candidate.z_near = t / per_z;
    candidate.hides = t_blocked < t_end;
    candidate.z_hidden = t_blocked / per_z * (1 + 1e-3);
    // Rays of the beam lean by up to its slope.
    candidate.z_far = (t_last + 0.1) / per_z * (1 + 2e-4);
    return true;
}

}  // namespace

Beam beam_of(const Camera &camera, Vec2 low, Vec2 high, double margin_px) {
    const double m = 0.5 + margin_px;
    Beam beam;
    beam.middle = camera.slopes_of(0.5 * (low + high));
    for (const double x : {low.x - m, high.x + m}) {
        for (const double y : {low.y - m, high.y + m}) {
            beam.spread =
                std::max(beam.spread, length(camera.slopes_of({x, y}, beam.middle) - beam.middle));
        }
    }
    // The block's edges bow out by less than this under the distortion.
    beam.spread *= 1.01;
    beam.pupil_radius_mm = 0.5 * camera.optics.pupil_diameter_mm;
    beam.focus_mm = camera.optics.focus_distance_mm;
    return beam;
}

void find_candidates(const Scene &scene, const std::vector<Pose> &object_camera, const Beam &beam,
                     std::vector<Candidate> &found) {
    found.clear();
    const Vec3 slopes = {beam.middle.x, beam.middle.y, 1};
    const double per_z = length(slopes);
    for (std::size_t i = 0; i < scene.objects.size(); i++) {
        const Object &object = *scene.objects[i];
        Candidate candidate;
        candidate.object = &object;
        candidate.object_camera = object_camera[i];
        const Ray local = {candidate.object_camera.translation_mm,
                           (1 / per_z) * (candidate.object_camera.rotation * slopes)};
        bool meets = true;
        if (object.solid != nullptr) {
            meets = meet_solid(object, local, per_z, beam, candidate);
        } else if (object.sheet.bend_per_mm == 0) {
            meets = meet_flat(object.sheet, local, per_z, beam, candidate);
        } else {
            candidate.z_near = 0;
            candidate.z_far = kFarMm;
        }
        if (meets) {
            found.push_back(candidate);
        }
    }
    std::sort(found.begin(), found.end(),
              [](const Candidate &a, const Candidate &b) { return a.z_near < b.z_near; });
    // Behind what the whole beam must hit nothing is seen.
    for (std::size_t i = 0; i < found.size(); i++) {
        if (!found[i].covers && !found[i].hides) {
            continue;
        }
        const double behind = found[i].covers ? found[i].z_far : found[i].z_hidden;
        found.erase(std::remove_if(found.begin(), found.end(),
                                   [behind](const Candidate &c) { return c.z_near > behind; }),
                    found.end());
    }
}

}  // namespace world
