// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_adjust.h"

#include <math.h>
#include <stdlib.h>

#include "core/error.h"
#include "core/math.h"

int reconstruct_adjust(const struct zoom_calibration *zoom, const struct pair *const *pairs,
                       const struct zoom_state *states, int count,
                       const struct pair_adjust_scene *scene, struct calibration *calibration,
                       struct reconstruct_context *context, struct message *message) {
    const size_t bytes = pair_adjust_need_bytes(pairs, count, scene->target);
    void *memory = malloc(bytes);
    struct arena arena;
    struct pair_adjust_report report;
    arena_init(&arena, memory, memory == NULL ? 0 : bytes);
    const int error =
        pair_adjust(zoom, pairs, states, count, scene, &arena, calibration, &report, message);
    free(memory);
    context->self_calibration = report.self_calibration;
    context->with_pair = report.with_pair;
    context->with_pair_used = report.with_pair_used;
    context->wide_pair = report.wide_pair;
    context->target_points = report.target_points;
    context->without_target = report.without_target;
    return error;
}

/// Whether the known size moved the pair's own matches away from their epipolar lines, or the
/// cameras away from where their pictures alone have them.
static bool target_disagrees(const struct reconstruct_context *context) {
    static const double rows_factor = 2, rows_more_px = 0.05;
    const struct adjust_report *without = &context->without_target,
                               *with = &context->self_calibration;
    return context->target_points > 0 && without->used > 0 &&
           (with->rows_px > rows_factor * without->rows_px + rows_more_px ||
            (with->health == ADJUST_CALIBRATE && without->health != ADJUST_CALIBRATE));
}

/// Warns of a second pair that could not be used.
static void doubt_wide_pair(struct reconstruct_context *context) {
    const struct wide_pair_report *wide_pair = &context->wide_pair;
    if (wide_pair->carried == 0) {
        reconstruct_context_warn(context,
                                 "pair %u cannot help this one: their pictures cannot be "
                                 "compared (the same scene is needed, zoomed by 1.3 or more)",
                                 (unsigned)context->with_pair);
        return;
    }
    const int side = fabs(wide_pair->turn_rad[1] / wide_pair->turn_sigma_rad[1]) >
                     fabs(wide_pair->turn_rad[0] / wide_pair->turn_sigma_rad[0]);
    reconstruct_context_warn(context,
                             "the %s camera turned by %.3f degrees between this pair and pair %u, "
                             "which does not help: take it again with pan untouched",
                             rig_side_names[side],
                             fabs(wide_pair->turn_rad[side]) * MATH_DEGREE_PER_RAD,
                             (unsigned)context->with_pair);
}

void reconstruct_adjust_doubt(struct reconstruct_context *context) {
    const struct adjust_report *report = &context->self_calibration;
    if (context->with_pair > 0 && !context->with_pair_used) {
        doubt_wide_pair(context);
    }
    if (target_disagrees(context)) {
        reconstruct_context_warn(context,
                                 "the known size does not fit what the pictures show of the "
                                 "cameras (%.1f standard deviations, rows %.2f px apart, without "
                                 "it %.2f px): check it, or calibrate again",
                                 report->chi_square_score, report->rows_px,
                                 context->without_target.rows_px);
    } else if (adjust_pair_is_lost(report)) {
        reconstruct_context_warn(context,
                                 "of %d distinct points only %d match: the cameras are not where "
                                 "the calibration expects them (calibrate again), or show "
                                 "different things; all depths share a deviation of %.3g mm at "
                                 "%.0f mm at least",
                                 report->corners, report->matches, report->depth.after,
                                 report->depth_mm);
    } else if (report->used == 0) {
        reconstruct_context_warn(
            context,
            "only %d points of the pair match: the cameras are taken to be "
            "where the motors read, and all depths share a deviation of %.3g "
            "mm at %.0f mm (more texture, or \"vergence calibrate --touch-up\")",
            report->matches, report->depth.after, report->depth_mm);
    } else if (report->health == ADJUST_CALIBRATE) {
        reconstruct_context_warn(context,
                                 "the cameras are not where the calibration expects them (%.1f "
                                 "standard deviations, rows %.2f px apart): calibrate again",
                                 report->chi_square_score, report->rows_px);
    }
}
