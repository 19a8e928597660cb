// SPDX-License-Identifier: Apache-2.0
/// Closed bodies: unions of parts whose exact distance is known, sharp or blended into each other.
/// Local frame: y points down, bodies rest on y = 0.
#ifndef VERGENCE_TOOLS_SIMRIG_SCENE_SOLID_HPP
#define VERGENCE_TOOLS_SIMRIG_SCENE_SOLID_HPP

#include <cstdint>
#include <vector>

#include "tools/simrig/world/vec.hpp"

namespace world {

enum class PartKind { kBall, kLimb, kBox, kCan, kShell, kArc };

/// Numbers are used as the kind says:
///   ball   a centre, r radius
///   limb   a, b ends with radii r, s: a cone between two spheres
///   box    a centre, b half sizes, rounding
///   can    a centre, r radius, s half height along `axis`, rounding: a cylinder with caps
///   shell  a centre of the foot, r radius, s height, wall, floor, rounding: an open vessel
///   arc    a centre, r radius, turn +- s rad about the direction x in the plane z = 0;
///          section: half sizes b.x radially, b.y along z, rounding;
///          wall and floor are set by Solid to the cosine and sine of s
struct Part {
    PartKind kind = PartKind::kBall;
    Vec3 a;
    Vec3 b;
    double r = 0;
    double s = 0;
    double wall = 0;
    double floor = 0;
    double rounding = 0;
    int axis = 1;
    int tone = 0;  ///< index of its colour in the material
    Vec3 middle;   ///< centre of a sphere around the part
    double reach = 0;
};

/// Bit n is part n.
using PartMask = std::uint32_t;
constexpr std::size_t kMaxParts = 32;

class Solid {
  public:
    /// `blend_mm`: parts closer to each other than this melt together; 0 joins them sharply.
    Solid(std::vector<Part> parts, double blend_mm);

    /// Never more than the distance to the surface; negative inside; exact at the surface.
    double distance(const Vec3 &p, PartMask mask) const;
    Vec3 normal(const Vec3 &p, PartMask mask) const;
    const Part &nearest_part(const Vec3 &p, PartMask mask) const;

    /// First place along the ray between t_near and t_far where the distance is 0, to `tolerance`;
    /// negative if there is none. Rays start outside.
    double trace(const Ray &ray, double t_near, double t_far, double tolerance,
                 PartMask mask) const;

    /// Where the ray is within the body's box. False when it is not.
    bool clip(const Ray &ray, double &t_near, double &t_far) const;

    /// Parts that could be seen through a beam: within `radius` of the ray.
    PartMask parts_near(const Ray &ray, double radius) const;

    const std::vector<Part> &parts() const { return parts_; }
    double blend_mm() const { return blend_mm_; }
    PartMask every_part() const { return every_; }
    Vec3 low() const { return low_; }
    Vec3 high() const { return high_; }

  private:
    std::vector<Part> parts_;
    double blend_mm_;
    PartMask every_;
    Vec3 low_;
    Vec3 high_;
};

double part_distance(const Part &part, const Vec3 &p);

/// A rectangle, flat or bent like a sheet of paper around the direction y.

/// Local frame: the sheet lies in z = bend / 2 * x^2, its front looks towards negative z.
struct Sheet {
    Vec2 half_mm;              ///< half sizes along the sheet
    double bend_per_mm = 0;    ///< curvature in the middle
    double half_chord_mm = 0;  ///< half.x as seen from the front; set by `prepare`

    void prepare();

    /// Where the ray meets the sheet within its edges; negative when it does not.
    double trace(const Ray &ray) const;
    /// Where the ray meets the tangent sheet without edges; the nearer place in front of the ray.
    double trace_unbounded(const Ray &ray) const;

    /// Towards the front.
    Vec3 normal(const Vec3 &p) const {
        const double slope = bend_per_mm * p.x;
        const double scale = bend_per_mm == 0 ? 1 : 1 / std::sqrt(1 + slope * slope);
        return {scale * slope, 0, -scale};
    }
    /// Length along the sheet from its middle.
    Vec2 place(const Vec3 &p) const { return {arc_length(p.x), p.y}; }
    double arc_length(double x) const;
};

}  // namespace world

#endif
