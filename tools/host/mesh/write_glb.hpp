// SPDX-License-Identifier: Apache-2.0
/// mesh.glb: the simplified surface as binary glTF 2.0, textured with the rectified left image (an
/// embedded JPEG). In glTF's conventions: metres, x right, y up, z towards the viewer. The rotation
/// from the left camera's frame (y down, z forward) is applied to the vertices themselves; the node
/// only scales and shifts (KHR_mesh_quantization).
/// Source: Khronos Group, "glTF 2.0 Specification".
#ifndef VERGENCE_TOOLS_HOST_MESH_WRITE_GLB_HPP
#define VERGENCE_TOOLS_HOST_MESH_WRITE_GLB_HPP

#include "daemon/surface/result/reconstruct_context.h"

/// A `result_writer`'s function. Needs at least one triangle.
int write_glb(const reconstruct_context *context, const char *path, message *message);

#endif
