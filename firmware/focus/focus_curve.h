// SPDX-License-Identifier: Apache-2.0
/// Sharpness against the position of the focus ring, and the peaks of this curve.
///
/// A thin lens's blur grows linearly with the distance from focus, as rings are nearly linear in
/// 1 / distance: the curve is symmetric about its peak. Where blur dominates, the variance of a
/// fine texture falls with its square, so that its reciprocal is a parabola; for coarser textures
/// and edges it still is one near the top. Its vertex is the peak.
#ifndef VERGENCE_FOCUS_FOCUS_CURVE_H
#define VERGENCE_FOCUS_FOCUS_CURVE_H

#include <stdbool.h>
#include <stdint.h>

#include "focus/focus_measure.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { FOCUS_SAMPLES_MAX = 512 };

/// The part of a search that a sample is from.
enum focus_leg {
    FOCUS_LEG_SWEEP,  ///< sweep over the range, at full speed
    FOCUS_LEG_PASS,   ///< pass through the peak, at full speed and from the side of approach
    FOCUS_LEG_REST,   ///< frames with the ring at rest
    FOCUS_LEGS
};

/// The measures of each sample. The first finds the peaks: it sees them from far and through noise.
/// The others decide where the top is: they are narrower, and saturated lights, whose clipped discs
/// have more contrast out of focus, and edges, whose variance hardly changes, mislead them less.
enum focus_channel {
    FOCUS_CHANNEL_CHOSEN,  ///< the measure of the search, variance by default
    FOCUS_CHANNEL_TENENGRAD,
    FOCUS_CHANNEL_LAPLACIAN,
    FOCUS_CHANNELS
};

/// One window of one frame.
struct focus_sample {
    float position;                   ///< position of the ring when the frame was exposed, counts
    float sharpness[FOCUS_CHANNELS];  ///< relative variance or mean squared gradient without noise:
                                      ///< divided by the squared mean above black, so that changing
                                      ///< light cancels out
    float deviation[FOCUS_CHANNELS];  ///< standard deviation of `sharpness` that noise causes
    float noise;                      ///< relative variance of noise in the window
    float mean;                       ///< above black, values
    uint32_t time_ms;                 ///< time since the search began
    uint16_t saturated_permille;
    uint8_t leg;  ///< enum focus_leg
};

struct focus_curve {
    struct focus_sample samples[FOCUS_SAMPLES_MAX];
    uint16_t count;
};

/// Measures a window in all channels. `measure`: that of FOCUS_CHANNEL_CHOSEN. Position, time and
/// leg are the caller's.
struct focus_sample focus_sample_of(const struct focus_window *window, enum focus_plane plane,
                                    enum focus_measure measure, const struct focus_noise *noise);

/// Samples of a curve.
struct focus_range {
    unsigned legs;  ///< bits 1 << enum focus_leg
    enum focus_channel channel;
    float min, max;  ///< positions
};

/// A peak of a curve. Positions in counts.
struct focus_peak {
    double position, deviation;  ///< position of the peak and its standard deviation
    double half_width;           ///< distance from the peak to half its height above the floor
    double height, floor;        ///< sharpness at the peak, and far from it
    unsigned samples;            ///< above half its height
    bool at_edge;                ///< it continues to rise to the last sample on a side
};

/// Noise of a curve: the roughness of neighbouring samples, and what noise alone predicts,
/// whichever is larger. 0 with fewer than 3 samples.
double focus_curve_noise(const struct focus_curve *curve, const struct focus_range *range);

/// The highest peak, and the highest other one that is at least half as high and separated by a
/// valley; `*peaks` of them (0, 1 or 2) in `peaks`.
unsigned focus_curve_peaks(const struct focus_curve *curve, const struct focus_range *range,
                           struct focus_peak peaks[2]);

/// Locates a peak within a range from samples around an estimate: the vertex of the parabola
/// through the reciprocals of the samples above 0.8 of its height, or less until there are 7.
/// False: the samples do not show a peak (fewer than 3, or not curved down); `*peak` is unchanged.
bool focus_curve_fit(const struct focus_curve *curve, const struct focus_range *range,
                     struct focus_peak *peak);

/// Locates a peak so wide that samples next to each other hardly differ: the vertex of a parabola
/// through all samples of the range, then through the nearer half and quarter, as long as its
/// curvature is `significant` times its standard deviation. False: none is.
bool focus_curve_wide_peak(const struct focus_curve *curve, const struct focus_range *range,
                           double significant, struct focus_peak *peak);

/// Sharpness that the fitted peak predicts at a position.
double focus_peak_at(const struct focus_peak *peak, double position);

#ifdef __cplusplus
}
#endif

#endif
