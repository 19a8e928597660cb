// SPDX-License-Identifier: Apache-2.0
/// The head of a compact surface: lines "NAME VALUES" in a fixed order, for everything that a
/// writer of results reads and that is not a pixel. A text that is not there has no line. The list
/// is one; each program makes a table of it for its own record, which has these members.
#ifndef VERGENCE_SURFACE_COMPACT_FIELDS_H
#define VERGENCE_SURFACE_COMPACT_FIELDS_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#include "stereo/image/picture_stats.h"
#include "stereo/reconstruct.h"
#include "stereo/zoom/wide_pair.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { COMPACT_VERSION = 1 };

enum compact_kind {
    COMPACT_FLAG,    // 0 or 1; bool
    COMPACT_INT,     // int, or an enum
    COMPACT_U16,     // uint16_t
    COMPACT_U32,     // uint32_t
    COMPACT_U64,     // uint64_t
    COMPACT_SIZE,    // size_t
    COMPACT_REAL,    // double
    COMPACT_TEXT,    // the rest of the line; const char *
    COMPACT_LETTERS  // the same; char[]
};

struct compact_field {
    const char *name;
    enum compact_kind kind;
    int count;        // values, one after the other in memory
    double min, max;  // of each number, both ends included
    size_t offset;    // in the record
};

/// Bytes from one value of a kind to the next.
extern const size_t compact_kind_bytes[];

enum {
    COMPACT_REPORT_FIGURES =
        (offsetof(struct adjust_report, health) - offsetof(struct adjust_report, rows_before_px)) /
        sizeof(double),
};

#define COMPACT_RANGE(min, max) min, max
#define COMPACT_ANY 0, 0
#define COMPACT_ANY_SIZE -INFINITY, INFINITY
#define COMPACT_ANY_REAL -1e15, 1e15
#define COMPACT_COUNT 0, 1e9
#define COMPACT_LARGE 0, 9e15

// clang-format off
#define COMPACT_REPORT(X, name, member) \
    X(name "_points", INT, 3, COMPACT_COUNT, context.member.corners) \
    X(name "_figures", REAL, COMPACT_REPORT_FIGURES, COMPACT_ANY_SIZE, context.member.rows_before_px) \
    X(name "_health", INT, 1, COMPACT_RANGE(0, ADJUST_CALIBRATE), context.member.health)
#define COMPACT_IMAGE(X, name, side) \
    X(name "_size_px", INT, 2, COMPACT_RANGE(1, 1 << 17), context.side.width_px) \
    X(name "_bits", INT, 1, COMPACT_RANGE(8, 16), context.side.bits) \
    X(name "_layout", INT, 1, COMPACT_RANGE(RAW_GREY, RAW_BAYER_GRBG), context.side.layout)

