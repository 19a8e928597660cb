// SPDX-License-Identifier: Apache-2.0
/// What a program can write of a reconstruction.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_OUTPUTS_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_OUTPUTS_H

#include "daemon/surface/reconstruct_debug.h"
#include "daemon/surface/reconstruct_request.h"
#include "daemon/surface/result/reconstruct_context.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RECONSTRUCT_OUTPUTS_WRITERS_MAX = 24 };

struct reconstruct_outputs {
    const struct result_writer *writers;  // run in this order; result.json must be last
    int writer_count;                     // 1..RECONSTRUCT_OUTPUTS_WRITERS_MAX
    /// Reads the ground truth and the mask that `context` names, so that unreadable files are
    /// rejected before the work; returns width and height. NULL: no writer compares with ground
    /// truth.
    int (*check_truth)(const struct reconstruct_context *context, int size_px[2],
                       struct message *message);
    const struct reconstruct_debug_maker *debug_maker;  // NULL: no images of the matcher
    /// Simplifies the surface for the mesh files: as `request` asks, or by default. The result must
    /// have triangles. ERROR_MEMORY, ERROR_CANCELLED with `message` set; may add warnings to
    /// `context`. NULL: mesh files hold the full surface.
    int (*make_mesh)(struct reconstruct_context *context, const struct reconstruct_request *request,
                     struct reconstruct_mesh *mesh, struct message *message);
    void (*free_mesh)(struct reconstruct_mesh *mesh);  // no effect on a zeroed mesh
};

#ifdef __cplusplus
}
#endif

#endif
