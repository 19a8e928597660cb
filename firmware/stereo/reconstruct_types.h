// SPDX-License-Identifier: Apache-2.0
/// The types of reconstruct.h.
#ifndef VERGENCE_STEREO_RECONSTRUCT_TYPES_H
#define VERGENCE_STEREO_RECONSTRUCT_TYPES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/arena.h"
#include "core/parallel.h"
#include "core/raw_image.h"
#include "stereo/geometry/calibration.h"
#include "stereo/geometry/rectify.h"
#include "stereo/geometry/triangulate.h"
#include "stereo/image/image.h"
#include "stereo/image/reason.h"
#include "stereo/match/match.h"
#include "stereo/subpixel.h"

#ifdef __cplusplus
extern "C" {
#endif

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

/// Callbacks provided by the caller. Any pointer may be NULL.
struct reconstruct_environment {
    const struct parallel *parallel;
    uint64_t (*now_us)(void *self);  // monotonic; without it all stage times are 0
    /// Called with the work done, out of the total of this stage; returns false to cancel.
    bool (*progress)(void *self, enum reconstruct_stage stage, int done, int total);
    void *self;
    struct watch watch;  // of walks over the rows of a surface, also after the run
};

struct reconstruct_options {
    struct rectify_options rectify;
    enum match_preset preset;
    int speckle_px;          // see match.h
    bool keep_all;           // see match.h
    bool fill;               // give rejected pixels the surface around: see fill.h
    bool refine;             // sub-pixel refinement and predicted sigma
    bool skip_rows;          // do not measure the residual of the rows
    int32_t max_gap_q8;      // see mesh.h
    bool recompute_surface;  // keep no points and triangles: see surface.h
    bool remake_pictures;    // keep rows of the pictures only, and make them again for each stage
                             // that reads them; not together with `fill`, which reads all
    const struct match_kernels *kernels;  // see match.h
};

/// Points into the arena, and is valid until that is released.
struct reconstruct_result {
    struct rectify_plan plan;
    uint32_t calibration_crc;

    struct pictures *pictures;    // makes rows of the pictures again: reconstruct_colour_row. NULL:
                                  // all are there; else the other pictures have no data
    struct image_u8 left, right;  // rectified, grey
    struct image_rgb8 left_colour;                // rectified; grey input gives equal channels
    struct image_rgb8 right_colour;               // the same
    struct rectify_span *left_span, *right_span;  // valid columns of each row

    struct match_output match;
    struct image_u8 sigma;  // of the disparity, predicted, as subpixel_sigma_code; 0: not valid
    struct triangulate_vertical vertical;

    int32_t max_gap_q8;  // largest disparity step within a triangle
    struct watch watch;  // of the environment
    void *walk_memory;   // memory of surface_walk; NULL: the surface is kept, below
    uint32_t vertex_count;
    struct triangulate_point *points;  // positions in the left camera's frame
    uint32_t *vertex_pixel;            // y * width + x in the rectified left image
    int16_t (*normals_q14)[3];
    uint32_t triangle_count;
    uint32_t (*triangles)[3];

    uint32_t reason_count[REASON_COUNT];  // number of pixels per reason; a match whose point cannot
                                          // be triangulated, or lies outside the depths of the
                                          // options, becomes REASON_OUT_OF_RANGE or REASON_BEYOND
    uint32_t repeating_count;  // valid matches on repetitive texture: see match_count_repeats
    uint64_t stage_us[RECONSTRUCT_STAGES];
    size_t stage_peak_bytes[RECONSTRUCT_STAGES];  // peak of the arena; 0: the stage did not run
    size_t match_peak_bytes;                      // peak of the matcher alone
    size_t arena_peak_bytes;                      // peak of the whole reconstruction
};

#ifdef __cplusplus
}
#endif

#endif
