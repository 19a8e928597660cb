// SPDX-License-Identifier: Apache-2.0
/// What a program can read and write of a reconstruction.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_PROGRAM_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_PROGRAM_H

#include "daemon/files/atomic_dir.h"
#include "daemon/images/image_file.h"
#include "daemon/surface/calibration_loader.h"
#include "daemon/surface/reconstruct_request.h"
#include "daemon/surface/result/result_format.h"

#ifdef __cplusplus
extern "C" {
#endif

struct reconstruct_program {
    const struct image_format *formats;  // formats of the images that it reads
    int format_count;
    calibration_loader *load_calibration;
    const struct adjust_target *target;      // as in reconstruct_adjust_scene; NULL: none
    result_writer *writers[RESULT_FORMATS];  // NULL: it does not write this file
    /// Reads the ground truth and the mask that `context` names, so that unreadable files are
    /// rejected before the work; returns width and height. NULL: no writer compares with ground
    /// truth.
    int (*check_truth)(const struct reconstruct_context *context, int size_px[2],
                       struct message *message);
    /// Simplifies the surface for the mesh files: as `request` asks, or by default, and sets the
    /// distances in `context`. The result must have triangles. ERROR_MEMORY, ERROR_CANCELLED with
    /// `message` set; may add warnings to `context`. NULL: mesh files hold the full surface.
    int (*make_mesh)(struct reconstruct_context *context, const struct reconstruct_request *request,
                     struct reconstruct_result *mesh, struct message *message);
    void (*free_mesh)(struct reconstruct_result *mesh);  // no effect on a zeroed mesh

    // Images of the matcher's stages (--debug), in a directory separate from the results.
    const char *const *debug_files;  // all that it may write; the last one closes the set
    int debug_file_count;            // 0: none
    /// Starts observing: sets options->kernels. `row` is the row of the rectified left image whose
    /// slices are drawn. NULL if out of memory.
    void *(*debug_begin)(struct reconstruct_options *options, int row);
    /// Writes the images into `directory`, which the caller commits. Returns 0, or a negative error
    /// code with `message` set.
    int (*debug_write)(void *debug, const struct reconstruct_context *context,
                       const struct atomic_dir *directory, struct message *message);
    void (*debug_end)(void *debug);
};

/// The instrument's program: its own formats, no images of results, no report.
extern const struct reconstruct_program reconstruct_program_system;

#ifdef __cplusplus
}
#endif

#endif
