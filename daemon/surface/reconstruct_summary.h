// SPDX-License-Identifier: Apache-2.0
/// Summary for people at the end of `vergence reconstruct`.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_SUMMARY_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_SUMMARY_H

#include <stdio.h>

#include "daemon/surface/result/reconstruct_context.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Prints the main figures and the path of the results.
void reconstruct_summary_print(const struct reconstruct_context *context, const char *out_path,
                               FILE *stream);

/// Sets one line that says why no surface was found.
void reconstruct_summary_no_surface(const struct reconstruct_context *context,
                                    struct message *message);

/// Sets one line that says why no plan could be made: `error` is the error of rectify_plan_make for
/// the calibration and the options of `context`, whose result is not used.
void reconstruct_summary_no_plan(int error, const struct reconstruct_context *context,
                                 struct message *message);

#ifdef __cplusplus
}
#endif

#endif
