// SPDX-License-Identifier: Apache-2.0
/// Self-calibration from two pairs of the same scene, before and after zooming, with pan untouched.
/// Each camera is compared with itself: the ratio of the scales shows where its ring is, and what
/// the wide pair shows of pan holds for the other, which hardly shows it.
#ifndef VERGENCE_STEREO_ZOOM_WIDE_PAIR_H
#define VERGENCE_STEREO_ZOOM_WIDE_PAIR_H

#include "stereo/zoom/adjust_pair.h"

#ifdef __cplusplus
extern "C" {
#endif

struct wide_pair_report {
    struct adjust_report pair[2];  // wide, tele; their sigmas after all of it
    int carried;                   // observations of the tele pair's points in the wide pictures
    double carried_px;  // median of what the corrected views leave of them, px of the wide sensor
    /// How far each camera turned between the pairs, if pan did not stay untouched, and the
    /// standard deviation; INFINITY: unknown.
    double turn_rad[2], turn_sigma_rad[2];
};

/// `picture[0]` is the wider pair, of state 0, `picture[1]` the other, of state 1; `adjustment` was
/// begun with both. If the pictures before and after cannot be compared, `carried` is 0 and
/// `adjustment` fits the pairs alone. ERROR_MEMORY.
int wide_pair_adjust(const struct adjust_picture picture[2], struct arena *arena,
                     struct adjustment *adjustment, struct wide_pair_report *report);
size_t wide_pair_need_bytes(int width, int height);

/// Whether a camera turned between the pairs.
bool wide_pair_turned(const struct wide_pair_report *report);

#ifdef __cplusplus
}
#endif

#endif
