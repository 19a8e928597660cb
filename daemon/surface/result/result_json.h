// SPDX-License-Identifier: Apache-2.0
/// result.json: all figures of a reconstruction.
#ifndef VERGENCE_DAEMON_SURFACE_RESULT_RESULT_JSON_H
#define VERGENCE_DAEMON_SURFACE_RESULT_RESULT_JSON_H

#include <stdio.h>

#include "daemon/surface/result/reconstruct_context.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Prints the document; the stream's error indicator shows whether it was written.
void result_json_print(const struct reconstruct_context *context, FILE *stream);

#ifdef __cplusplus
}
#endif

#endif
