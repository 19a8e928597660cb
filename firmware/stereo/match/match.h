// SPDX-License-Identifier: Apache-2.0
/// Scanline dynamic-programming stereo with occlusions, in one pass over the rows. Costs, path
/// costs and sums are 8- and 16-bit integers; for the method see match.c.
#ifndef VERGENCE_STEREO_MATCH_MATCH_H
#define VERGENCE_STEREO_MATCH_MATCH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/arena.h"
#include "core/parallel.h"
#include "stereo/geometry/rectify.h"
#include "stereo/image/image.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A compiled set of inner loops, see kernels.h.
struct match_kernels;

/// Trade-offs of error, time and memory, measured in RESULTS.md.
enum match_preset {
    MATCH_PRESET_FAST,      // every other row, near a surface found at a quarter of the width
    MATCH_PRESET_STANDARD,  // disparities near a surface found at a quarter of the width
    MATCH_PRESET_BEST,      // all disparities everywhere
    MATCH_PRESET_BOARD,     // disparities near a surface found at half the size; for little memory
    MATCH_PRESET_PAPER,     // a greedy path along each row: the method of the paper this project
                            // started from
    MATCH_PRESET_COUNT
};

struct match_options {
    int disparity_min, disparity_count;
    // Number of disparities also searched below and above the range: a pixel whose best match lies
    // there is out of range, and does not get the next best match inside.
    int extra_below, extra_above;
    enum match_preset preset;
    int speckle_px;  // islands below this area are rejected; 0: keep all
    bool keep_all;   // reject only pixels at the border: for measuring the raw matcher
    const struct match_kernels *kernels;  // NULL: the fastest; all give identical results
};

/// Rows of which images a step reads.
enum match_wanted {
    MATCH_WANTS_LEFT,
    MATCH_WANTS_GREY,
    MATCH_WANTS_COLOUR,
    MATCH_WANTS_AHEAD,  // of the coarser levels, while the finest one wants other rows
};

/// The images to match: rectified grey images and their valid spans.
struct match_input {
    struct image_u8 left, right;
    const struct rectify_span *left_span, *right_span;  // valid columns of each row; NULL: all
    bool resampled;  // the rows were interpolated from raw images, not copied
    // In colour; either may have no data. Edges are those of the left image in colour; pixels are
    // compared in colour only if both images have any. Equal channels count as grey.
    struct image_rgb8 left_colour, right_colour;
    // Called before rows [begin, end) of what is wanted are read, which are then rings of at least
    // match_needs' rows. NULL: all rows are there.
    void (*rows)(void *self, enum match_wanted what, int begin, int end);
    void *self;
    // Then what the coarser levels read, in grey: rings of at least match_needs' `rows_ahead`.
    struct image_u8 ahead[2];
};

/// Asks for rows [begin, end) of the images of a pair, as far as there are such rows.
static inline void match_input_rows(const struct match_input *input, enum match_wanted what,
                                    int begin, int end) {
    const int first = begin > 0 ? begin : 0;
    const int last = end < input->left.height ? end : input->left.height;
    if (input->rows != NULL && first < last) {
        input->rows(input->self, what, first, last);
    }
}

/// Results, all of the size of the left image. Owned by the caller.
struct match_output {
    struct image_i32 disparity_q8;  // 256 (x_left - x_right); the best guess for rejected pixels
                                    // too
    struct image_u8 reason;         // enum reason
    struct image_u8 confidence;     // 0..255, margin of the winner over its rivals
};

/// Name of a preset, in lower case; NULL for any other number. Static storage.
const char *match_preset_name(enum match_preset preset);

/// The preset with this name; MATCH_PRESET_COUNT if there is none.
enum match_preset match_preset_named(const char *name);

/// Defaults for a search range: the standard preset.
struct match_options match_default_options(int disparity_min, int disparity_count);

/// What `match_run` needs with `threads` threads. Its working memory is O(width x disparities), and
/// 1/4 byte for each pixel; with the presets fast, standard and board hardly more for a larger
/// range.
struct match_need {
    size_t bytes;  // 0: an argument is out of range
    // Rows that rings of a pair's rows must hold, so that none is asked for twice in one pass:
    // those of all stages, no more than there are, and those of `match_input.ahead`.
    int rows_kept, rows_ahead;
};
struct match_need match_needs(int width, int height, const struct match_options *options,
                              int threads);

/// Upper bound of the pixels times disparities that `match_run` processes on all levels; its run
/// time is proportional. For the preset paper the equivalent number. 0 if an argument is out of
/// range.
uint64_t match_work(int width, int height, const struct match_options *options);

/// Called after each batch of bands, of 8 to 128 rows, with the number of finished rows; returns
/// false to cancel. Coarser levels run a batch ahead of the finest, so progress is about
/// proportional to time.
typedef bool match_progress(void *self, int rows_done, int rows);

/// Matches a pair. `progress` may be NULL. The result does not depend on `parallel`. Errors:
/// ERROR_TOO_SMALL, ERROR_TOO_LARGE, ERROR_SIZE_MISMATCH, ERROR_DISPARITY_RANGE, ERROR_MEMORY,
/// ERROR_CANCELLED (outputs then contain the finished rows).
int match_run(const struct match_input *input, const struct match_options *options,
              const struct parallel *parallel, match_progress *progress, void *progress_self,
              struct arena *arena, struct match_output *output);

/// Adds to `count` the valid pixels of rows [begin, end) on repetitive texture for which the
/// disparity of another period lies in the requested range. The ends of the pattern may have
/// decided correctly, as those of a chessboard do; this function cannot detect that. Rows are taken
/// by MATCH_REPEAT_ROWS: `begin` is a multiple, and `end` too, or the height. ERROR_MEMORY.
enum { MATCH_REPEAT_ROWS = 8 };
size_t match_repeats_need_bytes(int width, int threads);
int match_count_repeats(const struct match_input *input, const struct match_options *options,
                        const struct parallel *parallel, struct arena *arena,
                        const struct match_output *output, int begin, int end, uint32_t *count);

#ifdef __cplusplus
}
#endif

#endif
