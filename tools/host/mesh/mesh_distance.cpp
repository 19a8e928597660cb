// SPDX-License-Identifier: Apache-2.0
#include "tools/host/mesh/mesh_distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "daemon/surface/result/result_figures.h"

namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

/// Vertices by pixel, and each one's smallest distance in mm.
struct field {
    const reconstruct_result &full;
    std::int64_t width;
    std::vector<std::uint32_t> vertex_at;
    std::vector<float> distance_mm;

    explicit field(const reconstruct_result &result)
        : full(result),
          width(result.left.width),
          vertex_at(static_cast<std::size_t>(result.left.width) *
                        static_cast<std::size_t>(result.left.height),
                    none),
          distance_mm(result.vertex_count, std::numeric_limits<float>::infinity()) {
        for (std::uint32_t i = 0; i < full.vertex_count; i++) {
            vertex_at[full.vertex_pixel[i]] = i;
        }
    }

    void cover(const std::uint32_t corner[3]);
};

struct pixel {
    std::int64_t x, y;
};

/// Positive where c is on the inner side of the edge a-b of a triangle with the meshes'
/// orientation.
std::int64_t side(const pixel &a, const pixel &b, const pixel &c) {
    return (b.y - a.y) * (c.x - a.x) - (b.x - a.x) * (c.y - a.y);
}

void field::cover(const std::uint32_t corner[3]) {
    pixel at[3];
    for (int k = 0; k < 3; k++) {
        const std::int64_t number = full.vertex_pixel[corner[k]];
        at[k] = {number % width, number / width};
    }
    if (side(at[0], at[1], at[2]) < 0) {
        std::swap(at[1], at[2]);  // a fold: it still covers the pixel
    }
    const triangulate_point &origin = full.points[corner[0]];
    const std::array<double, 3> normal =
        mesh_distance_normal(origin, full.points[corner[1]], full.points[corner[2]]);
    const double length = std::hypot(normal[0], normal[1], normal[2]);
    const auto columns = std::minmax({at[0].x, at[1].x, at[2].x});
    const auto rows = std::minmax({at[0].y, at[1].y, at[2].y});
    for (std::int64_t y = rows.first; y <= rows.second; y++) {
        for (std::int64_t x = columns.first; x <= columns.second; x++) {
            const pixel here{x, y};
            const std::uint32_t vertex = vertex_at[static_cast<std::size_t>(y * width + x)];
            if (vertex == none || side(at[0], at[1], here) < 0 || side(at[1], at[2], here) < 0 ||
                side(at[2], at[0], here) < 0) {
                continue;
            }
            const triangulate_point &point = full.points[vertex];
            const double along = normal[0] * (double{1} * point.x_um - origin.x_um) +
                                 normal[1] * (double{1} * point.y_um - origin.y_um) +
                                 normal[2] * (double{1} * point.z_um - origin.z_um);
            const double mm = length > 0 ? std::fabs(along) / length / 1e3 : 0;
            distance_mm[vertex] = std::min(distance_mm[vertex], static_cast<float>(mm));
        }
    }
}

double quantile(std::vector<float> *values, double share) {
    const auto place = static_cast<std::ptrdiff_t>(share * static_cast<double>(values->size() - 1));
    std::nth_element(values->begin(), values->begin() + place, values->end());
    return static_cast<double>((*values)[static_cast<std::size_t>(place)]);
}

}  // namespace

std::vector<bool> mesh_distance_joined(const reconstruct_result &full) {
    std::vector<bool> joined(full.vertex_count, false);
    for (std::uint32_t i = 0; i < full.triangle_count; i++) {
        for (const std::uint32_t vertex : full.triangles[i]) {
            joined[vertex] = !surface_figures_is_filled(&full, full.vertex_pixel[vertex]);
        }
    }
    return joined;
}

std::array<double, 3> mesh_distance_normal(const triangulate_point &a, const triangulate_point &b,
                                           const triangulate_point &c) {
    const double u[3] = {double{1} * b.x_um - a.x_um, double{1} * b.y_um - a.y_um,
                         double{1} * b.z_um - a.z_um};
    const double v[3] = {double{1} * c.x_um - a.x_um, double{1} * c.y_um - a.y_um,
                         double{1} * c.z_um - a.z_um};
    return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
}

mesh_distance mesh_distance_measure(const reconstruct_result &full, const std::vector<bool> &joined,
                                    const std::vector<std::uint32_t> &triangles) {
    field field(full);
    for (std::size_t i = 0; i < triangles.size(); i += 3) {
        field.cover(&triangles[i]);
    }
    mesh_distance result;
    std::vector<float> known;
    for (std::uint32_t i = 0; i < full.vertex_count; i++) {
        if (!joined[i]) {
            continue;
        }
        if (std::isfinite(field.distance_mm[i])) {
            known.push_back(field.distance_mm[i]);
        } else {
            result.uncovered++;
        }
    }
    if (!known.empty()) {
        result.median_mm = quantile(&known, 0.5);
        result.p99_mm = quantile(&known, 0.99);
        result.max_mm = quantile(&known, 1);
    }
    return result;
}
