// SPDX-License-Identifier: Apache-2.0
/// Image quality for measuring: light and sharpness, as four numbers. Rows are processed one by one
/// and not stored, so a camera's rows can be judged as they arrive. Integers only.
#ifndef VERGENCE_STEREO_IMAGE_PICTURE_STATS_H
#define VERGENCE_STEREO_IMAGE_PICTURE_STATS_H

#include <stdbool.h>
#include <stdint.h>

#include "core/raw_image.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { PICTURE_STATS_MAX_PERMILLE = 1000 };

/// Format of the values of a row.
struct picture_form {
    int width_px;
    int bits;      ///< 8..16: values are 0..2^bits - 1
    int channels;  ///< 1, or 3 of interleaved red, green, blue
    bool mosaic;   ///< one channel in a Bayer mosaic: even rows G R, odd rows B G
};

/// Each 0..1000, in parts of a thousand.
struct picture_stats {
    /// Mean of all values; 1000 is full scale, 2^bits - 1. Colours are weighted as they occur: half
    /// of a mosaic's are green. Values are not converted, so a (linear) mosaic is dark at smaller
    /// numbers than a picture encoded for viewing.
    uint16_t brightness_permille;
    /// Share of values of at least 63/64 of full scale: some cameras clip slightly below it.
    uint16_t saturated_permille;
    /// Share of values of at most 1/64 of full scale.
    uint16_t black_permille;
    /// Steepness of edges along the rows: in every 32 pixels, the largest step between neighbouring
    /// samples (the mean of two pixels, of their green where there are colours), divided by the
    /// difference of the largest and the smallest sample; the mean over the picture, weighted by
    /// the square of that difference, so that edges count and noise hardly does. Independent of
    /// exposure, as both scale alike. 1000: every edge is one step; 67: ramps only; 0: no contrast,
    /// or a picture narrower than 32 pixels. Measured (gaussian blur of sigma 0, 2, 4, 8 px, with
    /// 1/255 of noise): 370..790, 230..380, 170..240, 125..190 over 49 pairs of scenes and boards.
    uint16_t sharpness_permille;
};

/// Accumulator for one picture.
struct picture_stats_sums {
    struct picture_form form;
    uint32_t rows;
    uint64_t values, sum, saturated, black;
    uint64_t steps, contrasts;  ///< sums of step x contrast and of contrast x contrast
};

void picture_stats_begin(struct picture_stats_sums *sums, const struct picture_form *form);

/// Adds the next row, from the top: `channels` x `width_px` values. Values larger than `bits`
/// allows count as saturated.
void picture_stats_row(struct picture_stats_sums *sums, const uint16_t *values);

/// Result for the rows so far; all 0 without rows.
struct picture_stats picture_stats_end(const struct picture_stats_sums *sums);

/// Format of an image's rows.
struct picture_form picture_form_of(const struct raw_image *image);
/// Statistics of a whole image.
struct picture_stats picture_stats_of(const struct raw_image *image);

#ifdef __cplusplus
}
#endif

#endif
