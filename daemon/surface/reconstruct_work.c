// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_work.h"

#include "core/invariant.h"

/// Measured on pairs of 1.4 and 16.8 million pixels with one thread, per pixel or per cell of
/// `match_work`. Only rough ratios matter.
static const double develop_ns = 20, rectify_ns = 9, match_cell_ns = 1.6, refine_ns = 65,
                    triangulate_ns = 55, mesh_ns = 65, write_ns = 1000;

void reconstruct_work_estimate(const struct raw_image *raw, const struct rectify_plan *plan,
                               const struct reconstruct_options *options, int threads,
                               double work_ns[RECONSTRUCT_WORK_STAGES]) {
    INVARIANT(threads >= 1);
    const double raw_pixels = (double)raw->width_px * raw->height_px;
    const double pixels = (double)plan->width_px * plan->height_px;
    const struct match_options match = reconstruct_match_options(plan, options);
    const double cells = (double)match_work(plan->width_px, plan->height_px, &match);
    // The greedy path is single-threaded.
    const int matching = options->preset == MATCH_PRESET_PAPER ? 1 : threads;
    work_ns[RECONSTRUCT_PLAN] = 0;
    work_ns[RECONSTRUCT_DEVELOP] = develop_ns * raw_pixels / threads;
    work_ns[RECONSTRUCT_RECTIFY] = rectify_ns * pixels / threads;
    work_ns[RECONSTRUCT_MATCH] = match_cell_ns * cells / matching;
    work_ns[RECONSTRUCT_REFINE] = options->refine ? refine_ns * pixels / threads : 0;
    work_ns[RECONSTRUCT_TRIANGULATE] = triangulate_ns * pixels / threads;
    work_ns[RECONSTRUCT_MESH] = mesh_ns * pixels;
    work_ns[RECONSTRUCT_WORK_WRITE] = write_ns * pixels;
}
