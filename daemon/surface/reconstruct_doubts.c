// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_doubts.h"

#include "daemon/surface/reconstruct_pictures.h"
#include "daemon/surface/result/result_figures.h"

/// A pair with a matching calibration exceeds this unless the scene is a blank wall; a pair whose
/// rows are some pixels apart does not.
static const double sparse_percent = 25;

/// Recorded pairs have up to 6 % of such texture, a chessboard in view 10 to 20, a fence 30.
static const double repeating_max_percent = 10;

/// Single mismatches are not worth a note.
static const double beyond_noted_percent = 0.5;

static void note_beyond(struct reconstruct_context *context) {
    const struct reconstruct_result *result = context->result;
    const double pixels = (double)result->plan.width_px * result->plan.height_px;
    const double percent = 100.0 * result->reason_count[REASON_BEYOND] / pixels;
    if (percent >= beyond_noted_percent) {
        reconstruct_context_warn(
            context,
            "%.1f %% of the pixels have disparities beyond infinity (0 or less): they are in the "
            "maps, without a depth; a calibration says where infinity is",
            percent);
    }
}

void reconstruct_doubts_record(struct reconstruct_context *context) {
    const struct reconstruct_result *result = context->result;
    const double density_percent = result_figures_density_percent(result);
    struct message cause;
    if (reconstruct_pictures_explain(context, &cause)) {
        reconstruct_context_warn(context, "only %.0f %% of the pixels could be measured: %s",
                                 density_percent, cause.text);
    } else if (density_percent < sparse_percent) {
        reconstruct_context_warn(
            context,
            "only %.0f %% of the pixels could be measured: check that the calibration belongs to "
            "these images, and that the scene is within the search",
            density_percent);
    }
    note_beyond(context);
    const uint32_t points = surface_figures_measured_count(result);
    const double repeating_percent = points > 0 ? 100.0 * result->repeating_count / points : 0;
    if (repeating_percent > repeating_max_percent) {
        reconstruct_context_warn(context,
                                 "%.0f %% of the points lie on repeating texture: they may all be "
                                 "off by one period; a narrower search (%s) leaves fewer periods",
                                 repeating_percent < 100 ? repeating_percent : 100,
                                 context->caller->search);
    }
    const struct triangulate_vertical *vertical = &result->vertical;
    const double scale = context->options->rectify.scale;
    if (vertical->samples == 0) {
        reconstruct_context_warn(context,
                                 "too few textured matches to check that the rows of the rectified "
                                 "images correspond");
    }
    const char *fault = result_figures_rows_fault(vertical, &result->plan, scale);
    if (fault != NULL) {
        reconstruct_context_warn(context,
                                 "the rows of the rectified images are %.2f px apart (median; 95 "
                                 "%%: %.2f px): the calibration does not fit these images: %s",
                                 vertical->median_px, vertical->p95_px, fault);
    }
}
