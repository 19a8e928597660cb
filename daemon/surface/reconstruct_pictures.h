// SPDX-License-Identifier: Apache-2.0
/// What the two pictures of a reconstruction say themselves about a surface that came out poor:
/// light, blur, and where the cameras look.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_PICTURES_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_PICTURES_H

#include <stdbool.h>

#include "daemon/surface/result/reconstruct_context.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Judges the images of `context` into its `picture`. ERROR_ARGUMENT with `message` set when both
/// are the same picture, from which nothing can be measured.
int reconstruct_pictures_judge(struct reconstruct_context *context, struct message *message);

/// When less than half of the pixels could be measured, for a reason that the pictures show: sets
/// `cause` to it, several with semicolons. False: they look as they should, or the surface is not
/// poor. After the matching.
bool reconstruct_pictures_blame(const struct reconstruct_context *context, struct message *cause);

#ifdef __cplusplus
}
#endif

#endif
