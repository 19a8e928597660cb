// SPDX-License-Identifier: Apache-2.0
/// Images of the matcher's stages (--debug), in a directory separate from the results. The caller
/// supplies the code that makes them; the board's program has none.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_DEBUG_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_DEBUG_H

#include "daemon/files/atomic_dir.h"
#include "daemon/surface/reconstruct_request.h"
#include "daemon/surface/result/reconstruct_context.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Observes the matcher and draws what it saw.
struct reconstruct_debug_maker {
    const char *const *file_names;  // all files that it may write; the last one closes the set
    int file_count;
    /// Starts observing: sets options->kernels. `row` is the row of the rectified left image whose
    /// slices are drawn. NULL if out of memory.
    void *(*begin)(struct reconstruct_options *options, int row);
    /// Writes the images into `directory`, which the caller commits. Returns 0, or a negative error
    /// code with `message` set.
    int (*write)(void *self, const struct reconstruct_context *context,
                 const struct atomic_dir *directory, struct message *message);
    void (*end)(void *self);
};

/// The images of one run; zeroed, with `directory.lock_fd` -1, if none are requested.
struct reconstruct_debug {
    const struct reconstruct_debug_maker *maker;
    void *self;
    struct atomic_dir directory;
};

/// Starts observing a run under `plan` and creates the hidden directory, if the request asks for
/// images. ERROR_ARGUMENT, ERROR_BUFFER, ERROR_FULL, ERROR_MEMORY with `message` set.
int reconstruct_debug_begin(struct reconstruct_debug *debug,
                            const struct reconstruct_debug_maker *maker,
                            const struct reconstruct_request *request,
                            const struct rectify_plan *plan, struct reconstruct_options *options,
                            struct message *message);

/// Writes the images and moves them into place, if any were requested.
int reconstruct_debug_finish(struct reconstruct_debug *debug,
                             const struct reconstruct_context *context, struct message *message);

/// Frees everything and removes what was not committed. Allowed at any time.
void reconstruct_debug_end(struct reconstruct_debug *debug);

#ifdef __cplusplus
}
#endif

#endif
