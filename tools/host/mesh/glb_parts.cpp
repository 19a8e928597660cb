// SPDX-License-Identifier: Apache-2.0
#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "daemon/surface/result/result_figures.h"
#include "tools/host/mesh/write_glb.hpp"

namespace {

constexpr double max_u16 = 65535;
constexpr int max_i8 = 127;

/// From the left camera's frame to glTF's: half a turn about x.
void position_of(const triangulate_point &point, double metres[3]) {
    metres[0] = point.x_um / 1e6;
    metres[1] = -point.y_um / 1e6;
    metres[2] = -point.z_um / 1e6;
}

template <typename value>
void put(glb_part *part, std::size_t element, std::size_t component, value number) {
    // Hosts are little-endian, like glTF.
    std::memcpy(&part->bytes[element * part->stride + component * sizeof number], &number,
                sizeof number);
}

glb_part make_part(int component, const char *type, bool normalized, std::uint32_t count,
                   std::uint32_t stride) {
    return {component, type, normalized, count, stride, glb_bytes(std::size_t{count} * stride, 0),
            {}};
}

/// Bounds of the vertices; returns the longest side.
double find_bounds(const reconstruct_result &mesh, double min[3], double max[3]) {
    double extent = 0;
    for (std::uint32_t i = 0; i < mesh.vertex_count; i++) {
        double metres[3];
        position_of(mesh.points[i], metres);
        for (int axis = 0; axis < 3; axis++) {
            min[axis] = i == 0 ? metres[axis] : std::min(min[axis], metres[axis]);
            max[axis] = i == 0 ? metres[axis] : std::max(max[axis], metres[axis]);
            extent = std::max(extent, max[axis] - min[axis]);
        }
    }
    return extent;
}

void set_positions(const reconstruct_result &mesh, double pitch_m, glb_parts *parts) {
    double min[3], max[3];
    const double extent = find_bounds(mesh, min, max);
    const bool exact = extent / max_u16 > pitch_m / 4 || !(extent > 0);
    glb_part &part = parts->part[glb_parts::POSITIONS];
    part = exact ? make_part(glb_f32, "VEC3", false, mesh.vertex_count, 12)
                 : make_part(glb_u16, "VEC3", false, mesh.vertex_count, 8);
    parts->scale_m = exact ? 1 : std::max(extent / max_u16, pitch_m / 8);
    for (int axis = 0; axis < 3; axis++) {
        const double offset = exact ? 0 : min[axis];
        parts->offset_m[axis] = offset;
        const auto stored = [&](double metres) {
            const double value = (metres - offset) / parts->scale_m;
            return exact ? static_cast<double>(static_cast<float>(value)) : std::round(value);
        };
        parts->min[axis] = stored(min[axis]);
        parts->max[axis] = stored(max[axis]);
        for (std::uint32_t i = 0; i < mesh.vertex_count; i++) {
            double metres[3];
            position_of(mesh.points[i], metres);
            const double value = stored(metres[axis]);
            if (exact) {
                put(&part, i, static_cast<std::size_t>(axis), static_cast<float>(value));
            } else {
                put(&part, i, static_cast<std::size_t>(axis), static_cast<std::uint16_t>(value));
            }
        }
    }
}

/// As unit vectors in glTF's frame.
void set_normals(const reconstruct_result &mesh, glb_part *part) {
    constexpr double towards_viewer[] = {0, 0, 1};
    for (std::size_t i = 0; i < part->count; i++) {
        const std::int16_t *q14 = mesh.normals_q14[i];
        const double v[3] = {1.0 * q14[0], -1.0 * q14[1], -1.0 * q14[2]};
        const double length = std::hypot(v[0], v[1], v[2]);
        for (std::size_t axis = 0; axis < 3; axis++) {
            const double unit = length > 0 ? v[axis] / length : towards_viewer[axis];
            put(part, i, axis, static_cast<std::int8_t>(std::lround(max_i8 * unit)));
        }
    }
}

/// Texture coordinates start at the edge of the image, ours at the centre of a pixel.
void set_places(const reconstruct_result &mesh, glb_part *part) {
    const auto width = static_cast<std::uint32_t>(mesh.left_colour.width);
    const double height = mesh.left_colour.height;
    for (std::size_t i = 0; i < part->count; i++) {
        const std::uint32_t pixel = mesh.vertex_pixel[i];
        const double u = (pixel % width + 0.5) / width, v = (pixel / width + 0.5) / height;
        put(part, i, 0, static_cast<std::uint16_t>(std::lround(max_u16 * u)));
        put(part, i, 1, static_cast<std::uint16_t>(std::lround(max_u16 * v)));
    }
}

void set_indices(const reconstruct_result &mesh, glb_part *part) {
    // With strips, the largest number of each type ends a strip.
    const bool small = mesh.vertex_count <= std::numeric_limits<std::uint16_t>::max();
    const std::uint32_t count = 3 * mesh.triangle_count;
    *part = small ? make_part(glb_u16, "SCALAR", false, count, 2)
                  : make_part(glb_u32, "SCALAR", false, count, 4);
    for (std::size_t i = 0; i < count; i++) {
        const std::uint32_t number = mesh.triangles[i / 3][i % 3];
        if (small) {
            put(part, i, 0, static_cast<std::uint16_t>(number));
        } else {
            put(part, i, 0, number);
        }
    }
}

/// Which points were not measured; the part stays empty if all were.
void set_filled(const reconstruct_result &mesh, glb_part *part) {
    if (mesh.reason_count[REASON_FILLED] == 0) {
        return;
    }
    *part = make_part(glb_u8, "SCALAR", false, mesh.vertex_count, 4);
    for (std::size_t i = 0; i < part->count; i++) {
        put(part, i, 0,
            static_cast<std::uint8_t>(surface_figures_is_filled(&mesh, mesh.vertex_pixel[i]) ? 1
                                                                                             : 0));
    }
}

/// Pixels unscaled: integers compress three times as well. The material scales them.
void set_pixels(const reconstruct_result &mesh, glb_part *part) {
    const auto width = static_cast<std::uint32_t>(mesh.left_colour.width);
    for (std::size_t i = 0; i < part->count; i++) {
        const std::uint32_t pixel = mesh.vertex_pixel[i];
        put(part, i, 0, static_cast<std::uint16_t>(pixel % width));
        put(part, i, 1, static_cast<std::uint16_t>(pixel / width));
    }
}

void pack_vertices(const void *data, glb_part *part) {
    part->mode = "ATTRIBUTES";
    part->packed.resize(meshopt_encodeVertexBufferBound(part->count, part->stride));
    part->packed.resize(meshopt_encodeVertexBuffer(part->packed.data(), part->packed.size(), data,
                                                   part->count, part->stride));
}

/// Floating-point numbers with enough bits to resolve a quarter of a pixel at any depth.
void pack_positions(const reconstruct_result &mesh, glb_parts *parts) {
    glb_part *part = &parts->part[glb_parts::POSITIONS];
    *part = make_part(glb_f32, "VEC3", false, mesh.vertex_count, 12);
    std::vector<float> metres(3 * std::size_t{mesh.vertex_count});
    for (std::size_t i = 0; i < mesh.vertex_count; i++) {
        double exact[3];
        position_of(mesh.points[i], exact);
        std::copy_n(exact, 3, &metres[3 * i]);
    }
    const int bits = std::clamp(4 + std::ilogb(mesh.plan.f_px), 10, 24);
    part->filter = "EXPONENTIAL";
    meshopt_encodeFilterExp(part->bytes.data(), part->count, part->stride, bits, metres.data());
    pack_vertices(part->bytes.data(), part);
    meshopt_decodeFilterExp(part->bytes.data(), part->count, part->stride);
    std::memcpy(metres.data(), part->bytes.data(), part->bytes.size());
    parts->scale_m = 1;
    for (std::size_t i = 0; i < metres.size(); i++) {
        const double value = static_cast<double>(metres[i]);
        double &min = parts->min[i % 3], &max = parts->max[i % 3];
        min = i < 3 ? value : std::min(min, value);
        max = i < 3 ? value : std::max(max, value);
    }
}

void pack_indices(const reconstruct_result &mesh, glb_part *part) {
    part->mode = "TRIANGLES";
    meshopt_encodeIndexVersion(1);  // required by the extension
    part->packed.resize(meshopt_encodeIndexBufferBound(part->count, mesh.vertex_count));
    part->packed.resize(meshopt_encodeIndexBuffer(part->packed.data(), part->packed.size(),
                                                  mesh.triangles[0], part->count));
}

}  // namespace

