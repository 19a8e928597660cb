// SPDX-License-Identifier: Apache-2.0
/// Several exposures of a static scene, merged frame by frame into one linear image of 16 bits with
/// less noise and more range than one exposure has.
///
/// Memory: one sum of 4 bytes for each value, whatever the number of frames, and the frame that is
/// being added; at the end the merged image of 2 bytes a value, when no frame is needed any more. A
/// camera of 2048 x 1536 needs 12.6 + 6.3 MB.
///
/// Frames come in the order of their exposure, the shortest first. A pixel takes part in a frame
/// unless it is saturated there, or the frames before predict that it nearly is: the prediction and
/// not the value decides, so that noise at the limit causes no bias. Once left out, a pixel is left
/// out of all longer exposures. So its sum and the number of its frames are all that is kept of it.
///
/// Its light is the sum of weighted signals over the sum of weighted exposures. The weights are
/// those of least variance (sensor_noise.h) for a pixel that has a sixteenth of the range in the
/// longest exposure: where all exposures count, weights between 1 and the exposure are best, and
/// away from that signal the variance is at most a fifth above the least possible.
///
/// Integers only, but for the weights: results are the same on all processors.
#ifndef VERGENCE_STEREO_IMAGE_MERGE_EXPOSURES_H
#define VERGENCE_STEREO_IMAGE_MERGE_EXPOSURES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/raw_image.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    MERGE_FRAMES_MAX = 64,
    MERGE_BITS = 16,
    /// Value of black in a merged image of frames whose black level is known, so that the noise of
    /// black parts is not cut off. 65535 is the light that saturates the shortest exposure: 63/64
    /// of its greatest value.
    MERGE_BLACK = 256,
    MERGE_RATIO_MAX = 4096,  ///< largest ratio of the longest exposure to the shortest
};

/// How a frame was taken.
struct merge_exposure {
    uint32_t exposure_us;  ///< 0: not known, but the same for all frames
    uint16_t gain_q3;      ///< 0: likewise
};

/// The exposures to be merged.
struct merge_plan {
    struct raw_image form;  ///< size, layout and bits of the frames; its pixels are not used
    /// Value of black in the frames; 0: not known. Then black stays where it is, as a part of the
    /// range, and all exposures must be the same.
    uint16_t black;
    unsigned frames;  ///< 1 .. MERGE_FRAMES_MAX
    /// First and last exposure that are planned; the frames' own decide.
    struct merge_exposure first, last;
};

/// What the frames up to one have in common.
struct merge_prefix {
    uint64_t exposure_q16;  ///< sum of weighted exposures, of which the first is 1
    uint32_t weights;       ///< sum of the weights
};

/// A merge in progress.
struct merge_exposures {
    struct merge_plan plan;
    uint32_t *sums;  ///< one for each value: frames << 25 | sum of weighted values
    double weight_scale;
    unsigned frames;          ///< added so far
    uint64_t last_ratio_q16;  ///< exposure of the last frame
    struct merge_prefix prefix[MERGE_FRAMES_MAX + 1];
    double light, reading;  ///< noise of the sums, for the comparison with the next frame
};

/// Sums that a merge needs, of 4 bytes each.
size_t merge_exposures_values(const struct raw_image *form);

/// Begins a merge. `sums` are the caller's, as many as merge_exposures_values says, and are used
/// until merge_exposures_end. ERROR_RANGE: exposures further apart than MERGE_RATIO_MAX, or not
/// from short to long, or different ones without a black level.
int merge_exposures_begin(struct merge_exposures *self, const struct merge_plan *plan,
                          uint32_t *sums);

/// Adds a frame. `*changed_permille`: parts per thousand of it whose squares of 4 x 4 values differ
/// by more than five times their noise from what the frames before predict (0: the first one). Only
/// squares that are not saturated are compared. ERROR_RANGE as above.
int merge_exposures_add(struct merge_exposures *self, const struct raw_image *frame,
                        const struct merge_exposure *exposure, uint32_t *changed_permille);

/// Writes the merged image, rows without gaps; `merged` has as many values as there are sums. At
/// least one frame was added.
void merge_exposures_end(const struct merge_exposures *self, uint16_t *merged);

/// The same comparison of a later frame with the merged image. `first`: the shortest exposure.
uint32_t merge_exposures_changed(const struct merge_plan *plan, const struct raw_image *merged,
                                 const struct raw_image *frame,
                                 const struct merge_exposure *exposure);

/// Exposures for a scene, as seen from one frame of it.
struct merge_bracket {
    uint8_t factor;  ///< ratio of one exposure to the previous one, 2 .. 8
    bool shorter;    ///< the first one is shorter than that of the frame by this factor
};

/// Chooses `exposures` (at least 2) of them so that the darkest 2 % of the pixels have an eighth of
/// the range in the longest one, as far as eight times from one to the next allow. If more than
/// three in a thousand are saturated in the frame, the first exposure is shorter; else it is the
/// frame's. Factors are whole numbers: if one exposure is a multiple of half the mains period, so
/// are all longer ones.
struct merge_bracket merge_bracket_for(const struct raw_image *frame, uint16_t black,
                                       unsigned exposures);

#ifdef __cplusplus
}
#endif

#endif
