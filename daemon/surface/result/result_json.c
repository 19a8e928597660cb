// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/result/result_json.h"

#include <inttypes.h>
#include <string.h>

#include "core/math.h"
#include "daemon/base/json.h"
#include "daemon/surface/result/result_figures.h"

/// Version of result.json: incremented if a member changes its meaning or is removed.
enum { RESULT_JSON_VERSION = 2, KEY_BYTES = 48 };

/// Converts a text up to the first colon to a JSON key: "no texture: ..." gives "no_texture".
static void make_key(const char *text, char key[KEY_BYTES]) {
    size_t length = strcspn(text, ":");
    length = length < KEY_BYTES - 1 ? length : KEY_BYTES - 1;
    for (size_t i = 0; i < length; i++) {
        key[i] = text[i] == ' ' ? '_' : text[i];
    }
    key[length] = '\0';
}

static void print_inputs(const struct reconstruct_context *context, struct json *json) {
    static const char *const layouts[] = {"grey", "rgb", "bayer_grbg"};
    json_open_object(json, "input");
    json_text(json, "left", context->left_path);
    json_text(json, "right", context->right_path);
    json_integer(json, "width_px", context->left.width_px);
    json_integer(json, "height_px", context->left.height_px);
    json_integer(json, "bits", context->left.bits);
    json_text(json, "layout", layouts[context->left.layout]);
    json_integer(json, "shrunk_by", context->shrink);
    json_close_object(json);
}

/// In percent, as elsewhere.
static void print_pictures(const struct reconstruct_context *context, struct json *json) {
    json_open_object(json, "pictures");
    for (int side = 0; side < 2; side++) {
        const struct picture_stats *picture = &context->picture[side];
        json_open_object(json, side == 0 ? "left" : "right");
        json_real(json, "brightness_percent", picture->brightness_permille / 10.0, 6);
        json_real(json, "saturated_percent", picture->saturated_permille / 10.0, 6);
        json_real(json, "black_percent", picture->black_permille / 10.0, 6);
        json_real(json, "sharpness_percent", picture->sharpness_permille / 10.0, 6);
        json_close_object(json);
    }
    json_close_object(json);
}

static void print_calibration(const struct reconstruct_context *context, struct json *json) {
    const struct calibration *calibration = context->calibration;
    const char *mismatch = context->mismatch.text[0] != '\0' ? context->mismatch.text : NULL;
    const char *match = context->axes_compared ? "yes" : "not known";
    char crc[16], text[CALIBRATION_TEXT_MAX_BYTES];
    snprintf(crc, sizeof crc, "%08" PRIx32, context->result->calibration_crc);
    json_open_object(json, "calibration");
    json_text(json, "path", context->calibration_path);
    json_text(json, "format", context->calibration_format);
    json_text(json, "id", calibration->id);
    json_text(json, "crc32", crc);
    json_text(json, "date", calibration->date[0] != '\0' ? calibration->date : NULL);
    json_text(json, "note", calibration->note);
    json_bool(json, "rectified", calibration->rectified);
    json_real(json, "baseline_mm", calibration_baseline_mm(calibration), 10);
    json_text(json, "match", mismatch != NULL ? "no, accepted" : match);
    json_text(json, "mismatch", mismatch);
    // In use: of the pair's own zoom, corrected, of the window.
    const bool printed = calibration_print(calibration, text, sizeof text) > 0;
    json_text(json, "text", printed ? text : NULL);
    json_close_object(json);
}

static void print_plan(const struct reconstruct_context *context, struct json *json) {
    const struct rectify_plan *plan = &context->result->plan;
    json_open_object(json, "plan");
    json_integer(json, "width_px", plan->width_px);
    json_integer(json, "height_px", plan->height_px);
    json_real(json, "f_px", plan->f_px, 15);
    json_real(json, "fy_px", plan->fy_px, 15);
    json_real(json, "cx_left_px", plan->cx_left_px, 15);
    json_real(json, "cx_right_px", plan->cx_right_px, 15);
    json_real(json, "cy_px", plan->cy_px, 15);
    json_real(json, "baseline_mm", plan->baseline_mm, 15);
    json_reals(json, "R_rect_left", plan->R_rect_left, 9, 15);
    json_reals(json, "R_rect_right", plan->R_rect_right, 9, 15);
    json_integer(json, "disparity_min", plan->disparity_min);
    json_integer(json, "disparity_count", plan->disparity_count);
    json_real(json, "depth_near_mm", plan->depth_near_mm, 10);
    json_real(json, "depth_far_mm", plan->depth_far_mm, 10);
    json_bool(json, "identity", plan->identity);
    json_bool(json, "depth_range_assumed", plan->depth_range_assumed);
    json_close_object(json);
}

