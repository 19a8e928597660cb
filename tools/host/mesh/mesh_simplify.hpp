// SPDX-License-Identifier: Apache-2.0
/// The surface with fewer triangles, for mesh.glb and mesh.ply. Edges collapse (libmeshoptimizer,
/// after M. Garland and P. Heckbert, "Surface Simplification Using Quadric Error Metrics", 1997)
/// while the surface stays within a tolerance; every remaining vertex is a measured point.
///
/// It works in pixels of x, y and disparity: planes stay planes, and noise is the same near and
/// far. A tolerance in mm (--error) is converted to pixels tile by tile. Tiles are simplified
/// separately and keep their outlines: this limits the memory to that of a tile, reacts quickly to
/// Ctrl-C, and keeps the edges of holes. A second pass with shifted tiles removes the seams.
#ifndef VERGENCE_TOOLS_HOST_MESH_MESH_SIMPLIFY_HPP
#define VERGENCE_TOOLS_HOST_MESH_MESH_SIMPLIFY_HPP

#include "daemon/surface/reconstruct_program.h"

/// `make_mesh` and `free_mesh` of reconstruct_program.
int mesh_simplify_make(reconstruct_context *context, const reconstruct_request *request,
                       reconstruct_result *mesh, message *message);
void mesh_simplify_free(reconstruct_result *mesh);

#endif
