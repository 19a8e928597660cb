// SPDX-License-Identifier: Apache-2.0
/// Points and triangles of a matched pair. Private to the reconstruction.
#ifndef VERGENCE_STEREO_SURFACE_H
#define VERGENCE_STEREO_SURFACE_H

#include "core/arena.h"
#include "core/parallel.h"
#include "stereo/reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Memory for the points, normals and triangles of `valid` matches in an image, including scratch.
size_t surface_need_bytes(int width_px, int height_px, size_t valid);

/// Range of left z of the points that are kept, inclusive.
struct surface_depths {
    int32_t near_um, far_um;
};

/// Converts a depth range to um, rounded outwards; near_mm and far_mm 0, or far_mm INFINITY: that
/// end is open. Ends beyond 2.1 km count as open.
struct surface_depths surface_depths_of(double near_mm, double far_mm);

/// Fills points and vertex_pixel of `result` (row by row, left to right) from its matches. A match
/// whose rays do not meet, or meet outside `depths`, becomes REASON_OUT_OF_RANGE. ERROR_MEMORY,
/// ERROR_RANGE.
int surface_triangulate(const struct parallel *parallel, struct arena *arena,
                        const struct surface_depths *depths, struct reconstruct_result *result);

/// Fills triangles and normals. Rows are joined where neighbouring disparities differ by at most
/// max_gap_q8. ERROR_MEMORY.
int surface_mesh(int32_t max_gap_q8, struct arena *arena, struct reconstruct_result *result);

#ifdef __cplusplus
}
#endif

#endif
