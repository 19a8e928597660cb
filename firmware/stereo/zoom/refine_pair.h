// SPDX-License-Identifier: Apache-2.0
/// Self-calibration from one pair: sparse matches of the two raw pictures, searched where the
/// calibration's uncertainty allows, correct what they show of lenses and pose before the pair is
/// rectified. A pair cannot show the focal length common to both cameras, and pan hardly; the
/// report says what remains.
#ifndef VERGENCE_STEREO_ZOOM_REFINE_PAIR_H
#define VERGENCE_STEREO_ZOOM_REFINE_PAIR_H

#include "core/arena.h"
#include "stereo/zoom/refine_match.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The sigmas and the health of a report, of a state of `self` after its pair was matched.
void refine_assess(const struct refine_picture *picture, const struct self_calibration *self,
                   struct refine_report *report);

/// Matches the pair and corrects `self`, begun with the pair's state. With fewer than 20 matches
/// that fit, nothing is corrected (`report->used` is 0). ERROR_MEMORY.
int refine_pair(const struct refine_picture *picture, struct arena *arena,
                struct self_calibration *self, struct refine_report *report);
size_t refine_pair_need_bytes(int width, int height);

/// The pair's calibration for its pictures as they are, from a calibration of any zoom: refined as
/// far as the pictures allow, with its remaining uncertainty. Errors of zoom_calibration_at.
int refine_calibration(const struct zoom_calibration *calibration,
                       const struct refine_picture *picture, struct arena *arena,
                       struct calibration *result, struct refine_report *report,
                       struct calibration_fault *fault);
size_t refine_calibration_need_bytes(int width, int height);

#ifdef __cplusplus
}
#endif

#endif
