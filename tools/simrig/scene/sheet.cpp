// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/scene/sheet.hpp"

namespace world {

double Sheet::arc_length(double x) const {
    if (bend_per_mm == 0) {
        return x;
    }
    const double s = bend_per_mm * x;
    return 0.5 * (x * std::sqrt(1 + s * s) + std::asinh(s) / bend_per_mm);
}

void Sheet::prepare() {
    half_chord_mm = half_mm.x;
    for (int i = 0; i < 30; i++) {
        const double slope = bend_per_mm * half_chord_mm;
        half_chord_mm -= (arc_length(half_chord_mm) - half_mm.x) / std::sqrt(1 + slope * slope);
    }
}

double Sheet::trace_unbounded(const Ray &ray) const {
    const Vec3 &o = ray.origin_mm;
    const Vec3 &d = ray.direction;
    if (bend_per_mm == 0) {
        return -o.z / d.z;
    }
    const double a = 0.5 * bend_per_mm * d.x * d.x;
    const double b = bend_per_mm * o.x * d.x - d.z;
    const double c = 0.5 * bend_per_mm * o.x * o.x - o.z;
    const double root = b * b - 4 * a * c;
    if (root < 0) {
        return -1;
    }
    const double q = -0.5 * (b + std::copysign(std::sqrt(root), b));
    const double t1 = c / q;
    const double t2 = a == 0 ? t1 : q / a;
    const double near_t = std::fmin(t1, t2);
    const double far_t = std::fmax(t1, t2);
    const bool near_is_on = near_t > 0 && std::fabs(o.x + near_t * d.x) <= half_chord_mm &&
                            std::fabs(o.y + near_t * d.y) <= half_mm.y;
    return near_is_on ? near_t : far_t;
}

double Sheet::trace(const Ray &ray) const {
    const double t = trace_unbounded(ray);
    if (!(t > 0) || std::fabs(ray.origin_mm.x + t * ray.direction.x) > half_chord_mm ||
        std::fabs(ray.origin_mm.y + t * ray.direction.y) > half_mm.y) {
        return -1;
    }
    return t;
}

}  // namespace world
