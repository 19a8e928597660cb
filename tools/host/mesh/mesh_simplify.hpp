// SPDX-License-Identifier: Apache-2.0
/// The surface with fewer triangles, for mesh.glb and mesh.ply. Edges collapse (libmeshoptimizer,
/// after M. Garland and P. Heckbert, "Surface Simplification Using Quadric Error Metrics", 1997)
/// while the surface stays within a tolerance; every vertex left is a measured point.
///
/// It is done in pixels of x, y and disparity: what is flat is flat there, too, and noise is the
/// same near and far. A tolerance in mm (--error) becomes one in pixels tile by tile. Tiles are
/// simplified alone and keep their outlines: so memory is that of a tile, Ctrl-C is heard, and the
/// edges of holes do not move. A second pass with the tiles shifted removes the seams.
#ifndef VERGENCE_TOOLS_HOST_MESH_MESH_SIMPLIFY_HPP
#define VERGENCE_TOOLS_HOST_MESH_MESH_SIMPLIFY_HPP

#include "daemon/surface/reconstruct_job.h"

/// For reconstruct_outputs; static storage.
const reconstruct_mesh_maker *mesh_maker();

#endif
