// SPDX-License-Identifier: Apache-2.0
/// result.json: all figures of a reconstruction.
#ifndef VERGENCE_DAEMON_RESULT_JSON_H
#define VERGENCE_DAEMON_RESULT_JSON_H

#include <stdio.h>

#include "daemon/reconstruct_context.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Smallest box around the points in mm, left camera frame. Needs at least one point.
struct result_json_bounds {
    double least_mm[3], greatest_mm[3];
};
struct result_json_bounds result_json_bounds(const struct reconstruct_result* result);

/// Pixels of the rectified left image that have a disparity, in percent of all.
double result_json_density_percent(const struct reconstruct_result* result);

/// Prints the document; the stream's error indicator says whether it arrived.
void result_json_print(const struct reconstruct_context* context, FILE* stream);

#ifdef __cplusplus
}
#endif

#endif
