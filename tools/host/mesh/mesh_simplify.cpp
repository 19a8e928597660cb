// SPDX-License-Identifier: Apache-2.0
#include "tools/host/mesh/mesh_simplify.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>
#include <vector>

#include "core/error.h"
#include "daemon/base/process.h"
#include "daemon/surface/result/result_figures.h"
#include "tools/host/mesh/mesh_distance.hpp"

namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

/// Small enough that single precision resolves a thousandth of a pixel within it.
constexpr std::uint32_t tile_px = 256;

/// Limits of the default tolerance: below it a mesh follows only noise; above it errors are
/// visible.
constexpr double min_tolerance_px = 0.02, max_tolerance_px = 0.1;

/// --error limits the distance of 99 % of the points; a smaller tolerance is tried this often.
constexpr int error_attempts = 3;

struct cancelled {};

using triangle_list = std::vector<std::uint32_t>;  // three vertex indices of the full surface

class simplifier {
  public:
    /// The tolerances of `within` are in mm of depth if `metric`, else in pixels.
    simplifier(const reconstruct_result &full, bool metric)
        : full_(full),
          metric_(metric),
          width_(static_cast<std::uint32_t>(full.left.width)),
          number_(full.vertex_count, none) {}

    /// Both passes; outlines of holes keep every vertex.
    triangle_list within(const triangle_list &triangles, double tolerance) {
        return tiles(tiles(triangles, tolerance, 0), tolerance, tile_px / 2);
    }

    /// All at once, until `count` triangles are left; outlines are simplified, too, but at a higher
    /// cost.
    triangle_list down_to(std::size_t count, const triangle_list &triangles) {
        triangle_list result = triangles;
        collapse(&result, 3 * count, width_, 0);
        return result;
    }

  private:
    std::array<float, 3> place(std::uint32_t vertex) const {
        const std::uint32_t pixel = full_.vertex_pixel[vertex];
        return {static_cast<float>(pixel % width_), static_cast<float>(pixel / width_),
                static_cast<float>(disparity_q8(vertex)) / 256.0f};
    }

    std::int32_t disparity_q8(std::uint32_t vertex) const {
        const std::uint32_t pixel = full_.vertex_pixel[vertex];
        return image_i32_row(&full_.match.disparity_q8,
                             static_cast<int>(pixel / width_))[pixel % width_];
    }

    /// Disparity error for `error_mm` of depth at nine tenths of a part.
    double pixels_of(double error_mm, const triangle_list &part) const {
        std::vector<std::int32_t> disparities;
        for (const std::uint32_t vertex : part) {
            disparities.push_back(disparity_q8(vertex));
        }
        const auto far = disparities.begin() + static_cast<std::ptrdiff_t>(part.size() / 10);
        std::nth_element(disparities.begin(), far, disparities.end());
        const rectify_plan &plan = full_.plan;
        const double shift_px = *far / 256.0 - (plan.cx_left_px - plan.cx_right_px);
        return error_mm * shift_px * shift_px / (plan.f_px * plan.baseline_mm);
    }

    /// Simplifies a part of the surface in place, with vertices numbered from 0.
    void collapse(triangle_list *part, std::size_t indices, double tolerance, unsigned options) {
        if (interrupt_requested()) {
            throw cancelled();
        }
        std::vector<std::uint32_t> vertices;
        std::vector<float> places;
        for (std::uint32_t &vertex : *part) {
            if (number_[vertex] == none) {
                number_[vertex] = static_cast<std::uint32_t>(vertices.size());
                vertices.push_back(vertex);
                const std::array<float, 3> at = place(vertex);
                places.insert(places.end(), at.begin(), at.end());
            }
            vertex = number_[vertex];
        }
        constexpr std::size_t stride = 3 * sizeof(float);
        const double scale =
            static_cast<double>(meshopt_simplifyScale(places.data(), vertices.size(), stride));
        triangle_list fewer(part->size());
        const std::size_t left = meshopt_simplify(
            fewer.data(), part->data(), part->size(), places.data(), vertices.size(), stride,
            indices, static_cast<float>(scale > 0 ? tolerance / scale : 0), options, nullptr);
        part->resize(left);
        std::transform(fewer.begin(), fewer.begin() + static_cast<std::ptrdiff_t>(left),
                       part->begin(), [&](std::uint32_t number) { return vertices[number]; });
        for (const std::uint32_t vertex : vertices) {
            number_[vertex] = none;
        }
    }

