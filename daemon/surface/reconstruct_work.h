// SPDX-License-Identifier: Apache-2.0
/// How long the stages of a reconstruction will take against each other: for the progress bar,
/// which shows the whole run.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_WORK_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_WORK_H

#include "stereo/reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The stages of enum reconstruct_stage, and writing the results.
enum { RECONSTRUCT_WORK_WRITE = RECONSTRUCT_STAGES, RECONSTRUCT_WORK_STAGES };

/// Estimates each stage's time, in ns of one processor that was measured. `raw`: one of the images.
void reconstruct_work_estimate(const struct reconstruct_image *raw, const struct rectify_plan *plan,
                               const struct reconstruct_options *options, int threads,
                               double work_ns[RECONSTRUCT_WORK_STAGES]);

#ifdef __cplusplus
}
#endif

#endif
