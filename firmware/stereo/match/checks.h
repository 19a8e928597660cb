// SPDX-License-Identifier: Apache-2.0
/// Checks of arguments, and the steps that read whole images: noise (noise.c), rules that look
/// around a pixel (validation.c), islands (speckle.c). Private to this folder, stereo/subpixel.c
/// and the tests.
#ifndef VERGENCE_STEREO_MATCH_CHECKS_H
#define VERGENCE_STEREO_MATCH_CHECKS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/arena.h"
#include "core/parallel.h"
#include "stereo/match/match.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    DISPARITY_ONE = 256,    // disparities are in 1/256 px
    CHECKS_ROWS_KEPT = 38,  // rows that a step after matching asks for at once, at most
};

/// Counts memory, and takes it if there is an arena: a size is stated once.
struct match_memory {
    struct arena *arena;  // NULL: only count
    size_t need_bytes;
    bool failed;
};

/// NULL if there is no arena, or not enough memory: then `failed` is set.
void *match_take(struct match_memory *memory, size_t count, size_t element_bytes);

/// Whether a range of disparities can be searched, with the extra disparities at its ends, for any
/// numbers of the caller.
bool match_range_is_legal(const struct match_options *options);

/// The whole search: the range and the extra disparities at its ends. The range must be legal.
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

/// Number of disparities at each end of a range that are rejected, as the best match may lie
/// beyond. A range of one or two consists only of ends.
static inline int match_range_ends(int disparity_count) {
    return disparity_count > 2 ? 1 : 0;
}

/// Indices of accepted disparities, counted from the lowest searched: those of the range, without
/// its ends if nothing beyond them is searched.
struct match_accepted_range {
    int first, last;
};
static inline struct match_accepted_range match_accepted_range_of(
    const struct match_options *options) {
    const int ends = match_range_ends(options->disparity_count);
    return (struct match_accepted_range){
        options->extra_below > 0 ? options->extra_below : ends,
        options->extra_below + options->disparity_count - 1 - (options->extra_above > 0 ? 0 : ends),
    };
}

/// Grey levels of an image: blocks with its ends may be clipped, and show too little noise.
struct match_limits {
    uint8_t darkest, brightest;
};

/// What a first look at a pair shows, of every n-th row of a high one; left and right.
struct match_look {
    // Weight of each of the two neighbours of a pixel along a row and along a column, in 1/16:
    // higher for noisier images, 0 for those of little noise or of texture as fine as noise.
    int smoothing;
    struct match_limits limits[2];
    bool coloured[2];  // whether any pixel is
};

void match_look_at(const struct match_input *input, struct match_look *look);

/// Memory that `match_check_blocks` takes, in bytes.
size_t match_check_blocks_need_bytes(int width, int height, int threads);

/// Rejects valid pixels of a row without texture of their own, between occluded ones and an
/// outline. `smooth`: 16 times the grey levels of the left image, smoothed by (1 2 1) both ways,
/// also of two pixels before and after the row. `noise_q8`: `match_noise_q8`.
void match_reject_hidden(const uint16_t *smooth, uint32_t noise_q8, int width, uint8_t *reason);

/// Accepts pixels of which only the cost was too high where many around are valid. Rejects
/// blocks of valid pixels without texture along the row, with too few valid pixels around
/// for the texture there is, and with too few for coarse texture: noise, and structure that does
/// not change along the rows, also find partners, but seldom agree, or have near rivals. Then
/// rejects what is hidden, by `match_reject_hidden`. The measure is `match_noise_q8`. `look`:
/// of the pair, by `match_look_at`. ERROR_MEMORY.
int match_check_blocks(const struct match_input *input, const struct match_options *options,
                       const struct match_look *look, const struct parallel *parallel,
                       struct arena *arena, struct match_output *output);

/// Working memory of `speckle_filter_run_all` in bytes for an image of that width.
size_t speckle_filter_need_bytes(int width, int speckle_px, int threads);

/// Marks every valid pixel of an island (4-connected, neighbours within
/// TUNE_ISLAND_STEP) of fewer than `speckle_px` pixels with REASON_SPECKLE. Each pixel
/// is visited a constant number of times. Rows are distributed over threads; the result does not
/// depend on that. ERROR_MEMORY; nothing is changed then.
int speckle_filter_run_all(int speckle_px, const struct parallel *parallel, struct arena *arena,
                           struct match_output *output);

/// The nearest whole disparity.
static inline int match_whole_disparity(int32_t disparity_q8) {
    return (disparity_q8 + 128) >> 8;
}

/// How many blocks of a pair differ how much between the images where they match, in bins: noise.
/// All 0 at the beginning.
enum { MATCH_NOISE_BINS = 1024 };
struct match_noise {
    uint32_t count[MATCH_NOISE_BINS], blocks;
    int rows;  // those above have been looked at
};

/// Adds blocks of valid pixels, but not those with clipped ones, up to row `rows`, those above
/// which are there: of the images three more, and as many as before.
void match_noise_add(struct match_noise *noise, const struct match_input *input,
                     const struct match_look *look, const struct match_output *output, int rows);

/// Variance of the noise of a pixel, in 1/256 of a squared grey level; at least that of whole grey
/// levels.
uint32_t match_noise_q8(const struct match_noise *noise);

// The preset paper (paper.c).

/// Working memory of `match_paper_run` in bytes: O(width), independent of the height and the number
/// of disparities. 0 if an argument is out of range.
size_t match_paper_need_bytes(int width, const struct match_options *options);

/// Matches a pair of rectified images. Arguments, outputs, errors and cancellation are those of
/// `match_run`; `options->kernels` is ignored. Before speckles are removed, rows influence each
/// other only through the 4 rows above and below in the signatures.
///
/// The confidence compares the dissimilarity h at the match with the smaller one r of two
/// disparities above and below it: 255 (r - h) / (r + h). It shows how sharply the position is
/// determined, but not whether it is unique, as the path does not search everywhere. 0 where walks
/// disagree.
int match_paper_run(const struct match_input *input, const struct match_options *options,
                    match_progress *progress, void *progress_self, struct arena *arena,
                    struct match_output *output);

#ifdef __cplusplus
}
#endif

#endif