/// X(name, kind, count, range, member)
#define COMPACT_FIELDS(X) \
    X("version", TEXT, 1, COMPACT_ANY, context.version) \
    X("build", TEXT, 1, COMPACT_ANY, context.build_id) \
    X("left", TEXT, 1, COMPACT_ANY, context.left_path) \
    X("right", TEXT, 1, COMPACT_ANY, context.right_path) \
    COMPACT_IMAGE(X, "left", left) \
    COMPACT_IMAGE(X, "right", right) \
    X("shrunk_by", INT, 1, COMPACT_RANGE(1, 1 << 16), context.shrink) \
    X("left_picture_permille", U16, 4, COMPACT_RANGE(0, 1000), context.picture[0]) \
    X("right_picture_permille", U16, 4, COMPACT_RANGE(0, 1000), context.picture[1]) \
    X("calibration_path", TEXT, 1, COMPACT_ANY, context.calibration_path) \
    X("calibration_format", TEXT, 1, COMPACT_ANY, context.calibration_format) \
    X("calibration_crc", U32, 1, COMPACT_RANGE(0, UINT32_MAX), result.calibration_crc) \
    X("metric", FLAG, 1, COMPACT_RANGE(0, 1), context.metric) \
    X("mismatch", LETTERS, 1, COMPACT_ANY, context.mismatch) \
    X("axes_compared", FLAG, 1, COMPACT_RANGE(0, 1), context.axes_compared) \
    X("self_calibrated", FLAG, 1, COMPACT_RANGE(0, 1), context.self_calibrated) \
    COMPACT_REPORT(X, "self", self_calibration) \
    X("with_pair", U32, 1, COMPACT_COUNT, context.with_pair) \
    X("with_pair_used", FLAG, 1, COMPACT_RANGE(0, 1), context.with_pair_used) \
    X("with_pair_points", INT, 1, COMPACT_COUNT, context.wide_pair.carried) \
    X("with_pair_off_px", REAL, 1, COMPACT_ANY_SIZE, context.wide_pair.carried_px) \
    X("with_pair_turn_rad", REAL, 4, COMPACT_ANY_SIZE, context.wide_pair.turn_rad) \
    X("target_points", INT, 1, COMPACT_COUNT, context.target_points) \
    COMPACT_REPORT(X, "without_target", without_target) \
    X("depth_sigma_common_mm", REAL, 1, COMPACT_ANY_SIZE, context.depth_sigma_common_mm) \
    X("decisions", TEXT, 1, COMPACT_ANY, context.decisions) \
    X("scale", REAL, 1, COMPACT_RANGE(1e-6, 1e6), options.rectify.scale) \
    X("preset", INT, 1, COMPACT_RANGE(0, MATCH_PRESET_COUNT - 1), options.preset) \
    X("speckle_px", INT, 1, COMPACT_COUNT, options.speckle_px) \
    X("keep_all", FLAG, 1, COMPACT_RANGE(0, 1), options.keep_all) \
    X("fill", FLAG, 1, COMPACT_RANGE(0, 1), options.fill) \
    X("refine", FLAG, 1, COMPACT_RANGE(0, 1), options.refine) \
    X("max_gap_q8", INT, 1, COMPACT_COUNT, options.max_gap_q8) \
    X("plan_size_px", INT, 2, COMPACT_RANGE(1, IMAGE_MAX_SIDE_PX), result.plan.width_px) \
    X("plan_focal_px", REAL, 2, COMPACT_RANGE(1e-6, 1e9), result.plan.f_px) \
    X("plan_centre_px", REAL, 3, COMPACT_ANY_REAL, result.plan.cx_left_px) \
    X("plan_baseline_mm", REAL, 1, COMPACT_RANGE(1e-6, 1e9), result.plan.baseline_mm) \
    X("plan_left", REAL, 9, COMPACT_RANGE(-1.000001, 1.000001), result.plan.R_rect_left) \
    X("plan_right", REAL, 9, COMPACT_RANGE(-1.000001, 1.000001), result.plan.R_rect_right) \
    X("plan_depths_mm", REAL, 2, COMPACT_ANY_SIZE, result.plan.depth_near_mm) \
    X("plan_disparities", INT, 2, COMPACT_RANGE(-1e6, 1e6), result.plan.disparity_min) \
    X("plan_identity", FLAG, 1, COMPACT_RANGE(0, 1), result.plan.identity) \
    X("plan_depths_assumed", FLAG, 1, COMPACT_RANGE(0, 1), result.plan.depth_range_assumed) \
    X("rows_offset_px", REAL, 8, COMPACT_ANY_REAL, result.vertical.offset_px) \
    X("rows_samples", INT, 1, COMPACT_COUNT, result.vertical.samples) \
    X("repeating", U32, 1, COMPACT_COUNT, result.repeating_count) \
    X("vertices", U32, 1, COMPACT_COUNT, result.vertex_count) \
    X("triangles", U32, 1, COMPACT_COUNT, result.triangle_count) \
    X("threads", INT, 1, COMPACT_COUNT, context.threads) \
    X("read_us", U64, 1, COMPACT_LARGE, context.read_us) \
    X("total_us", U64, 1, COMPACT_LARGE, context.total_us) \
    X("stages_us", U64, RECONSTRUCT_STAGES, COMPACT_LARGE, result.stage_us) \
    X("stages_bytes", SIZE, RECONSTRUCT_STAGES, COMPACT_LARGE, result.stage_peak_bytes) \
    X("match_bytes", SIZE, 1, COMPACT_LARGE, result.match_peak_bytes) \
    X("arena_bytes", SIZE, 1, COMPACT_LARGE, result.arena_peak_bytes) \
    X("arena_given_bytes", SIZE, 1, COMPACT_LARGE, context.arena_bytes) \
    X("process_bytes", SIZE, 1, COMPACT_LARGE, context.rss_peak_bytes)
// clang-format on

#ifdef __cplusplus
}
#endif

#endif
