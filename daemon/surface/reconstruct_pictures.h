// SPDX-License-Identifier: Apache-2.0
/// Reasons for a poor surface that the two images themselves show: light, blur, and the viewing
/// directions.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_PICTURES_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_PICTURES_H

#include <stdbool.h>

#include "daemon/surface/result/reconstruct_context.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Computes the statistics of the images of `context` into its `picture`. ERROR_ARGUMENT with
/// `message` set if both are the same image, which cannot be measured.
int reconstruct_pictures_assess(struct reconstruct_context *context, struct message *message);

/// Call after matching. If less than half of the pixels could be measured and the images show the
/// reason, sets `cause` to it, several separated by semicolons. False: the images show no reason,
/// or the surface is not poor.
bool reconstruct_pictures_explain(const struct reconstruct_context *context, struct message *cause);

#ifdef __cplusplus
}
#endif

#endif
