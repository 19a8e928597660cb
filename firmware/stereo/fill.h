// SPDX-License-Identifier: Apache-2.0
/// A plausible surface where nothing could be measured: continues the planes around.
#ifndef VERGENCE_STEREO_FILL_H
#define VERGENCE_STEREO_FILL_H

#include "core/arena.h"
#include "core/parallel.h"
#include "stereo/match/match.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    FILL_REACH_PX =
        64,             // a pixel without valid matches that near, in eight directions, stays empty
    FILL_TILE_PX = 16,  // the surface around is described by a plane for each such tile
};

/// What is filled. `colour` and `sigma` have the size of the match.
struct fill_input {
    const struct image_rgb8 *colour;       // the rectified left image
    const struct rectify_span *left_span;  // valid columns of each row; NULL: all
    struct image_u8 *sigma;                // scratch where not valid; 0 there before and afterwards
};

/// Working memory of `fill_run` in bytes: 16 for each tile.
size_t fill_need_bytes(int width, int height);

/// Gives rejected pixels of the left image, but for the border, the disparity of the most plausible
/// surface around, and REASON_FILLED. Of several surfaces it is the farthest, unless the pixel lies
/// within a nearer one, or only a nearer one is reached without crossing an edge of the image.
/// Valid pixels do not change, and the result does not depend on `parallel`. ERROR_MEMORY; nothing
/// is changed then.
int fill_run(const struct fill_input *input, const struct parallel *parallel, struct arena *arena,
             struct match_output *output);

#ifdef __cplusplus
}
#endif

#endif