    triangle_list tiles(const triangle_list &triangles, double tolerance, std::uint32_t shift_px) {
        const std::uint32_t across = (width_ + shift_px) / tile_px + 1;
        const auto tile_of = [&](std::size_t triangle) {
            const std::uint32_t pixel = full_.vertex_pixel[triangles[triangle]];
            return (pixel / width_ + shift_px) / tile_px * across +
                   (pixel % width_ + shift_px) / tile_px;
        };
        const std::uint32_t down =
            (static_cast<std::uint32_t>(full_.left.height) + shift_px) / tile_px + 1;
        std::vector<std::size_t> end(std::size_t{across} * down, 0);
        for (std::size_t i = 0; i < triangles.size(); i += 3) {
            end[tile_of(i)] += 3;
        }
        for (std::size_t i = 1; i < end.size(); i++) {
            end[i] += end[i - 1];
        }
        triangle_list sorted(triangles.size()), result;
        std::vector<std::size_t> next = end;
        for (std::size_t i = triangles.size(); i > 0; i -= 3) {
            std::size_t &at = next[tile_of(i - 3)];
            at -= 3;
            std::copy_n(&triangles[i - 3], 3, &sorted[at]);
        }
        for (std::size_t i = 0; i < end.size(); i++) {
            triangle_list part(&sorted[next[i]], &sorted[next[i]] + (end[i] - next[i]));
            if (!part.empty()) {
                collapse(&part, 0, metric_ ? pixels_of(tolerance, part) : tolerance,
                         meshopt_SimplifyLockBorder);
                result.insert(result.end(), part.begin(), part.end());
            }
        }
        return result;
    }

    const reconstruct_result &full_;
    const bool metric_;
    const std::uint32_t width_;
    std::vector<std::uint32_t> number_;  // number of each vertex within the current part
};

triangle_list all_triangles(const reconstruct_result &full) {
    const std::uint32_t *first = full.triangles[0];
    return triangle_list(first, first + 3 * std::size_t{full.triangle_count});
}

/// Half of the predicted deviation for most of the surface.
double default_tolerance_px(const reconstruct_result &full) {
    std::vector<std::uint32_t> counts(65536, 0);
    for (std::uint32_t i = 0; i < full.vertex_count; i++) {
        const std::uint32_t pixel = full.vertex_pixel[i];
        const auto width = static_cast<std::uint32_t>(full.left.width);
        if (surface_figures_is_filled(&full, pixel)) {
            continue;  // has no prediction
        }
        counts[subpixel_sigma_q8(
            image_u8_row(&full.sigma, static_cast<int>(pixel / width))[pixel % width])]++;
    }
    std::uint32_t median = 0;
    for (std::uint64_t seen = 0;
         2 * (seen += counts[median]) < surface_figures_measured_count(&full);) {
        median++;
    }
    // 0: no prediction.
    return median == 0 ? max_tolerance_px
                       : std::clamp(median / 512.0, min_tolerance_px, max_tolerance_px);
}

triangle_list limited(const reconstruct_result &full, std::size_t count) {
    simplifier simplify(full, false);
    triangle_list triangles = all_triangles(full);
    // Most of the work in tiles, leaving room for the last step to choose the least harmful places.
    for (double tolerance = min_tolerance_px; triangles.size() / 3 > 2 * count; tolerance *= 2) {
        triangle_list fewer = simplify.within(triangles, tolerance);
        const bool stuck = fewer.size() > triangles.size() / 10 * 9;
        triangles = std::move(fewer);
        if (stuck && tolerance > 1) {
            break;  // the outlines of holes remain
        }
    }
    return triangles.size() / 3 > count ? simplify.down_to(count, triangles) : triangles;
}

triangle_list near(const reconstruct_result &full, double error_mm,
                   const std::vector<bool> &joined) {
    simplifier simplify(full, true);
    double tolerance = error_mm;
    for (int attempt = 1;; attempt++, tolerance /= 2) {
        const triangle_list triangles = simplify.within(all_triangles(full), tolerance);
        if (attempt == error_attempts ||
            mesh_distance_measure(full, joined, triangles).p99_mm <= error_mm) {
            return triangles;
        }
    }
}

template <typename value>
value *allocate(std::size_t count) {
    auto *memory =
        static_cast<value *>(std::calloc(std::max<std::size_t>(count, 1), sizeof(value)));
    if (memory == nullptr) {
        throw std::bad_alloc();
    }
    return memory;
}

