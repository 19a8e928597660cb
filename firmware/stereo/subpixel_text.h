// SPDX-License-Identifier: Apache-2.0
// The sub-pixel fit of one row after the other, compiled once for each processor level
// (subpixel_plain.c, subpixel_avx2.c): plain loops over rows of whole numbers of 16 and 32 bits,
// which compilers turn into vector instructions, without a division: a quotient of few bits is
// found bit by bit. The bounds are those of grey levels in 0..255 and windows of 25 pixels; nothing
// overflows.
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "stereo/subpixel_strip.h"

enum {
    SMOOTH_STEP_Q8 = 192,  // neighbours with a larger difference of disparity belong to another
                           // surface
    // What smoothing changes at most; with the fit's moves below half a pixel, two pixels in all.
    SMOOTH_MAX_Q8 = 85,
    SMOOTH_BITS = 7,
    MOVE_BITS = 7,
    SHIFT_BITS = 5,
    VARIANCE_BITS = 12,
    ROUGH_BITS = 9,
    COUNT_MIN = 5,
    COUNT_MAX = 25,
    BOUND_MAX_Q16 = 9600,    // path costs determine pixels without texture
    ROUGH_SHARE_Q4 = 11,     // weight of the neighbours' mean |second difference|, squared
    MISSING_Q16 = 900,       // variance for each pixel of the window that is missing
    SIGMA_BITS = 9,          // the largest sigma is 256
    ROUNDING_VARIANCE = 43,  // of the difference of two rounded grey levels, in 1/256
};

// Row y of the left image, its ends repeated.
static const uint8_t *left_row(const struct subpixel_strip *strip, int y) {
    const struct image_u8 *image = &strip->input->left;
    const uint8_t *row = image_u8_row(image, y);
    const int x_last = strip->x_first + strip->columns;
    const int begin = strip->x_first - 1 < 0 ? 0 : strip->x_first - 1;
    const int end = x_last + 1 < image->width ? x_last + 1 : image->width;
    uint8_t *left = strip->left;
    memset(left - 1, row[0], (size_t)(begin - strip->x_first + 1));
    memcpy(left + begin - strip->x_first, row + begin, (size_t)(end - begin));
    memset(left + end - strip->x_first, row[image->width - 1], (size_t)(x_last + 1 - end));
    return left;
}

#if defined(__bfin__)
#include "stereo/subpixel_bfin.h"
#else
#include "stereo/subpixel_fit.h"
#include "stereo/subpixel_smooth.h"
#endif

static struct subpixel_terms terms_of(const struct subpixel_step *step, int y) {
    return (struct subpixel_terms){subpixel_row(&step->used, y),
                                   (int16_t *)subpixel_row(&step->gradient, y),
                                   (int16_t *)subpixel_row(&step->difference, y)};
}

// Contribution of row y, smoothed, at its present disparities.
static void arrive(const struct subpixel_strip *strip, const struct subpixel_step *step, int y) {
    const struct subpixel_terms in = terms_of(step, y);
    const struct subpixel_terms out = terms_of(step, y - SUBPIXEL_WINDOW);
    if (y < strip->input->left.height) {
        compare_row(strip, step, y, &in);
    } else {
        const size_t bytes = (size_t)strip->columns * sizeof *in.used;
        memset(in.used, 0, bytes);
        memset(in.gradient, 0, bytes);
        memset(in.difference, 0, bytes);
    }
    sum_columns(&in, &out, &step->sums, strip);
}

// Each stage is SUBPIXEL_RADIUS rows behind the one before.
void SUBPIXEL_LOOPS(const struct subpixel_strip *strip, int arriving) {
    const int height = strip->input->left.height;
    const struct subpixel_ring *present = &strip->disparity;
    int y = arriving - SUBPIXEL_RADIUS;
    for (int i = 0; i < SUBPIXEL_STEPS; i++) {
        const struct subpixel_step *step = &strip->step[i];
        if (y >= 0 && y < height) {
            smooth_row(strip, present, y, subpixel_row(&step->smooth, y), false);
        }
        if (y >= 0 && y < height + SUBPIXEL_RADIUS) {
            arrive(strip, step, y);
        }
        y -= SUBPIXEL_RADIUS;
        if (y >= 0 && y < height) {
            fit_row(strip, step, y,
                    i == SUBPIXEL_STEPS - 1 ? subpixel_row(&strip->bound, y) : NULL);
        }
        y -= SUBPIXEL_RADIUS;
        present = &step->fitted;
    }
    if (y >= 0) {
        smooth_row(strip, present, y, strip->last, true);
        sigma_row(strip, y);
    }
}
