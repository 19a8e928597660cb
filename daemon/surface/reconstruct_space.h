// SPDX-License-Identifier: Apache-2.0
/// The check that there is room for a reconstruction and its files.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_SPACE_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_SPACE_H

#include "daemon/files/free_space.h"
#include "daemon/surface/reconstruct_program.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What the work and its files need at most: the files of `list` (NULL: all) that `program` writes.
/// The context's plan is made, its threads are set.
struct free_space reconstruct_space_need(const struct reconstruct_context *context,
                                         const struct reconstruct_program *program,
                                         const char *list);

/// ERROR_MEMORY or ERROR_FULL, with what is needed, what is there and what would fit in `message`.
int reconstruct_space_refuse(const struct reconstruct_context *context,
                             const struct reconstruct_program *program, const char *list,
                             const struct free_space *available, struct message *message);

#ifdef __cplusplus
}
#endif

#endif
