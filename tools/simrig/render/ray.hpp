// SPDX-License-Identifier: Apache-2.0
/// One ray: what it hits, and the light there.
#ifndef VERGENCE_TOOLS_SIMRIG_RENDER_RAY_HPP
#define VERGENCE_TOOLS_SIMRIG_RENDER_RAY_HPP

#include <algorithm>
#include <vector>

#include "tools/simrig/render/sampler_types.hpp"

namespace world {

/// Textures are looked up nearer to the middle of a ray's share of pixel and pupil than the ray
/// itself; the filter compensates, so that second moments are unchanged. This lowers noise for the
/// same number of rays. kPull is the part of a ray's own offset that remains.
constexpr double kPull = 0.15;
constexpr double kFiltered = 1 - kPull * kPull;
/// Rays stop when their standard error is this part of the pixel's own noise.
constexpr double kErrorPart2 = 0.3 * 0.3;

/// Distance from a body at which a ray has arrived: a twentieth of a pixel at 10x.
constexpr double kTouchMm = 0.003;

/// Level of two rays, through opposite places of the whole pixel and the whole pupil. Levels 0, 1,
/// 2 have 4, 16 and 64.
constexpr int kWhole = -1;

/// Shirley's map of the square to the disk: shares stay compact. a, b in [-1, 1].
Vec2 disk(double a, double b);
/// Mean variance a dimension of the unit disk's shares at a level.
double disk_variance(int level);

/// -1 to 1 from 16 bits.
inline double centred(unsigned share16) {
    return share16 * (2.0 / 65536) - 1;
}

/// A ray: from a place of the pupil, with its slopes to the axis.
struct Segment {
    Vec2 pupil_mm;
    Vec2 slopes;
};

/// `offset_px` from the pixel's middle, `pupil` within the unit disk.
inline Segment segment(const PixelView &v, Vec2 offset_px, Vec2 pupil) {
    const Vec2 lens = v.pupil_radius_mm * pupil;
    const Vec2 s = {v.slopes.x + v.step[0] * offset_px.x + v.step[1] * offset_px.y,
                    v.slopes.y + v.step[2] * offset_px.x + v.step[3] * offset_px.y};
    return {lens, s - (1 / v.focus_mm) * lens};
}

/// What a ray meets first.
struct Found {
    const Candidate *candidate = nullptr;
    double z = 1e30;
    Vec3 p;          ///< point in the object's frame
    Vec3 direction;  ///< direction of the ray: `p` is `z` times this from its origin
};

/// Updates `best` when the candidate is met before it. `z_from`: nothing is met before.
void meet(const Candidate &candidate, const Segment &s, double z_from, Found &best);
/// The first of the candidates; its `candidate` is null when none is met.
Found first_met(const std::vector<Candidate> &candidates, const Segment &s, double z_from);

/// What the samples of one pixel share: light and normal of a place, while they stay near it.
struct Remembered {
    const Object *object = nullptr;
    Vec3 p;
    double reach2 = 0;
    Vec3 normal;
    LocalLight light;
    int tone = 0;
    /// Of all rays of the pixel: whether they met one surface without a step.
    const Object *first = nullptr;
    bool one_object = true;
    double z_min = 1e30;
    double z_max = 0;
    double spread_mm = 0;

    void note(const Found &found, double footprint_mm) {
        const Object *met = found.candidate->object;
        one_object = one_object && (first == nullptr || first == met);
        first = met;
        z_min = std::min(z_min, found.z);
        z_max = std::max(z_max, found.z);
        spread_mm = std::max(spread_mm, footprint_mm);
    }
    bool one_surface() const {
        return one_object && first != nullptr && z_max - z_min < 4 * spread_mm &&
               (first->solid == nullptr || first->material.tones.size() == 1);
    }
};

/// Normal, light and tone at what was found.
void remember(const View &view, const Found &found, double footprint_mm, Remembered &memory);

}  // namespace world

#endif