static void print_options(const struct reconstruct_context *context, struct json *json) {
    const struct reconstruct_options *options = context->options;
    json_open_object(json, "options");
    json_real(json, "scale", options->rectify.scale, 10);
    json_text(json, "preset", match_preset_name(options->preset));
    json_integer(json, "speckle_px", options->speckle_px);
    json_bool(json, "keep_all", options->keep_all);
    json_bool(json, "fill", options->fill);
    json_bool(json, "refine", options->refine);
    json_real(json, "max_gap_px", options->max_gap_q8 / 256.0, 10);
    json_integer(json, "threads", context->threads);
    json_close_object(json);
}

static void print_counts(const struct reconstruct_context *context, struct json *json) {
    const struct reconstruct_result *result = context->result;
    json_open_object(json, "counts");
    json_integer(json, "pixels", (int64_t)result->plan.width_px * result->plan.height_px);
    json_integer(json, "vertices", result->vertex_count);
    json_integer(json, "filled", result->reason_count[REASON_FILLED]);
    json_integer(json, "triangles", result->triangle_count);
    json_integer(json, "repeating", result->repeating_count);
    json_close_object(json);
    json_real(json, "density_percent", result_figures_density_percent(result), 6);
    json_open_object(json, "reasons");
    for (int reason = 0; reason < REASON_COUNT; reason++) {
        char key[KEY_BYTES];
        make_key(reason_text(reason), key);
        json_integer(json, key, result->reason_count[reason]);
    }
    json_close_object(json);
}

static void print_mesh(const struct reconstruct_context *context, struct json *json) {
    const struct reconstruct_result *mesh = context->mesh;
    if (mesh == NULL) {
        json_null(json, "mesh");
        return;
    }
    json_open_object(json, "mesh");
    json_integer(json, "vertices", mesh->vertex_count);
    json_integer(json, "triangles", mesh->triangle_count);
    json_bool(json, "requested", context->mesh_requested);
    json_open_object(json, "distance_mm");
    json_real(json, "median", context->mesh_median_mm, 4);
    json_real(json, "p99", context->mesh_p99_mm, 4);
    json_real(json, "max", context->mesh_max_mm, 4);
    json_close_object(json);
    json_integer(json, "uncovered", context->mesh_uncovered);
    json_close_object(json);
}

static void print_vertical(const struct reconstruct_context *context, struct json *json) {
    const struct triangulate_vertical *vertical = &context->result->vertical;
    if (vertical->samples == 0) {
        json_null(json, "vertical_disparity");
        return;
    }
    json_open_object(json, "vertical_disparity");
    json_integer(json, "samples", vertical->samples);
    json_real(json, "median_px", vertical->median_px, 6);
    json_real(json, "p95_px", vertical->p95_px, 6);
    json_real(json, "trend_px", vertical->trend_px, 6);
    json_real(json, "curve_px", vertical->curve_px, 6);
    json_real(json, "rms_px", vertical->rms_px, 6);
    json_real(json, "offset_px", vertical->offset_px, 6);
    json_real(json, "slope_x", vertical->slope_x, 6);
    json_real(json, "slope_y", vertical->slope_y, 6);
    json_close_object(json);
}

static void print_self_calibration(const struct reconstruct_context *context, struct json *json) {
    const struct adjust_report *report = &context->self_calibration;
    if (!context->self_calibrated) {
        json_null(json, "self_calibration");
        return;
    }
    json_open_object(json, "self_calibration");
    json_integer(json, "matches", report->matches);
    json_integer(json, "used", report->used);
    json_real(json, "rows_before_px", report->rows_before_px, 6);
    json_real(json, "rows_px", report->rows_px, 6);
    json_real(json, "noise_px", report->noise_px, 6);
    json_real(json, "depth_mm", report->depth_mm, 6);
    json_real(json, "depth_sigma_before_mm", report->depth.before, 6);
    json_real(json, "depth_sigma_mm", report->depth.after, 6);
    json_real(json, "focal_sigma", report->focal.after, 6);
    json_real(json, "ratio_sigma", report->ratio.after, 6);
    json_real(json, "vergence_sigma_deg", report->vergence_rad.after * MATH_DEGREE_PER_RAD, 6);
    json_real(json, "surprise", report->chi_square_score, 6);
    json_text(json, "health", adjust_health_text(report->health));
    if (context->target_points == 0) {
        json_null(json, "known_size");
    } else {
        json_open_object(json, "known_size");
        json_integer(json, "points", context->target_points);
        json_real(json, "depth_sigma_without_mm", context->without_target.depth.after, 6);
        json_close_object(json);
    }
    if (context->with_pair == 0) {
        json_null(json, "with_pair");
    } else {
        const struct wide_pair_report *wide_pair = &context->wide_pair;
        json_open_object(json, "with_pair");
        json_integer(json, "pair", context->with_pair);
        json_bool(json, "used", context->with_pair_used);
        json_integer(json, "points", wide_pair->carried);
        json_real(json, "off_px", wide_pair->carried_px, 6);
        double turn_deg[2], sigma_deg[2];
        for (int side = 0; side < 2; side++) {
            turn_deg[side] = wide_pair->turn_rad[side] * MATH_DEGREE_PER_RAD;
            sigma_deg[side] = wide_pair->turn_sigma_rad[side] * MATH_DEGREE_PER_RAD;
        }
        json_reals(json, "turn_deg", turn_deg, 2, 6);
        json_reals(json, "turn_sigma_deg", sigma_deg, 2, 6);
        json_close_object(json);
    }
    json_close_object(json);
}

