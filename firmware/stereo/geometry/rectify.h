// SPDX-License-Identifier: Apache-2.0
/// Rectification: rotates both cameras' images into a common orientation whose rows are
/// epipolar lines. Set-up (double): `rectify_plan_make` chooses the frames, `rectify_table_make`
/// samples raw coordinates on a coarse grid. Per row (integer): coordinates by cubic
/// interpolation of the grid in fixed point, pixels by bilinear interpolation.
///
/// Rectified frame ("rect"): x along the baseline, z forward. A point p of the rect frame
/// (origin: left camera) is seen at x = cx_left + f x/z, y = cy + f_y y/z in the left rectified
/// image and at x = cx_right + f (x - baseline)/z in the right one, so that
///     depth_rect_mm = f baseline / (d - (cx_left - cx_right)),  d = x_left - x_right.
#ifndef VERGENCE_STEREO_GEOMETRY_RECTIFY_H
#define VERGENCE_STEREO_GEOMETRY_RECTIFY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/arena.h"
#include "stereo/geometry/calibration.h"
#include "stereo/image/image.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Limit of the matcher: a plan never exceeds it.
enum {
    MATCH_MIN_WIDTH_PX = 16,
    MATCH_MIN_HEIGHT_PX = 8,
    MATCH_MAX_DISPARITIES = 1024,
    MATCH_DISPARITY_LIMIT = 1024,  // |disparity_min| and disparity_min + count stay within
};

/// A stated disparity range refers to the full image; it changes the search, not the frames. A
/// region crops the left image; the right crop is placed, by whole pixels, where the region's
/// matches are, and `disparity_min` of the plan is adjusted.
struct rectify_options {
    double depth_near_mm, depth_far_mm;  // working range of left z, far may be INFINITY; 0 0: that
                                         // of the calibration, else a default
    double scale;                        // 1 keeps the raw resolution; (0, 4]
    int region_x_px, region_y_px;        // sub-window of the rectified image (after scaling);
    int region_width_px, region_height_px;  // width 0: whole image
    int disparity_min;                      // first disparity, if disparity_count > 0
    int disparity_count;                    // > 0: overrides the disparities of the depth range
    bool allow_beyond;  // disparities beyond infinity are kept, without a depth: of a pair whose
                        // infinity is assumed to be at 0
};

/// Depth range if none is stated: around the vergence depth for a verged pair, else disparities up
/// to a quarter of the width. Both ends are in the plan.
struct rectify_plan {
    int width_px, height_px;  // size of both rectified images
    double f_px, fy_px;       // equal unless the input was rectified with fx != fy
    double cx_left_px, cx_right_px, cy_px;
    double baseline_mm;                  // > 0
    double R_rect_left[9];               // left camera frame -> rect frame
    double R_rect_right[9];              // right camera frame -> rect frame
    double depth_near_mm, depth_far_mm;  // rect depths that the search covers; may be INFINITY
    int disparity_min, disparity_count;  // the disparities to search
    bool identity;                       // images are copied pixel by pixel
    bool depth_range_assumed;            // no depth range was stated
};

/// Chooses the rectified frames for a valid calibration: the shared field of view over the depth
/// range fills the image, and the disparities cover the depth range. The focal length keeps the raw
/// resolution at the centre of the shared view (times scale). Errors: ERROR_DEPTH_RANGE,
/// ERROR_DISPARITY_RANGE (more than MATCH_MAX_DISPARITIES), ERROR_OVERLAP, ERROR_TOO_LARGE
/// (rectified or raw images), ERROR_TOO_SMALL, ERROR_ARGUMENT (scale, region). Verged pairs may
/// give negative disparities. The x axis always points from the left to the right camera's centre:
/// if one camera is above the other, the rectified images are turned by 90 degrees, if the cameras
/// are swapped, by 180; points are always in the left camera's frame.
int rectify_plan_make(const struct calibration *calibration, const struct rectify_options *options,
                      struct rectify_plan *plan);

enum rectify_side { RECTIFY_LEFT, RECTIFY_RIGHT };

/// Half-open range of columns [begin, end) of a row whose pixels are inside the raw image and
/// inside the lens' view (`lens_view_radius`).
struct rectify_span {  // 0 0 if it is empty
    int16_t begin, end;
};

/// Raw coordinates on a coarse grid over a rectified image, in 1/65536 px.
struct rectify_table {
    int32_t *x_q16, *y_q16;  // nodes, row-major, in the arena of the table
    int columns, rows;       // node counts; node (i, j) is at ((i - 1) step, (j - 1) step)
    int step_log2;
    // Columns of each row within the lens' view, independent of the raw coordinates; in the same
    // arena. NULL: all.
    struct rectify_span *view;
    int width_px, height_px;  // size of the rectified image
    int raw_width_px, raw_height_px;
    bool identity;                 // no nodes: rectified (x, y) is raw (x, y) + offset
    int offset_x_px, offset_y_px;  // offset for a region of an identity; else 0
};

/// Allocates the nodes from `arena`. ERROR_MEMORY; ERROR_DISTORTION if a node cannot be computed.
int rectify_table_make(const struct rectify_plan *plan, const struct calibration *calibration,
                       enum rectify_side side, struct arena *arena, struct rectify_table *table);
size_t rectify_table_need_bytes(const struct rectify_plan *plan);

/// Rows of the raw image that any `rows` neighbouring rows of the rectified one come from, at most,
/// give or take one: for its memory.
int rectify_rows_needed(const struct rectify_plan *plan, const struct calibration *calibration,
                        enum rectify_side side, int rows);

/// Raw coordinates of rectified row y, 0 <= y < height, into `x_q16` and `y_q16` (width_px values
/// each). Outside the table's `view` they are meaningless.
void rectify_row_coordinates(const struct rectify_table *table, int y, int32_t *x_q16,
                             int32_t *y_q16);

/// Rows [begin, end) of a raw image; row 0 of its images is row `begin`.
struct rectify_strip {
    int begin, end;
    struct image_u8 grey;
    struct image_rgb8 colour;
};

/// Where a rectified row comes from: its columns, and the raw rows that they need, first to last.
struct rectify_extent {
    struct rectify_span span;
    int16_t first, last;  // 0 -1: none
};

/// `work_q16` needs 2 * width_px values, here and below.
struct rectify_extent rectify_row_extent(const struct rectify_table *table, int y,
                                         int32_t *work_q16);

/// Fills the pixels of row y (width_px each) that the strip has all raw rows for; others stay. A
/// row is whole, within its span, after strips that cover the raw image, each of which begins with
/// the last row of the one before. `colour` NULL: grey only.
void rectify_row_strip(const struct rectify_table *table, const struct rectify_strip *strip,
                       const struct rectify_extent *extent, int y, uint8_t *grey, uint8_t *colour,
                       int32_t *work_q16);

#ifdef __cplusplus
}
#endif

#endif
