// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_summary.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/math.h"
#include "daemon/surface/length_check.h"
#include "daemon/surface/reconstruct_pictures.h"
#include "daemon/surface/result/result_figures.h"

static void print_search(const struct reconstruct_context *context, FILE *stream) {
    const struct rectify_plan *plan = &context->result->plan;
    fprintf(stream, "rectified   %d x %d px, f %.6g px, baseline %.6g mm\n", plan->width_px,
            plan->height_px, plan->f_px, plan->baseline_mm);
    fprintf(stream, "searched    disparities %d to %d px", plan->disparity_min,
            plan->disparity_min + plan->disparity_count - 1);
    if (context->metric) {
        fprintf(stream, ", depths %.6g mm to ", plan->depth_near_mm);
        if (isfinite(plan->depth_far_mm)) {
            fprintf(stream, "%.6g mm", plan->depth_far_mm);
        } else {
            fputs("infinity", stream);
        }
    }
    fprintf(stream, "%s\n", plan->depth_range_assumed ? " (assumed)" : "");
}

static void print_surface(const struct reconstruct_context *context, FILE *stream) {
    const struct reconstruct_result *result = context->result;
    fprintf(stream,
            "surface     %" PRIu32 " points, %" PRIu32 " triangles, %.1f %% of the pixels\n",
            surface_figures_measured_count(result), result->triangle_count,
            result_figures_density_percent(result));
    if (context->options->fill) {
        fprintf(stream, "filled      %" PRIu32 " more points, not measured\n",
                result->reason_count[REASON_FILLED]);
    }
    struct surface_figures_spread spread = {0};
    if (context->metric && result->vertex_count > 0 &&
        reconstruct_context_spread(context, &spread)) {
        fprintf(stream, "depth       %.6g mm (median), %.6g mm to %.6g mm (1 %% to 99 %%)\n",
                spread.depth_mm[1], spread.depth_mm[0], spread.depth_mm[2]);
        if (context->options->refine) {
            fprintf(stream, "sigma       %.3g mm predicted (median), %.3g mm (95 %%)\n",
                    spread.sigma_mm[1], spread.sigma_mm[2]);
        }
    }
    const struct adjust_report *report = &context->self_calibration;
    if (context->self_calibrated) {
        fprintf(stream,
                "cameras     corrected by %d points: rows %.2f px before, %.2f px after; %s\n",
                report->used, report->rows_before_px, report->rows_px,
                adjust_health_text(report->health));
    }
    if (context->with_pair_used) {
        const struct wide_pair_report *wide_pair = &context->wide_pair;
        fprintf(stream, "with pair   pair %u: pan stood still, within %.4f and %.4f degrees\n",
                (unsigned)context->with_pair, wide_pair->turn_sigma_rad[0] * MATH_DEGREE_PER_RAD,
                wide_pair->turn_sigma_rad[1] * MATH_DEGREE_PER_RAD);
    }
    if (context->target_points > 0) {
        fprintf(stream, "known size  %d points: all depths at %.0f mm together %.2g -> %.2g mm\n",
                context->target_points, report->depth_mm, context->without_target.depth.after,
                report->depth.after);
    }
    if (context->depth_sigma_common_mm >= 0) {
        fprintf(stream,
                "depth       common sigma %.3g mm at %.0f mm: all depths together, from "
                "calibration and axes\n",
                context->depth_sigma_common_mm, spread.depth_mm[1]);
    }
    if (result->vertical.samples > 0) {
        fprintf(stream, "rows        off by %.3f px (median), %.3f px (95 %%) in %d samples\n",
                result->vertical.median_px, result->vertical.p95_px, result->vertical.samples);
    }
}

/// "pictures    left 14.3 % bright, 0.0 % saturated, ...".
static void print_pictures(const struct reconstruct_context *context, FILE *stream) {
    for (int side = 0; side < 2; side++) {
        const struct picture_stats *picture = &context->picture[side];
        fprintf(
            stream,
            "%-12s%s: brightness %.1f %%, saturated %.1f %%, black %.1f %%, sharpness %.0f %%\n",
            side == 0 ? "pictures" : "", side == 0 ? "left" : "right",
            picture->brightness_permille / 10.0, picture->saturated_permille / 10.0,
            picture->black_permille / 10.0, picture->sharpness_permille / 10.0);
    }
}

static void print_mesh(const struct reconstruct_context *context, FILE *stream) {
    const struct reconstruct_result *mesh = context->mesh;
    if (mesh == NULL) {
        return;
    }
    fprintf(stream, "mesh        %" PRIu32 " triangles in %s", mesh->triangle_count,
            context->mesh_requested ? "mesh.glb and mesh.ply" : "mesh.glb");
    if (context->metric) {
        fprintf(stream, ", %.3g mm off the points (median), %.3g mm (99 %%)",
                context->mesh_median_mm, context->mesh_p99_mm);
    }
    fputc('\n', stream);
}

