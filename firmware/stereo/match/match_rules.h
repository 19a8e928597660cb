// SPDX-License-Identifier: Apache-2.0
/// What the presets of the matcher have in common, whatever their method: which arguments are
/// legal, and rules by which a pixel is rejected. Private to match*.c.
#ifndef VERGENCE_STEREO_MATCH_MATCH_RULES_H
#define VERGENCE_STEREO_MATCH_MATCH_RULES_H

#include "stereo/match/match.h"

enum {
    DISPARITY_ONE = 256,
    TEXTURE_RADIUS = 8,  // along the row
    TEXTURE_MIN = 6,     // grey levels between the darkest and the brightest pixel
};

/// Whether the range of disparities is one that can be searched, with what is searched beyond its
/// ends, whatever numbers a caller may have written.
bool match_range_is_legal(const struct match_options *options);

/// All that is searched: the range and what lies beyond its ends. The range must be legal.
static inline int match_searched_min(const struct match_options *options) {
    return options->disparity_min - options->extra_below;
}
static inline int match_searched_count(const struct match_options *options) {
    return options->extra_below + options->disparity_count + options->extra_above;
}

/// Checks the arguments of `match_run`. ERROR_SIZE_MISMATCH, ERROR_TOO_LARGE, ERROR_TOO_SMALL,
/// ERROR_DISPARITY_RANGE, ERROR_ARGUMENT.
int match_check(const struct match_input *input, const struct match_options *options,
                const struct match_output *output);

/// Disparities at each end of a range that no pixel is believed to have: the best may lie beyond. A
/// range of one or two has nothing but ends.
/*@ assigns \nothing;
    ensures \result == (disparity_count > 2 ? 1 : 0); */
static inline int match_range_ends(int disparity_count) {
    return disparity_count > 2 ? 1 : 0;
}

/// Indices of the disparities that a pixel is believed to have, counted from the lowest that is
/// searched: those of the range, less its ends where nothing beyond them is searched.
struct match_believed {
    int first, last;
};
static inline struct match_believed match_believed_of(const struct match_options *options) {
    const int ends = match_range_ends(options->disparity_count);
    return (struct match_believed){
        options->extra_below > 0 ? options->extra_below : ends,
        options->extra_below + options->disparity_count - 1 - (options->extra_above > 0 ? 0 : ends),
    };
}

#endif
