// SPDX-License-Identifier: Apache-2.0
/// Points and triangles of a matched pair: kept, or made again, row by row, by each that reads
/// them.
#ifndef VERGENCE_STEREO_SURFACE_H
#define VERGENCE_STEREO_SURFACE_H

#include "core/arena.h"
#include "core/parallel.h"
#include "stereo/reconstruct_types.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Memory for the points, normals and triangles of `valid` matches in an image, including scratch;
/// `valid` 0: of a surface that is made again.
size_t surface_need_bytes(int width_px, int height_px, size_t valid);

/// Range of left z of the points that are kept, inclusive.
struct surface_depths {
    int32_t near_um, far_um;
    bool keep_beyond;  // matches whose rays do not meet keep their disparities
};

/// Converts a depth range to um, rounded outwards; near_mm and far_mm 0, or far_mm INFINITY: that
/// end is open. Ends beyond 2.1 km count as open.
struct surface_depths surface_depths_of(double near_mm, double far_mm);

/// Fills points and vertex_pixel of `result` (row by row, left to right) from its matches. A match
/// whose rays do not meet, or meet outside `depths`, becomes REASON_OUT_OF_RANGE, or, if those are
/// kept, REASON_BEYOND. `recompute`: only
/// counts the points. ERROR_MEMORY, ERROR_RANGE.
int surface_triangulate(const struct parallel *parallel, struct arena *arena,
                        const struct surface_depths *depths, bool recompute,
                        struct reconstruct_result *result);

/// Fills triangles and normals; of a surface without points only counts the triangles, and takes
/// the memory for surface_walk. Rows are joined where neighbouring disparities differ by at most
/// the result's max_gap_q8. ERROR_MEMORY.
int surface_mesh(struct arena *arena, struct reconstruct_result *result);

/// What a walk over the surface visits, as bits.
enum { SURFACE_POINTS = 1, SURFACE_NORMALS = 2 | SURFACE_POINTS, SURFACE_TRIANGLES = 4 };

/// A part of the surface; arrays that were not asked for are NULL. Valid during the visit.
struct surface_part {
    uint32_t vertex_count;
    const struct triangulate_point *points;
    const uint32_t *vertex_pixel;
    int16_t (*normals_q14)[3];
    uint32_t triangle_count;
    uint32_t (*triangles)[3];
};

/// Visits all points in the order of their numbers, or all triangles in theirs: at once if the
/// surface is kept, else row by row. One walk at a time, while the result is valid.
void surface_walk(const struct reconstruct_result *result, unsigned what,
                  void (*visit)(void *self, const struct surface_part *part), void *self);

#ifdef __cplusplus
}
#endif

#endif
