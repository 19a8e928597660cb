// SPDX-License-Identifier: Apache-2.0
/// Disparities beyond infinity (REASON_BEYOND), of pairs that came without a calibration: they are
/// in the maps, but have no points.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_BEYOND_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_BEYOND_H

#include <stdbool.h>

#include "daemon/surface/result/reconstruct_context.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Adds a note with their share, unless it is negligible.
void reconstruct_beyond_note(struct reconstruct_context *context);

/// Whether the result file `file_name` is left out, as it describes a surface and there is none.
bool reconstruct_beyond_skips(const struct reconstruct_result *result, const char *file_name);

#ifdef __cplusplus
}
#endif

#endif
