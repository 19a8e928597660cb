// SPDX-License-Identifier: Apache-2.0
/// Doubts about a reconstruction, as warnings in its context.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_DOUBTS_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_DOUBTS_H

#include "daemon/surface/result/reconstruct_context.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Adds what makes the surface doubtful: a sparse one, repeating texture, rows that do not
/// correspond, disparities beyond infinity.
void reconstruct_doubts_record(struct reconstruct_context *context);

#ifdef __cplusplus
}
#endif

#endif
