// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/render/ray.hpp"

#include <array>

namespace world {
namespace {

// The whole, and levels 0, 1, 2.
std::array<double, 4> disk_variances() {
    std::array<double, 4> variance{};
    constexpr int kFine = 64;
    for (int level = kWhole; level < 3; level++) {
        const int shares = level == kWhole ? 1 : 2 << level;
        double sum = 0;
        for (int y = 0; y < kFine; y++) {
            for (int x = 0; x < kFine; x++) {
                const auto middle = [shares](int fine) {
                    return (2.0 * (fine * shares / kFine) + 1) / shares - 1;
                };
                const Vec2 p = disk((2.0 * x + 1) / kFine - 1, (2.0 * y + 1) / kFine - 1);
                const Vec2 m = disk(middle(x), middle(y));
                sum += 0.5 * (dot(p, p) - dot(m, m));
            }
        }
        // The share of the disk's second moment that the middles do not cover.
        variance[static_cast<std::size_t>(level + 1)] = sum / (kFine * kFine);
    }
    return variance;
}

const std::array<double, 4> kDiskVariance = disk_variances();

}  // namespace

Vec2 disk(double a, double b) {
    const bool flat = std::fabs(a) > std::fabs(b);
    const double r = flat ? a : b;
    const double other = flat ? b : a;
    const double x = r == 0 ? 0 : (kPi / 4) * other / r;
    const double x2 = x * x;
    // |x| <= pi / 4: errors 4e-6.
    const double s = x * (1 - x2 * (1.0 / 6 - x2 * (1.0 / 120 - x2 * (1.0 / 5040))));
    const double c = 1 - x2 * (0.5 - x2 * (1.0 / 24 - x2 * (1.0 / 720)));
    return flat ? Vec2{r * c, r * s} : Vec2{r * s, r * c};
}

double disk_variance(int level) {
    return kDiskVariance[static_cast<std::size_t>(level + 1)];
}

void meet(const Candidate &candidate, const Segment &s, double z_from, Found &best) {
    const Pose &pose = candidate.object_camera;
    const Mat3 &m = pose.rotation;
    const Vec3 origin = {pose.translation_mm.x + m.row0.x * s.pupil_mm.x + m.row0.y * s.pupil_mm.y,
                         pose.translation_mm.y + m.row1.x * s.pupil_mm.x + m.row1.y * s.pupil_mm.y,
                         pose.translation_mm.z + m.row2.x * s.pupil_mm.x + m.row2.y * s.pupil_mm.y};
    const Vec3 direction = {m.row0.x * s.slopes.x + m.row0.y * s.slopes.y + m.row0.z,
                            m.row1.x * s.slopes.x + m.row1.y * s.slopes.y + m.row1.z,
                            m.row2.x * s.slopes.x + m.row2.y * s.slopes.y + m.row2.z};
    const Object &object = *candidate.object;
    double z = -1;
    if (object.solid == nullptr) {
        z = candidate.covers ? -origin.z / direction.z : object.sheet.trace({origin, direction});
    } else {
        const double per_z = length(direction);
        const double t = object.solid->trace(
            {origin, (1 / per_z) * direction}, std::max(candidate.z_near, z_from) * per_z,
            std::min(candidate.z_far, best.z) * per_z, kTouchMm, candidate.parts);
        z = t / per_z;
    }
    if (z > 0 && z < best.z) {
        best = {&candidate, z, origin + z * direction, direction};
    }
}

Found first_met(const std::vector<Candidate> &candidates, const Segment &s, double z_from) {
    Found found;
    for (const Candidate &candidate : candidates) {
        if (candidate.z_near >= found.z) {
            break;
        }
        meet(candidate, s, z_from, found);
    }
    return found;
}

void remember(const View &view, const Found &found, double footprint_mm, Remembered &memory) {
    const Object &object = *found.candidate->object;
    memory.object = &object;
    memory.p = found.p;
    const bool is_sheet = object.solid == nullptr;
    const bool has_tones = !is_sheet && object.material.tones.size() > 1;
    double reach = 0.1 + 0.4 * footprint_mm;
    if (is_sheet) {
        reach = 3 + 3 * footprint_mm;
    } else if (has_tones) {
        reach = 0;
    }
    memory.reach2 = reach * reach;
    memory.normal = is_sheet ? object.sheet.normal(found.p)
                             : object.solid->normal(found.p, found.candidate->parts);
    const Vec3 from_eye = unit(found.direction);
    if (is_sheet && dot(memory.normal, from_eye) > 0) {
        memory.normal = -memory.normal;
    }
    memory.light = light_at(*view.scene, object, found.p, memory.normal, from_eye);
    memory.tone = has_tones ? object.solid->nearest_part(found.p, found.candidate->parts).tone : 0;
}

}  // namespace world
