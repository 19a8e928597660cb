// SPDX-License-Identifier: Apache-2.0
/// A rectangle, flat or bent like a sheet of paper around the direction y.
#ifndef VERGENCE_TOOLS_SIMRIG_SCENE_SHEET_HPP
#define VERGENCE_TOOLS_SIMRIG_SCENE_SHEET_HPP

#include "tools/simrig/world/vec.hpp"

namespace world {

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
