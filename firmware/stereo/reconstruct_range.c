// SPDX-License-Identifier: Apache-2.0
#include "stereo/reconstruct.h"

static int smaller(int a, int b) {
    return a < b ? a : b;
}

// An object in front of or behind the requested range has its best match outside of it, and would
// get the next best match inside. So the search extends to infinity, and to half the nearest depth;
// near a coarser surface this costs little.
static void search_beyond(const struct rectify_plan *plan, struct match_options *match) {
    enum {
        BEYOND_INFINITY = 4,  // keeps objects at infinity away from the end of the search
        STEP = 16,            // disparities are processed in vectors of this many
    };
    // No pixel has a partner farther away than the width.
    const double width = plan->width_px;
    const double infinity_px = plan->cx_left_px - plan->cx_right_px;
    const int first = plan->disparity_min;
    const int last = first + plan->disparity_count - 1;
    if (first > infinity_px && first > -width) {
        const double lowest_px = (infinity_px > -width ? infinity_px : -width) - BEYOND_INFINITY;
        match->extra_below = first - (int)(lowest_px - 1);
    }
    const double nearest_px = last + (last - infinity_px);
    if (last < width && last > infinity_px) {
        match->extra_above = (int)(nearest_px < width ? nearest_px : width) - last;
    }
    // Rounds to whole vectors, within the searchable range.
    const int room = MATCH_MAX_DISPARITIES - plan->disparity_count;
    match->extra_below = smaller(match->extra_below, smaller(room, first + MATCH_DISPARITY_LIMIT));
    const int count = match->extra_below + plan->disparity_count;
    match->extra_above += (STEP - (count + match->extra_above) % STEP) % STEP;
    match->extra_above = smaller(match->extra_above, smaller(MATCH_MAX_DISPARITIES - count,
                                                             MATCH_DISPARITY_LIMIT - 1 - last));
}

struct match_options reconstruct_match_options(const struct rectify_plan *plan,
                                               const struct reconstruct_options *options) {
    struct match_options match = match_default_options(plan->disparity_min, plan->disparity_count);
    match.preset = options->preset;
    match.speckle_px = options->speckle_px;
    match.keep_all = options->keep_all;
    match.kernels = options->kernels;
    if (!options->keep_all) {
        search_beyond(plan, &match);
    }
    return match;
}
