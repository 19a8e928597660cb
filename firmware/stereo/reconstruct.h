// SPDX-License-Identifier: Apache-2.0
/// From two raw images and a calibration to a surface: develop, rectify, match, refine,
/// triangulate, mesh. All memory comes from the caller's arena, and all results point into it.
#ifndef VERGENCE_STEREO_RECONSTRUCT_H
#define VERGENCE_STEREO_RECONSTRUCT_H

#include "stereo/reconstruct_types.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Name of a stage; static storage. `stage` must be one.
const char *reconstruct_stage_text(enum reconstruct_stage stage);

/// The default options.
struct reconstruct_options reconstruct_default_options(void);

/// The disparities that the matcher searches under `plan`: those requested, and those beyond both
/// ends where an object must not be mistaken for one inside the range.
struct match_options reconstruct_match_options(const struct rectify_plan *plan,
                                               const struct reconstruct_options *options);

/// Upper bounds of the memory that `reconstruct_run` needs, of what of that the result takes, and
/// what of that its maps.
struct reconstruct_need {
    size_t bytes, result_bytes, map_bytes;
};

/// The memory needed under `plan`, which comes from `rectify_plan_make` with the same calibration.
/// Of the raw images only layout and bits are read.
struct reconstruct_need reconstruct_needs(const struct raw_image *left,
                                          const struct raw_image *right,
                                          const struct calibration *calibration,
                                          const struct rectify_plan *plan,
                                          const struct reconstruct_options *options, int threads);

/// Runs all stages. `plan` comes from `rectify_plan_make` with the same calibration.
/// ERROR_SIZE_MISMATCH, ERROR_MEMORY, ERROR_CANCELLED, ERROR_NO_SURFACE (the result then holds
/// images, disparities and reasons but no points), and the errors of the stages.
int reconstruct_run(const struct raw_image *left, const struct raw_image *right,
                    const struct calibration *calibration, const struct rectify_plan *plan,
                    const struct reconstruct_options *options,
                    const struct reconstruct_environment *environment, struct arena *arena,
                    struct reconstruct_result *result);

/// Row y of the rectified left image in colour, 3 * width bytes, valid until the next call. If
/// pictures are made again so is the row: the raw pixels and `parallel` of the run must live.
const uint8_t *reconstruct_colour_row(const struct reconstruct_result *result, int y);

#ifdef __cplusplus
}
#endif

#endif
