// SPDX-License-Identifier: Apache-2.0
/// From two raw images and a calibration to a surface: develop, rectify, match, refine,
/// triangulate, mesh. All memory comes from the caller's arena, all results point into it.
#ifndef VERGENCE_STEREO_RECONSTRUCT_H
#define VERGENCE_STEREO_RECONSTRUCT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/arena.h"
#include "core/parallel.h"
#include "stereo/geometry/calibration.h"
#include "stereo/geometry/rectify.h"
#include "stereo/geometry/triangulate.h"
#include "stereo/image/image.h"
#include "stereo/image/reason.h"
#include "stereo/match/match.h"
#include "stereo/refine.h"

#ifdef __cplusplus
extern "C" {
#endif

enum pixel_layout {
    PIXEL_GREY,        // 1 value a pixel
    PIXEL_RGB,         // 3 values a pixel, interleaved
    PIXEL_BAYER_GRBG,  // 1 value a pixel, linear, even rows G R, odd rows B G
};

/// One raw image as a reader or a camera delivers it. Never owns its pixels.
struct reconstruct_image {
    const uint16_t *data;
    int width_px, height_px;
    ptrdiff_t stride;  // values from one row to the next
    int bits;          // 8..16: values are 0..2^bits - 1
    enum pixel_layout layout;
};

// X(name, text)
#define RECONSTRUCT_STAGE_LIST(X) \
    X(PLAN, "plan")               \
    X(DEVELOP, "develop")         \
    X(RECTIFY, "rectify")         \
    X(MATCH, "match")             \
    X(REFINE, "refine")           \
    X(TRIANGULATE, "triangulate") \
    X(MESH, "mesh")

enum reconstruct_stage {
#define RECONSTRUCT_STAGE_ENUM(name, text) RECONSTRUCT_##name,
    RECONSTRUCT_STAGE_LIST(RECONSTRUCT_STAGE_ENUM)
#undef RECONSTRUCT_STAGE_ENUM
        RECONSTRUCT_STAGES
};

/// Name of a stage; static storage. `stage` must be one.
const char *reconstruct_stage_text(enum reconstruct_stage stage);

/// What the surroundings provide. Any pointer may be NULL.
struct reconstruct_environment {
    const struct parallel *parallel;
    uint64_t (*now_us)(void *self);  // monotonic; without it all stage times are 0
    /// done out of total units of this stage; returns false to cancel
    bool (*progress)(void *self, enum reconstruct_stage stage, int done, int total);
    void *self;
};

struct reconstruct_options {
    struct rectify_options rectify;
    enum match_preset preset;
    int speckle_px;                       // see match.h
    bool keep_all;                        // see match.h
    bool refine;                          // sub-pixel refinement and predicted sigma
    int32_t max_gap_q8;                   // see mesh.h
    const struct match_kernels *kernels;  // see match.h
};

/// The defaults every user gets.
struct reconstruct_options reconstruct_default_options(void);

/// Everything points into the arena and lives as long as that is not released.
struct reconstruct_result {
    struct rectify_plan plan;
    uint32_t calibration_crc;

    struct image_u8 left, right;    // rectified, grey
    struct image_rgb8 left_colour;  // rectified; grey input gives equal channels
    struct image_rgb8 right_colour;
    struct rectify_span *left_span, *right_span;  // per row

    struct match_output match;
    struct image_u16 sigma_q8;  // predicted sigma of the disparity; 0 where not valid
    struct triangulate_vertical vertical;

    uint32_t vertex_count;
    struct triangulate_point *points;  // left camera frame
    uint32_t *vertex_pixel;            // y * width + x in the rectified left image
    int16_t (*normals_q14)[3];
    uint32_t triangle_count;
    uint32_t (*triangles)[3];

    uint32_t reason_count[REASON_COUNT];  // pixels per reason; a valid match whose point cannot be
                                          // triangulated, or lies outside depths that the options
                                          // state, becomes REASON_OUT_OF_RANGE
    uint32_t repeating_count;  // valid matches on texture that repeats: see match_repeats.h
    uint64_t stage_us[RECONSTRUCT_STAGES];
    size_t match_peak_bytes;  // matching state alone
    size_t arena_peak_bytes;  // everything
};

/// What the matcher is asked for under `plan`: its disparities, and those beyond its ends where
/// something may stand that must not be taken for what was asked for.
struct match_options reconstruct_match_options(const struct rectify_plan *plan,
                                               const struct reconstruct_options *options);

/// Upper bound of the memory `reconstruct_run` needs for raw images of this size under `plan`.
size_t reconstruct_need_bytes(int raw_width_px, int raw_height_px, const struct rectify_plan *plan,
                              const struct reconstruct_options *options, int threads);

/// Runs all stages. `plan` comes from `rectify_plan_make` with the same calibration.
/// ERROR_SIZE_MISMATCH, ERROR_MEMORY, ERROR_CANCELLED, ERROR_NO_SURFACE (the result then holds
/// images, disparities and reasons but no point), and what the stages return.
int reconstruct_run(const struct reconstruct_image *left, const struct reconstruct_image *right,
                    const struct calibration *calibration, const struct rectify_plan *plan,
                    const struct reconstruct_options *options,
                    const struct reconstruct_environment *environment, struct arena *arena,
                    struct reconstruct_result *result);

#ifdef __cplusplus
}
#endif

#endif
