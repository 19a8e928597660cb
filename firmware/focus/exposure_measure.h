// SPDX-License-Identifier: Apache-2.0
/// How bright a region is: what an exposure search decides by. Rows are added one by one, of one or
/// several frames with the same settings, so that flicker averages out.
#ifndef VERGENCE_FOCUS_EXPOSURE_MEASURE_H
#define VERGENCE_FOCUS_EXPOSURE_MEASURE_H

#include <stdint.h>

#include "core/raw_image.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { EXPOSURE_BINS = 1024 };

/// Accumulator. Values of more than 10 bits are counted by their upper 10.
struct exposure_histogram {
    enum raw_layout layout;
    int bits;
    uint16_t black;  ///< level of black, in values of `bits`
    uint64_t values, greens, green_sum;
    uint32_t bins[EXPOSURE_BINS];
};

/// Brightness as parts of the range from black to full scale: 1 is full scale.
struct exposure_measure {
    double mean;       ///< mean of green
    double saturated;  ///< part of all values that is at 63/64 of full scale or above
    double high;       ///< what all but 0.1 % of all values do not exceed
    double white;      ///< what all but 1 % do not exceed
    /// Estimate of `high` if it is saturated: the brightest parts would be at so many times full
    /// scale, from how the histogram falls off below; else 1. At most EXPOSURE_EXCESS_MAX, which
    /// means that (nearly) everything is saturated.
    double excess;
};

#define EXPOSURE_EXCESS_MAX 256.0
/// Part of the values that may be saturated.
#define EXPOSURE_SATURATED_MAX 0.001

/// The first value of a row that counts as green, and the step to the next; all of a grey image do.
int exposure_first_green(enum raw_layout layout, int row);
int exposure_green_step(enum raw_layout layout);

/// `bits`: 8 .. 16; `black`: below a half of full scale.
void exposure_histogram_begin(struct exposure_histogram *self, enum raw_layout layout, int bits,
                              uint16_t black);
/// Adds row `y` of a frame (counted from its top) with this many pixels.
void exposure_histogram_row(struct exposure_histogram *self, const uint16_t *row, int width_px,
                            int y);
/// Result for the rows so far, at least one.
struct exposure_measure exposure_histogram_end(const struct exposure_histogram *self);

#ifdef __cplusplus
}
#endif

#endif