void reconstruct_summary_print(const struct reconstruct_context *context, const char *out_path,
                               FILE *stream) {
    for (int line = 0; context->capture.session != NULL && line < CAPTURE_INFO_LINES; line++) {
        char text[CAPTURE_INFO_BYTES];
        capture_info_line(&context->capture, line, text);
        fprintf(stream, "%-12s%s\n", line == 0 ? "capture" : "", text);
    }
    if (context->mismatch.text[0] != '\0') {
        fprintf(stream, "MISMATCH    %s\n", context->mismatch.text);
    }
    print_pictures(context, stream);
    print_search(context, stream);
    print_surface(context, stream);
    print_mesh(context, stream);
    fprintf(stream, "cost        %.2f s, %.0f MB, %d thread%s\n", (double)context->total_us / 1e6,
            (double)context->rss_peak_bytes / 1e6, context->threads,
            context->threads == 1 ? "" : "s");
    fprintf(stream, "results     %s\n", out_path);
}

void reconstruct_summary_no_surface(const struct reconstruct_context *context,
                                    struct message *message) {
    const struct reconstruct_result *result = context->result;
    struct message cause;
    if (reconstruct_pictures_explain(context, &cause)) {
        message_set(message, ERROR_NO_SURFACE, "no surface was found: %s", cause.text);
        return;
    }
    double total = 0;
    int main_reason = REASON_BORDER;
    for (int reason = 0; reason < REASON_COUNT; reason++) {
        total += result->reason_count[reason];
        if (reason != REASON_VALID && reason != REASON_BEYOND &&
            result->reason_count[reason] > result->reason_count[main_reason]) {
            main_reason = reason;
        }
    }
    message_set(message, ERROR_NO_SURFACE,
                "no surface was found: %.0f %% of the pixels are \"%s\"; check that both images "
                "show the same scene, in the order left, right, that the calibration belongs to "
                "them, and that the scene is within the depths or disparities searched (%d to %d "
                "px)",
                total > 0 ? 100.0 * result->reason_count[main_reason] / total : 0.0,
                reason_text(main_reason), result->plan.disparity_min,
                result->plan.disparity_min + result->plan.disparity_count - 1);
}

/// Disparities that the user gave and the matcher could search fail only because they lie beyond
/// infinity.
static void no_disparities(int error, const struct reconstruct_context *context,
                           struct message *message) {
    const struct rectify_options *rectify = &context->options->rectify;
    const struct reconstruct_caller *caller = context->caller;
    const int first_px = rectify->disparity_min, count = rectify->disparity_count;
    if (count > 0 && count <= MATCH_MAX_DISPARITIES && first_px >= -MATCH_DISPARITY_LIMIT &&
        first_px <= MATCH_DISPARITY_LIMIT - count) {
        message_set(message, error,
                    "disparities %d to %d px are beyond infinity: raise --disparity, or swap left "
                    "and right",
                    first_px, first_px + count - 1);
    } else {
        message_set(message, error,
                    "the search needs disparities outside of %d to %d px, or more than %d of them: "
                    "narrow it with %s, or make the images smaller with %s",
                    -MATCH_DISPARITY_LIMIT, MATCH_DISPARITY_LIMIT, MATCH_MAX_DISPARITIES,
                    caller->search, caller->scale);
    }
}

void reconstruct_summary_no_plan(int error, const struct reconstruct_context *context,
                                 struct message *message) {
    const struct calibration *calibration = context->calibration;
    const struct rectify_options *rectify = &context->options->rectify;
    const struct reconstruct_caller *caller = context->caller;
    switch (error) {
        case ERROR_DEPTH_RANGE:
            message_set(
                message, error, "the depth range %.6g:%.6g mm is empty: give %s",
                rectify->depth_near_mm > 0 ? rectify->depth_near_mm : calibration->depth_near_mm,
                rectify->depth_near_mm > 0 ? rectify->depth_far_mm : calibration->depth_far_mm,
                caller->depth);
            break;
        case ERROR_DISPARITY_RANGE:
            no_disparities(error, context, message);
            break;
        case ERROR_OVERLAP:
            if (length_check_in_line(calibration, message)) {
                break;
            }
            message_set(message, error,
                        "the two cameras share no field of view in the depths searched: check %s, "
                        "and the order of left and right",
                        caller->depth);
            break;
        case ERROR_TOO_LARGE:
            message_set(message, error,
                        "the rectified images would exceed the maximum of %dx%d pixels: give a %s "
                        "below %.3g",
                        IMAGE_MAX_SIDE_PX, IMAGE_MAX_SIDE_PX, caller->scale,
                        // In the user's terms: the reader may have done part of the shrinking.
                        rectify->scale / context->shrink);
            break;
        case ERROR_TOO_SMALL:
            message_set(message, error,
                        "the images are too small for matching: at least %dx%d rectified pixels "
                        "are required",
                        MATCH_MIN_WIDTH_PX, MATCH_MIN_HEIGHT_PX);
            break;
        case ERROR_ARGUMENT:
            if (rectify->region_width_px > 0) {
                message_set(message, error, "--region is outside the rectified image");
                break;
            }
            // fall through
        default:
            message_set(message, error, "the pair cannot be rectified: %s", error_text(error));
    }
}
