// SPDX-License-Identifier: Apache-2.0
/// The binary parts of a glTF mesh: 16 bytes per vertex instead of 32 (KHR_mesh_quantization),
/// optionally compressed (EXT_meshopt_compression).
#ifndef VERGENCE_TOOLS_HOST_MESH_GLB_PARTS_HPP
#define VERGENCE_TOOLS_HOST_MESH_GLB_PARTS_HPP

#include <cstdint>
#include <vector>

#include "stereo/reconstruct.h"

using glb_bytes = std::vector<unsigned char>;

/// Of an accessor.
constexpr int glb_i8 = 5120, glb_u16 = 5123, glb_u32 = 5125, glb_f32 = 5126;

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
    enum { POSITIONS, NORMALS, PLACES, INDICES, COUNT };
    glb_part part[COUNT];
    double min[3], max[3];  // of the stored positions
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
