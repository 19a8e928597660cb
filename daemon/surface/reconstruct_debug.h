// SPDX-License-Identifier: Apache-2.0
/// Pictures of what the matcher does (--debug): a directory of their own beside the results. Who
/// makes them is the caller's choice; the board's program makes none.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_DEBUG_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_DEBUG_H

#include "daemon/files/outdir.h"
#include "daemon/surface/reconstruct_request.h"
#include "daemon/surface/result/reconstruct_context.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Somebody who looks at the matcher and draws what was seen.
struct reconstruct_debug_maker {
    const char *const *file_names;  // all that it may write; the last one closes the set
    int file_count;
    /// Begins to look: sets options->kernels. `row` is that of the rectified left image of which
    /// slices are drawn. NULL when memory is short.
    void *(*begin)(struct reconstruct_options *options, int row);
    /// Writes the pictures into `directory`, which its caller commits. Returns 0, or a negative
    /// error code with `message` set.
    int (*write)(void *self, const struct reconstruct_context *context,
                 const struct outdir *directory, struct message *message);
    void (*end)(void *self);
};

/// The pictures of one run; all members are 0 and `directory.lock_fd` -1 when none are wanted.
struct reconstruct_debug {
    const struct reconstruct_debug_maker *maker;
    void *self;
    struct outdir directory;
};

/// Begins to look at a run under `plan` and makes the hidden directory, when the request asks for
/// pictures. ERROR_ARGUMENT, ERROR_BUFFER, ERROR_FULL, ERROR_MEMORY with `message` set.
int reconstruct_debug_begin(struct reconstruct_debug *debug,
                            const struct reconstruct_debug_maker *maker,
                            const struct reconstruct_request *request,
                            const struct rectify_plan *plan, struct reconstruct_options *options,
                            struct message *message);

/// Writes the pictures and puts them in place, when there are any to be made.
int reconstruct_debug_finish(struct reconstruct_debug *debug,
                             const struct reconstruct_context *context, struct message *message);

/// Frees everything and removes what is not in place. Harmless at any time.
void reconstruct_debug_end(struct reconstruct_debug *debug);

#ifdef __cplusplus
}
#endif

#endif
