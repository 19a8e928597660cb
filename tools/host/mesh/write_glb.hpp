// SPDX-License-Identifier: Apache-2.0
/// mesh.glb: the simplified surface as binary glTF 2.0, textured with the rectified left image (an
/// embedded JPEG). In glTF's conventions: metres, x right, y up, z towards the viewer. The rotation
/// from the left camera's frame (y down, z forward) is applied to the vertices themselves; the node
/// only scales and shifts (KHR_mesh_quantization).
/// Source: Khronos Group, "glTF 2.0 Specification".
#ifndef VERGENCE_TOOLS_HOST_MESH_WRITE_GLB_HPP
#define VERGENCE_TOOLS_HOST_MESH_WRITE_GLB_HPP

#include <cstdint>
#include <vector>

#include "daemon/surface/result/reconstruct_context.h"
#include "stereo/reconstruct.h"

///
/// Points that were not measured have 1 in the attribute _FILLED, and their pixels of the texture a
/// tint (see fill.h).

/// A `result_writer`'s function. Needs at least one triangle.
int write_glb(const reconstruct_context *context, const char *path, message *message);

/// The binary parts of a glTF mesh: 16 bytes per vertex instead of 32 (KHR_mesh_quantization),
/// optionally compressed (EXT_meshopt_compression).

using glb_bytes = std::vector<unsigned char>;

/// Of an accessor.
constexpr int glb_i8 = 5120, glb_u8 = 5121, glb_u16 = 5123, glb_u32 = 5125, glb_f32 = 5126;

/// One accessor with its own buffer view.
struct glb_part {
    int component;        // one of the above
    const char *type;     // "VEC3"
    bool normalized;      // integers map to -1..1 or 0..1
    std::uint32_t count;  // elements
    std::uint32_t stride;
    glb_bytes bytes;

    // When compressed:
    glb_bytes packed;
    const char *mode = nullptr, *filter = nullptr;
};

struct glb_parts {
    enum { POSITIONS, NORMALS, PLACES, FILLED, INDICES, COUNT };
    glb_part part[COUNT];
    double min[3], max[3];  // bounds of the stored positions
    // metres = offset + scale * stored
    double offset_m[3], scale_m;
};

/// For a result with triangles. `pitch_m` is the width of a pixel on the near part of the surface:
/// positions are not finer than an eighth of it. If 16 bits are coarser than a quarter of it,
/// positions stay floating-point.
glb_parts glb_parts_make(const reconstruct_result &mesh, double pitch_m);

/// Compressed, for minimum size: positions with as many digits as there are pixels, texture
/// coordinates in pixels, no normals (the part is empty), which an unlit material does not use.
glb_parts glb_parts_packed(const reconstruct_result &mesh);

#endif
