// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/scene/solid.hpp"

#include <algorithm>

namespace world {

namespace {

double larger(double a, double b) {
    return a > b ? a : b;
}
double smaller(double a, double b) {
    return a < b ? a : b;
}

double sign(double v) {
    if (v > 0) {
        return 1;
    }
    return v < 0 ? -1 : 0;
}
double component(const Vec3 &v, int axis) {
    if (axis == 0) {
        return v.x;
    }
    return axis == 1 ? v.y : v.z;
}

// Distance to a rectangle of these half sizes with rounded corners, around 0.
double rounded_rectangle(double x, double y, double half_x, double half_y, double rounding) {
    const double qx = std::fabs(x) - half_x + rounding;
    const double qy = std::fabs(y) - half_y + rounding;
    if (qx <= 0 || qy <= 0) {
        return larger(qx, qy) - rounding;
    }
    return std::sqrt(qx * qx + qy * qy) - rounding;
}

double box_distance(const Part &part, const Vec3 &p) {
    const double qx = std::fabs(p.x - part.a.x) - part.b.x + part.rounding;
    const double qy = std::fabs(p.y - part.a.y) - part.b.y + part.rounding;
    const double qz = std::fabs(p.z - part.a.z) - part.b.z + part.rounding;
    const double ox = larger(qx, 0);
    const double oy = larger(qy, 0);
    const double oz = larger(qz, 0);
    const double inside = smaller(larger(qx, larger(qy, qz)), 0);
    return std::sqrt(ox * ox + oy * oy + oz * oz) + inside - part.rounding;
}

// A cone around two spheres: in the plane of axis and point, the nearest place of the segment
// moves along the axis with the slope of the cone (Quilez, "round cone").
double limb_distance(const Part &part, const Vec3 &p) {
    const Vec3 ba = part.b - part.a;
    const double l2 = dot(ba, ba);
    const double rr = part.r - part.s;
    const double a2 = l2 - rr * rr;
    const double il2 = 1 / l2;
    const Vec3 pa = p - part.a;
    const double y = dot(pa, ba);
    const double z = y - l2;
    const Vec3 across = l2 * pa - y * ba;
    const double x2 = dot(across, across);
    const double y2 = y * y * l2;
    const double z2 = z * z * l2;
    const double k = sign(rr) * rr * rr * x2;
    if ((z > 0 ? 1.0 : -1.0) * a2 * z2 > k) {
        return std::sqrt(x2 + z2) * il2 - part.s;
    }
    if ((y > 0 ? 1.0 : -1.0) * a2 * y2 < k) {
        return std::sqrt(x2 + y2) * il2 - part.r;
    }
    return (std::sqrt(x2 * a2 * il2) + y * rr) * il2 - part.r;
}

double can_distance(const Part &part, const Vec3 &p) {
    const Vec3 q = p - part.a;
    const double along = component(q, part.axis);
    const double square = dot(q, q) - along * along;
    return rounded_rectangle(std::sqrt(larger(square, 0)), along, part.r, part.s, part.rounding);
}

double shell_distance(const Part &part, const Vec3 &p) {
    const Vec3 q = p - part.a;
    const double radius = std::sqrt(q.x * q.x + q.z * q.z);
    const double up = -q.y;
    const double half_wall = 0.5 * part.wall;
    const double ring = rounded_rectangle(radius - part.r + half_wall, up - 0.5 * part.s, half_wall,
                                          0.5 * part.s, part.rounding);
    const double foot =
        rounded_rectangle(radius, up - 0.5 * part.floor, part.r, 0.5 * part.floor, part.rounding);
    return smaller(ring, foot);
}

double arc_distance(const Part &part, const Vec3 &p) {
    const Vec3 q = p - part.a;
    const double radius = std::sqrt(q.x * q.x + q.y * q.y);
    const double c = part.wall;
    const double s = part.floor;
    // Beyond its ends the arc is closed by its section, seen square on.
    const double ay = std::fabs(q.y);
    if (q.x * s - ay * c < 0) {
        const double along = ay * c - q.x * s;
        const double radial = q.x * c + ay * s - part.r;
        const double section = rounded_rectangle(radial, q.z, part.b.x, part.b.y, part.rounding);
        const double outside = larger(section, 0);
        return std::sqrt(outside * outside + along * along);
    }
    return rounded_rectangle(radius - part.r, q.z, part.b.x, part.b.y, part.rounding);
}

void set_bounds(Part &part) {
    part.middle = part.a;
    switch (part.kind) {
        case PartKind::kBall:
            part.reach = part.r;
            break;
        case PartKind::kLimb:
            part.middle = 0.5 * (part.a + part.b);
            part.reach = 0.5 * length(part.b - part.a) + larger(part.r, part.s);
            break;
        case PartKind::kBox:
            part.reach = length(part.b);
            break;
        case PartKind::kCan:
            part.reach = std::hypot(part.r, part.s);
            break;
        case PartKind::kShell:
            part.middle = part.a - Vec3{0, 0.5 * part.s, 0};
            part.reach = std::hypot(part.r, 0.5 * part.s);
            break;
        case PartKind::kArc:
            part.reach = std::hypot(part.r + part.b.x, part.b.y);
            part.wall = std::cos(part.s);
            part.floor = std::sin(part.s);
            break;
    }
}

// Half sizes of a box around the part, whose centre is `middle`.
Vec3 half_box(const Part &part) {
    switch (part.kind) {
        case PartKind::kBox:
            return part.b;
        case PartKind::kCan:
            return {part.axis == 0 ? part.s : part.r, part.axis == 1 ? part.s : part.r,
                    part.axis == 2 ? part.s : part.r};
        case PartKind::kShell:
            return {part.r, 0.5 * part.s, part.r};
        case PartKind::kArc:
            return {part.r + part.b.x, part.r + part.b.x, part.b.y};
        case PartKind::kLimb: {
            const Vec3 d = 0.5 * (part.b - part.a);
            const double r = larger(part.r, part.s);
            return {std::fabs(d.x) + r, std::fabs(d.y) + r, std::fabs(d.z) + r};
        }
        case PartKind::kBall:
            break;
    }
    return {part.r, part.r, part.r};
}

}  // namespace

double part_distance(const Part &part, const Vec3 &p) {
    switch (part.kind) {
        case PartKind::kBall:
            return length(p - part.a) - part.r;
        case PartKind::kLimb:
            return limb_distance(part, p);
        case PartKind::kBox:
            return box_distance(part, p);
        case PartKind::kCan:
            return can_distance(part, p);
        case PartKind::kShell:
            return shell_distance(part, p);
        case PartKind::kArc:
            break;
    }
    return arc_distance(part, p);
}

Solid::Solid(std::vector<Part> parts, double blend_mm)
    : parts_(std::move(parts)),
      blend_mm_(blend_mm),
      every_(static_cast<PartMask>((std::uint64_t{1} << parts_.size()) - 1)) {
    low_ = {1e30, 1e30, 1e30};
    high_ = {-1e30, -1e30, -1e30};
    for (Part &part : parts_) {
        set_bounds(part);
        const Vec3 half = half_box(part);
        const Vec3 margin = {0.26 * blend_mm, 0.26 * blend_mm, 0.26 * blend_mm};
        const Vec3 a = part.middle - half - margin;
        const Vec3 b = part.middle + half + margin;
        low_ = {smaller(low_.x, a.x), smaller(low_.y, a.y), smaller(low_.z, a.z)};
        high_ = {larger(high_.x, b.x), larger(high_.y, b.y), larger(high_.z, b.z)};
    }
}

double Solid::distance(const Vec3 &p, PartMask mask) const {
    double d = 1e30;
    while (mask != 0) {
        const int n = __builtin_ctz(mask);
        mask &= mask - 1;
        const double e = part_distance(parts_[static_cast<std::size_t>(n)], p);
        const double closeness = blend_mm_ - std::fabs(d - e);
        d = smaller(d, e);
        if (closeness > 0) {
            d -= closeness * closeness / (4 * blend_mm_);
        }
    }
    return d;
}

Vec3 Solid::normal(const Vec3 &p, PartMask mask) const {
    // Differences over the corners of a tetrahedron.
    constexpr double h = 0.002;
    const double a = distance({p.x + h, p.y - h, p.z - h}, mask);
    const double b = distance({p.x - h, p.y - h, p.z + h}, mask);
    const double c = distance({p.x - h, p.y + h, p.z - h}, mask);
    const double d = distance({p.x + h, p.y + h, p.z + h}, mask);
    const Vec3 g = {a - b - c + d, -a - b + c + d, -a + b - c + d};
    return unit(g);
}

const Part &Solid::nearest_part(const Vec3 &p, PartMask mask) const {
    const Part *best = &parts_[0];
    double nearest = 1e30;
    for (; mask != 0; mask &= mask - 1) {
        const Part &part = parts_[static_cast<std::size_t>(__builtin_ctz(mask))];
        const double d = part_distance(part, p);
        if (d < nearest) {
            nearest = d;
            best = &part;
        }
    }
    return *best;
}

double Solid::trace(const Ray &ray, double t_near, double t_far, double tolerance,
                    PartMask mask) const {
    double t = t_near;
    double d = distance(ray.origin_mm + t * ray.direction, mask);
    double t_before = t;
    double d_before = d;
    for (int i = 0; i < 200; i++) {
        if (d <= tolerance) {
            break;
        }
        if (t > t_far) {
            return -1;
        }
        // Near the surface the line through the last two distances is better than the distance
        // itself; no further than four times it, so that nothing is jumped over.
        double step = d;
        if (d < 2 && d_before > d) {
            step = smaller(larger(d * (t - t_before) / (d_before - d), d), 4 * d);
        }
        const double t_next = t + step;
        const double d_next = distance(ray.origin_mm + t_next * ray.direction, mask);
        t_before = t;
        d_before = d;
        t = t_next;
        d = d_next;
    }
    if (d > tolerance) {
        return -1;
    }
    // A step beyond the surface: it lies between the last two places.
    for (int i = 0; i < 60 && d < -tolerance; i++) {
        const double part = d_before / (d_before - d);
        const double t_mid = t_before + smaller(larger(part, 0.05), 0.95) * (t - t_before);
        const double d_mid = distance(ray.origin_mm + t_mid * ray.direction, mask);
        if (d_mid > tolerance) {
            t_before = t_mid;
            d_before = d_mid;
        } else {
            t = t_mid;
            d = d_mid;
        }
    }
    return t;
}

bool Solid::clip(const Ray &ray, double &t_near, double &t_far) const {
    const double o[3] = {ray.origin_mm.x, ray.origin_mm.y, ray.origin_mm.z};
    const double d[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
    const double low[3] = {low_.x, low_.y, low_.z};
    const double high[3] = {high_.x, high_.y, high_.z};
    for (int k = 0; k < 3; k++) {
        const double inverse = 1 / d[k];
        double a = (low[k] - o[k]) * inverse;
        double b = (high[k] - o[k]) * inverse;
        if (a > b) {
            std::swap(a, b);
        }
        t_near = a > t_near ? a : t_near;
        t_far = b < t_far ? b : t_far;
    }
    return t_near <= t_far;
}

PartMask Solid::parts_near(const Ray &ray, double radius) const {
    PartMask mask = 0;
    for (std::size_t n = 0; n < parts_.size(); n++) {
        const Vec3 to = parts_[n].middle - ray.origin_mm;
        const double along = dot(to, ray.direction);
        const double reach = parts_[n].reach + radius + 1.3 * blend_mm_;
        if (dot(to, to) - along * along < reach * reach) {
            mask |= PartMask{1} << n;
        }
    }
    return mask;
}

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