static void print_surface(const struct reconstruct_context *context, struct json *json) {
    const struct reconstruct_result *result = context->result;
    json_bool(json, "metric", context->metric);
    if (result->vertex_count == 0) {
        json_null(json, "bounds_mm");
        return;
    }
    const struct result_figures_box bounds = result_figures_bounds(result);
    json_open_object(json, "bounds_mm");
    json_reals(json, "min", bounds.min_mm, 3, 9);
    json_reals(json, "max", bounds.greatest_mm, 3, 9);
    json_close_object(json);
    struct surface_figures_spread spread;
    if (!reconstruct_context_spread(context, &spread)) {
        return;
    }
    json_open_object(json, "depth_mm");
    json_real(json, "p1", spread.depth_mm[0], 9);
    json_real(json, "median", spread.depth_mm[1], 9);
    json_real(json, "p99", spread.depth_mm[2], 9);
    json_close_object(json);
    const double common_mm = context->depth_sigma_common_mm;
    if (common_mm >= 0) {
        json_real(json, "depth_sigma_common_mm", common_mm, 6);
    } else {
        json_null(json, "depth_sigma_common_mm");
    }
    if (context->options->refine) {
        json_open_object(json, "sigma_mm");
        json_real(json, "p5", spread.sigma_mm[0], 6);
        json_real(json, "median", spread.sigma_mm[1], 6);
        json_real(json, "p95", spread.sigma_mm[2], 6);
        json_close_object(json);
    }
}

static void print_cost(const struct reconstruct_context *context, struct json *json) {
    const struct reconstruct_result *result = context->result;
    json_open_object(json, "time_ms");
    json_real(json, "read", (double)context->read_us / 1000.0, 6);
    for (int stage = 0; stage < RECONSTRUCT_STAGES; stage++) {
        json_real(json, reconstruct_stage_text((enum reconstruct_stage)stage),
                  (double)result->stage_us[stage] / 1000.0, 6);
    }
    json_real(json, "total", (double)context->total_us / 1000.0, 6);
    json_close_object(json);
    json_open_object(json, "memory_bytes");
    json_integer(json, "matching_state", (int64_t)result->match_peak_bytes);
    json_integer(json, "arena_peak", (int64_t)result->arena_peak_bytes);
    json_integer(json, "arena", (int64_t)context->arena_bytes);
    json_integer(json, "process_peak", (int64_t)context->rss_peak_bytes);
    json_close_object(json);
}

void result_json_print(const struct reconstruct_context *context, FILE *stream) {
    struct json json;
    json_begin(&json, stream);
    json_open_object(&json, NULL);
    json_text(&json, "program", "vergence");
    json_integer(&json, "format_version", RESULT_JSON_VERSION);
    json_text(&json, "version", context->version);
    json_text(&json, "build_id", context->build_id);
    print_inputs(context, &json);
    capture_info_json(&context->capture, &json);
    print_pictures(context, &json);
    print_calibration(context, &json);
    print_plan(context, &json);
    print_options(context, &json);
    print_counts(context, &json);
    print_mesh(context, &json);
    print_vertical(context, &json);
    print_self_calibration(context, &json);
    print_surface(context, &json);
    print_cost(context, &json);
    json_open_array(&json, "warnings");
    for (int i = 0; i < context->warning_count; i++) {
        json_text(&json, NULL, context->warnings[i].text);
    }
    json_close_array(&json);
    json_close_object(&json);
    json_end(&json);
}