/// Area-weighted sums of the triangles' normals.
void set_normals(reconstruct_result *mesh) {
    constexpr double towards_camera[] = {0, 0, -1};
    std::vector<std::array<double, 3>> sums(mesh->vertex_count);
    for (std::uint32_t i = 0; i < mesh->triangle_count; i++) {
        const std::uint32_t *corner = mesh->triangles[i];
        const std::array<double, 3> normal = mesh_distance_normal(
            mesh->points[corner[0]], mesh->points[corner[1]], mesh->points[corner[2]]);
        for (int k = 0; k < 3; k++) {
            for (std::size_t axis = 0; axis < 3; axis++) {
                sums[corner[k]][axis] += normal[axis];
            }
        }
    }
    for (std::uint32_t i = 0; i < mesh->vertex_count; i++) {
        const std::array<double, 3> &sum = sums[i];
        const double length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
        for (std::size_t axis = 0; axis < 3; axis++) {
            const double unit = length > 0 ? sum[axis] / length : towards_camera[axis];
            mesh->normals_q14[i][axis] = static_cast<std::int16_t>(std::lround(16384 * unit));
        }
    }
}

/// In an order that graphics processors draw fast and that compresses well.
void fill(const reconstruct_result &full, const triangle_list &triangles,
          reconstruct_result *mesh) {
    std::vector<std::uint32_t> ordered(triangles.size()), number(full.vertex_count);
    meshopt_optimizeVertexCache(ordered.data(), triangles.data(), triangles.size(),
                                full.vertex_count);
    const std::size_t vertices = meshopt_optimizeVertexFetchRemap(
        number.data(), ordered.data(), ordered.size(), full.vertex_count);
    mesh->triangle_count = static_cast<std::uint32_t>(triangles.size() / 3);
    mesh->vertex_count = static_cast<std::uint32_t>(vertices);
    mesh->triangles = allocate<std::uint32_t[3]>(mesh->triangle_count);
    mesh->points = allocate<triangulate_point>(vertices);
    mesh->vertex_pixel = allocate<std::uint32_t>(vertices);
    mesh->normals_q14 = allocate<std::int16_t[3]>(vertices);
    for (std::size_t i = 0; i < ordered.size(); i++) {
        mesh->triangles[i / 3][i % 3] = number[ordered[i]];
    }
    for (std::uint32_t i = 0; i < full.vertex_count; i++) {
        if (number[i] != none) {
            mesh->points[number[i]] = full.points[i];
            mesh->vertex_pixel[number[i]] = full.vertex_pixel[i];
        }
    }
    set_normals(mesh);
}

void clear(reconstruct_result *mesh) {
    mesh->points = nullptr;
    mesh->vertex_pixel = nullptr;
    mesh->normals_q14 = nullptr;
    mesh->triangles = nullptr;
    mesh->vertex_count = mesh->triangle_count = 0;
}

void make(reconstruct_context *context, const reconstruct_request &request,
          reconstruct_result *mesh) {
    const reconstruct_result &full = *context->result;
    *mesh = full;
    clear(mesh);
    const std::vector<bool> joined = mesh_distance_joined(full);
    triangle_list triangles;
    if (request.triangles > 0) {
        triangles = limited(full, static_cast<std::size_t>(request.triangles));
    } else if (request.error_mm > 0) {
        triangles = near(full, request.error_mm, joined);
    } else {
        triangles = simplifier(full, false).within(all_triangles(full), default_tolerance_px(full));
    }
    fill(full, triangles, mesh);
    const mesh_distance distance = mesh_distance_measure(full, joined, triangles);
    context->mesh_median_mm = distance.median_mm;
    context->mesh_p99_mm = distance.p99_mm;
    context->mesh_max_mm = distance.max_mm;
    context->mesh_uncovered = distance.uncovered;
    const std::uint32_t count = mesh->triangle_count;
    if (request.triangles > 0 && count > static_cast<std::uint32_t>(request.triangles)) {
        reconstruct_context_warn(context,
                                 "%u triangles are left, not %d: fewer would close holes or join "
                                 "separate parts",
                                 count, request.triangles);
    }
    if (request.error_mm > 0 && distance.p99_mm > request.error_mm) {
        reconstruct_context_warn(context,
                                 "the mesh deviates by more than --error %.3g mm at 1 %% of the "
                                 "points: %.3g mm",
                                 request.error_mm, distance.p99_mm);
    }
}

}  // namespace

int mesh_simplify_make(reconstruct_context *context, const reconstruct_request *request,
                       reconstruct_result *mesh, message *message) {
    try {
        make(context, *request, mesh);
    } catch (const cancelled &) {
        return message_set(message, ERROR_CANCELLED, "interrupted; nothing was written");
    } catch (const std::bad_alloc &) {
        return message_set(message, ERROR_MEMORY,
                           "out of memory while simplifying the mesh: omit mesh.glb with "
                           "--files, or reduce the images with %s",
                           context->caller->smaller);
    }
    return ERROR_OK;
}

void mesh_simplify_free(reconstruct_result *mesh) {
    std::free(mesh->points);
    std::free(mesh->vertex_pixel);
    std::free(mesh->normals_q14);
    std::free(mesh->triangles);
    clear(mesh);
}
