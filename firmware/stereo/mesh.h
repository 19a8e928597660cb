// SPDX-License-Identifier: Apache-2.0
/// Surface from image neighbourhood: joins rows y-1 and y with triangles, without bridging depth
/// gaps. Triangles are counter-clockwise seen from the camera.
#ifndef VERGENCE_STEREO_MESH_H
#define VERGENCE_STEREO_MESH_H

#include <stdint.h>

#include "stereo/geometry/triangulate.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Pixel without a vertex.
#define MESH_NO_VERTEX UINT32_MAX

/// One row of candidate vertices.
struct mesh_row {
    const int32_t *disparity_q8;  // width values; only those with a vertex are read
    const uint32_t *vertex;       // vertex number of each pixel or MESH_NO_VERTEX
};

struct mesh_options {
    int width_px;
    int32_t max_gap_q8;  // neighbours whose disparities differ by more are not joined; default
                         // MESH_DEFAULT_GAP_Q8
};

/// One pixel of disparity per pixel: steeper surfaces cannot be seen by both cameras in one
/// direction, and are gaps in the other.
enum { MESH_DEFAULT_GAP_Q8 = 256 };

/// Computes the triangles between two neighbouring rows into `triangles` (3 vertex numbers each;
/// room for 2 (width - 1)). Of the two diagonals of a cell the one with the smaller disparity gap
/// is used; a cell with three vertices gives one triangle. Returns the number of triangles.
int mesh_join_rows(const struct mesh_options *options, const struct mesh_row *above,
                   const struct mesh_row *below, uint32_t (*triangles)[3]);

/// Adds the triangle's area-weighted normal (square micrometres, twice the area; edges above 268 m
/// are scaled down) to the sum of one of its corners, for `mesh_normal_q14`. A vertex has at most
/// eight triangles, so the sum fits.
void mesh_accumulate_normal(const struct triangulate_point *a, const struct triangulate_point *b,
                            const struct triangulate_point *c, int64_t sum[3]);

/// Unit normal in 1/16384; (0,0,-16384) (towards the camera) for a zero sum.
void mesh_normal_q14(const int64_t sum[3], int16_t normal_q14[3]);

#ifdef __cplusplus
}
#endif

#endif
