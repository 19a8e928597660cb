// SPDX-License-Identifier: Apache-2.0
/// Points and triangles of a matched pair. Private to the reconstruction.
#ifndef VERGENCE_RIG_SURFACE_H
#define VERGENCE_RIG_SURFACE_H

#include "core/arena.h"
#include "core/parallel.h"
#include "rig/reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Memory of the points, normals and triangles of `valid` matches in an image, with scratch.
size_t surface_need_bytes(int width_px, int height_px, size_t valid);

/// Fills points and vertex_pixel of `result` (row by row, left to right) from its matches; a match
/// whose rays do not meet becomes REASON_OUT_OF_RANGE. ERROR_MEMORY, ERROR_RANGE.
int surface_triangulate(const struct parallel *parallel, struct arena *arena,
                        struct reconstruct_result *result);

/// Fills triangles and normals. Rows are joined where neighbouring disparities differ by at most
/// max_gap_q8. ERROR_MEMORY.
int surface_mesh(int32_t max_gap_q8, struct arena *arena, struct reconstruct_result *result);

#ifdef __cplusplus
}
#endif

#endif
