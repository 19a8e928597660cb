// SPDX-License-Identifier: Apache-2.0
/// Relative duration of the stages of a reconstruction, for a progress bar over the whole run.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_WORK_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_WORK_H

#include "stereo/reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The stages of enum reconstruct_stage, then writing the results.
enum { RECONSTRUCT_WORK_WRITE = RECONSTRUCT_STAGES, RECONSTRUCT_WORK_STAGES };

/// Estimates each stage's time in ns, as measured on one processor. `raw`: one of the images.
void reconstruct_work_estimate(const struct raw_image *raw, const struct rectify_plan *plan,
                               const struct reconstruct_options *options, int threads,
                               double work_ns[RECONSTRUCT_WORK_STAGES]);

#ifdef __cplusplus
}
#endif

#endif
