// SPDX-License-Identifier: Apache-2.0
/// How sharp a window of a frame is. Integers only: the same result on every target.
///
/// A mosaic is measured one colour plane at a time: nine tenths of the variance of all its values
/// come from the colour filters, not from the scene. Green is two planes (of red and of blue rows),
/// measured apart and averaged, as their sensitivities differ slightly.
///
/// Each measure is reduced by what noise alone contributes to it, so that a flat window measures 0
/// on average, whatever gain and exposure are.
#ifndef VERGENCE_FOCUS_FOCUS_MEASURE_H
#define VERGENCE_FOCUS_FOCUS_MEASURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum focus_measure {
    /// Variance of the values (Liu, Willis and Sui, "Stereoscopic 3D Reconstruction using Motorized
    /// Zoom Lenses within an Embedded System").
    FOCUS_VARIANCE,
    /// Variance over the squared mean above black: independent of the amount of light.
    FOCUS_NORMALIZED_VARIANCE,
    FOCUS_TENENGRAD,  ///< mean squared Sobel gradient
    FOCUS_LAPLACIAN,  ///< mean squared Laplacian (4 neighbours)
    FOCUS_MEASURES
};

enum focus_plane {
    FOCUS_GREEN,
    FOCUS_RED,
    FOCUS_BLUE,
    FOCUS_GREY,       ///< every pixel: not a mosaic
    FOCUS_RGB_GREEN,  ///< green of interleaved R G B, every pixel
    FOCUS_PLANES
};

static inline bool focus_plane_is_mosaic(enum focus_plane plane) {
    return plane != FOCUS_GREY && plane != FOCUS_RGB_GREEN;
}

enum {
    FOCUS_WINDOW_MIN_PX = 8,
    FOCUS_WINDOW_MAX_PX = 4096,
    FOCUS_VALUE_BITS = 12,       ///< values must be below 1 << FOCUS_VALUE_BITS
    FOCUS_NORMALIZED_SHIFT = 24  ///< fractional bits of the normalized variance
};

/// Part of a frame; of a mosaic (G R / B G) its upper left pixel is a green one of a red row.
struct focus_window {
    const uint16_t *values;
    size_t stride;                 ///< values from row to row
    uint16_t width_px, height_px;  ///< FOCUS_WINDOW_MIN_PX..FOCUS_WINDOW_MAX_PX; of a mosaic even
    uint16_t saturated;            ///< values from here on count as saturated
};

/// Noise of a value v: variance read_q8 / 256 + (v - black) * shot_q16 / 65536, in squared units of
/// the values. Both grow with the gain: see focus_noise_at.
struct focus_noise {
    uint16_t black;
    uint32_t read_q8, shot_q16;
};

/// Result for one window.
struct focus_sharpness {
    /// In units of 1/256 squared value (FOCUS_NORMALIZED_VARIANCE: 2^-24), without noise; not
    /// below 0.
    uint64_t energy;
    uint64_t noise_energy;  ///< what was subtracted, in the same unit
    uint32_t samples;       ///< values that were averaged, all planes together
    uint32_t mean_q8;       ///< mean above black, * 256
    uint16_t saturated_permille;
};

/// The noise at a gain, given that at gain 1. `gain_q3`: gain * 8, at least 1. Read noise before
/// the amplifier grows with its square; shot noise per value grows with it.
struct focus_noise focus_noise_at(const struct focus_noise *unity, uint16_t gain_q3);

/// Measures a window. The arguments must be within their ranges; values above FOCUS_VALUE_BITS are
/// cut off there. The mean is that of the plane.
struct focus_sharpness focus_measure_window(const struct focus_window *window,
                                            enum focus_plane plane, enum focus_measure measure,
                                            const struct focus_noise *noise);

#ifdef __cplusplus
}
#endif

#endif
