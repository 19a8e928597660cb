// SPDX-License-Identifier: Apache-2.0
#include "synthetic/scene.hpp"

#include <algorithm>
#include <cmath>

namespace synthetic {

namespace {

constexpr double kPi = 3.14159265358979323846;

// Mean over all phases of the sum of squared B-spline weights: 151/315 an axis.
constexpr double kSplinePower = 151.0 / 315.0;

void spline_weights(double fraction, double weights[4]) {
    const double rest = 1 - fraction;
    weights[0] = rest * rest * rest / 6;
    weights[1] = (4 - 6 * fraction * fraction + 3 * fraction * fraction * fraction) / 6;
    weights[2] = (4 - 6 * rest * rest + 3 * rest * rest * rest) / 6;
    weights[3] = fraction * fraction * fraction / 6;
}

bool plane_holds(const Surface &surface, const Vector &point) {
    if (surface.bounds && !surface.bounds->contains(point.x, point.y)) {
        return false;
    }
    return std::none_of(surface.holes.begin(), surface.holes.end(),
                        [&](const Rectangle &hole) { return hole.contains(point.x, point.y); });
}

std::optional<double> cast_plane(const Surface &surface, const Vector &origin,
                                 const Vector &direction) {
    const double slope = dot(surface.normal, direction);
    if (slope == 0) {
        return std::nullopt;
    }
    const double t = (1 - dot(surface.normal, origin)) / slope;
    if (t <= 1e-9 || !plane_holds(surface, origin + t * direction)) {
        return std::nullopt;
    }
    return t;
}

std::optional<double> cast_sphere(const Surface &surface, const Vector &origin,
                                  const Vector &direction) {
    const Vector from_centre = origin - surface.centre;
    const double a = dot(direction, direction);
    const double half_b = dot(from_centre, direction);
    const double c = dot(from_centre, from_centre) - surface.radius_mm * surface.radius_mm;
    const double discriminant = half_b * half_b - a * c;
    if (discriminant <= 0) {
        return std::nullopt;
    }
    const double t = (-half_b - std::sqrt(discriminant)) / a;
    return t > 1e-9 ? std::optional<double>(t) : std::nullopt;
}

}  // namespace

double norm(const Vector &a) {
    return std::sqrt(dot(a, a));
}

uint64_t Random::bits() {
    state_ += 0x9e3779b97f4a7c15u;
    uint64_t mixed = state_;
    mixed = (mixed ^ (mixed >> 30)) * 0xbf58476d1ce4e5b9u;
    mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111ebu;
    return mixed ^ (mixed >> 31);
}

double Random::uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(bits() >> 11) * 0x1p-53;
}

double Random::normal() {
    if (second_normal_) {
        const double value = *second_normal_;
        second_normal_.reset();
        return value;
    }
    const double radius = std::sqrt(-2 * std::log(1 - uniform(0, 1)));
    const double angle = uniform(0, 2 * kPi);
    second_normal_ = radius * std::sin(angle);
    return radius * std::cos(angle);
}

Noise::Noise(uint64_t seed) : coefficients_(kCells * kCells) {
    Random random(seed);
    for (float &coefficient : coefficients_) {
        coefficient = static_cast<float>(std::clamp(random.normal(), -2.5, 2.5) / kSplinePower);
    }
}

double Noise::at(double u, double v) const {
    const double u_floor = std::floor(u);
    const double v_floor = std::floor(v);
    double weights_u[4];
    double weights_v[4];
    spline_weights(u - u_floor, weights_u);
    spline_weights(v - v_floor, weights_v);
    const auto u_cell = static_cast<int64_t>(u_floor);
    const auto v_cell = static_cast<int64_t>(v_floor);
    double sum = 0;
    for (int j = 0; j < 4; j++) {
        const size_t row = static_cast<size_t>((v_cell + j) & (kCells - 1)) * kCells;
        double row_sum = 0;
        for (int i = 0; i < 4; i++) {
            const size_t column = static_cast<size_t>((u_cell + i) & (kCells - 1));
            row_sum += weights_u[i] * static_cast<double>(coefficients_[row + column]);
        }
        sum += weights_v[j] * row_sum;
    }
    return sum;
}

double Texture::at(double x_mm, double y_mm) const {
    switch (kind) {
        case Kind::Constant:
            return mean;
        case Kind::Stripes:
            return mean + contrast * std::sin(2 * kPi * x_mm / cell_mm);
        case Kind::Noise:
            break;
    }
    double value = std::sqrt(1 - coarse_share) * noise->at(x_mm / cell_mm, y_mm / cell_mm);
    if (coarse_share > 0) {
        // Another part of the table, so that the two octaves differ.
        value += std::sqrt(coarse_share) *
                 noise->at(x_mm / cell_mm / 4 + 61.3, y_mm / cell_mm / 4 + 47.7);
    }
    return mean + contrast * value;
}

std::optional<Hit> Scene::cast(const Vector &origin, const Vector &direction) const {
    std::optional<Hit> nearest;
    for (size_t i = 0; i < surfaces.size(); i++) {
        const std::optional<double> t = surfaces[i].kind == Surface::Kind::Plane
                                            ? cast_plane(surfaces[i], origin, direction)
                                            : cast_sphere(surfaces[i], origin, direction);
        if (t && (!nearest || *t < nearest->t)) {
            nearest = Hit{*t, static_cast<int>(i), origin + *t * direction};
        }
    }
    return nearest;
}

double Scene::reflectance(const Hit &hit) const {
    return surfaces[static_cast<size_t>(hit.surface)].texture.at(hit.point.x, hit.point.y);
}

}  // namespace synthetic