glb_parts glb_parts_make(const reconstruct_result &mesh, double pitch_m) {
    glb_parts parts{};
    set_positions(mesh, pitch_m, &parts);
    glb_part *part = parts.part;
    part[glb_parts::NORMALS] = make_part(glb_i8, "VEC3", true, mesh.vertex_count, 4);
    set_normals(mesh, &part[glb_parts::NORMALS]);
    part[glb_parts::PLACES] = make_part(glb_u16, "VEC2", true, mesh.vertex_count, 4);
    set_places(mesh, &part[glb_parts::PLACES]);
    set_filled(mesh, &part[glb_parts::FILLED]);
    set_indices(mesh, &part[glb_parts::INDICES]);
    return parts;
}

glb_parts glb_parts_packed(const reconstruct_result &mesh) {
    glb_parts parts{};
    glb_part *part = parts.part;
    pack_positions(mesh, &parts);
    part[glb_parts::PLACES] = make_part(glb_u16, "VEC2", false, mesh.vertex_count, 4);
    set_pixels(mesh, &part[glb_parts::PLACES]);
    pack_vertices(part[glb_parts::PLACES].bytes.data(), &part[glb_parts::PLACES]);
    set_filled(mesh, &part[glb_parts::FILLED]);
    if (part[glb_parts::FILLED].count > 0) {
        pack_vertices(part[glb_parts::FILLED].bytes.data(), &part[glb_parts::FILLED]);
    }
    set_indices(mesh, &part[glb_parts::INDICES]);
    pack_indices(mesh, &part[glb_parts::INDICES]);
    return parts;
}
