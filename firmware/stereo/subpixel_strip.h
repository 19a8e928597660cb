// SPDX-License-Identifier: Apache-2.0
/// What subpixel.c and its loops share, which are compiled from one text (subpixel_text.h) for each
/// processor level. Private to these.
#ifndef VERGENCE_STEREO_SUBPIXEL_STRIP_H
#define VERGENCE_STEREO_SUBPIXEL_STRIP_H

#include <stddef.h>
#include <stdint.h>

#include "stereo/match/match.h"

// No row of a loop overlaps another; compilers would compare them all, or give up.
#if defined(__clang__)
#define SUBPIXEL_EACH_ALONE _Pragma("clang loop vectorize(assume_safety)")
// Without optimisation they stay as they are.
#pragma clang diagnostic ignored "-Wpass-failed"
#else
#define SUBPIXEL_EACH_ALONE _Pragma("GCC ivdep")
#endif

enum {
    SUBPIXEL_RADIUS = 2,
    SUBPIXEL_WINDOW = 2 * SUBPIXEL_RADIUS + 1,
    SUBPIXEL_STEPS = 2,  // smoothing and fit; then the last smoothing
    SUBPIXEL_REACH = (2 * SUBPIXEL_STEPS + 1) * SUBPIXEL_RADIUS,  // of all stages, in pixels
    // Columns that a strip needs on both sides: a difference is also multiplied by that to its
    // left.
    SUBPIXEL_ASIDE = SUBPIXEL_REACH + SUBPIXEL_STEPS,
    SUBPIXEL_BATCH_ROWS = 16,  // rows between two points where the strips wait for each other
    SUBPIXEL_SIGMA_MAX_Q8 = 256,
};

/// The rows of a strip that a stage still needs; row y is in slot y modulo `rows`.
struct subpixel_ring {
    uint16_t *data;
    int rows;
    ptrdiff_t stride;
};

/// Gradient in 1/2 grey level a pixel, difference (right - left) in 1/4; both 0 where not `used`,
/// which is a mask.
struct subpixel_terms {
    uint16_t *used;
    int16_t *gradient, *difference;
};

/// Sums of the terms over the rows of a window.
struct subpixel_sums {
    uint16_t *count;
    int16_t *gradient, *difference;
    int32_t *gradient2, *product, *difference2;
    int32_t *neighbours;  // difference times that of the pixel to the left
};

/// One smoothing and fit.
struct subpixel_step {
    struct subpixel_ring smooth, fitted;              // disparities
    struct subpixel_ring used, gradient, difference;  // terms
    struct subpixel_sums sums;
};

/// Columns [begin, end) of the image and what their windows need on both sides: element x of a row
/// is column x_first + x. Disparities are in 1/256 px, modulo 256 px.
struct subpixel_strip {
    const struct match_input *input;
    struct match_output *output;
    struct image_u8 *sigma_codes;
    int32_t floor_q16;  // variance that no window shows
    int begin, end;
    int x_first, columns;
    struct subpixel_ring disparity, bad, whole;  // of the arriving rows: `bad` masks pixels without
                                                 // a disparity, `whole` is the column in the right
                                                 // image
    struct subpixel_step step[SUBPIXEL_STEPS];
    struct subpixel_ring bound;  // variances in 1/65536 px^2
    // Scratch rows.
    uint16_t *pairs, *rough;  // neighbours that agree, and the sum of their |second differences|
    uint16_t *last, *sigma;   // results
    uint8_t *left;
    uint32_t *four;  // pixels of the right image
    uint16_t *column;
    int16_t *between;
    int32_t *count, *gradient2, *product, *difference2, *together;  // moments of windows
};

static inline uint16_t *subpixel_row(const struct subpixel_ring *ring, int y) {
    return ring->data + (ptrdiff_t)((y + ring->rows * SUBPIXEL_WINDOW) % ring->rows) * ring->stride;
}

/// Takes row `arriving` through all stages, each SUBPIXEL_RADIUS rows behind the one before: of row
/// arriving - SUBPIXEL_REACH, where there is one, the results are in `last` and `sigma`.
typedef void subpixel_loops(const struct subpixel_strip *strip, int arriving);

subpixel_loops subpixel_plain_loops;
#if defined(__x86_64__)
subpixel_loops subpixel_avx2_loops;
#endif

#endif
