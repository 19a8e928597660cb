// SPDX-License-Identifier: Apache-2.0
/// Sparse matches of the raw pictures of a pair, searched where what is known of the views allows,
/// and the corrections that fit them.
#ifndef VERGENCE_STEREO_ZOOM_REFINE_MATCH_H
#define VERGENCE_STEREO_ZOOM_REFINE_MATCH_H

#include "stereo/zoom/refine_expect.h"

#ifdef __cplusplus
extern "C" {
#endif

enum refine_health { REFINE_GOOD, REFINE_TOUCH_UP, REFINE_CALIBRATE };

struct refine_sigma {
    double before, after;
};

struct refine_report {
    int matches, used;          // pairs of points, and those that fit
    double rows_before_px;      // median distance from the epipolar line
    double rows_px;             // the same after the correction
    double noise_px;            // of one coordinate of a match
    double depth_mm;            // median of the matches, left camera
    struct refine_sigma depth;  // mm, common to all points, at that depth; without scale
    struct refine_sigma focal;  // relative, common to both cameras
    struct refine_sigma ratio;  // relative, of the focal lengths, right to left
    struct refine_sigma vergence_rad;
    double surprise;  // largest correction that pictures showed, in sigmas of the prior
    enum refine_health health;
};

/// Word for a health: good, touch up, calibrate.
const char *refine_health_text(enum refine_health health);

/// Points that were matched, of any states.
struct refine_tracks {
    struct self_track *track;
    int count, max;
};

/// Matches a pair and adds the points that fit to `tracks`, which must have room for
/// SPARSE_LEFT_MAX more; then `self` fits all of them. With fewer than 20 new ones none is added
/// and `report->used` is 0. Sets the matches, rows, noise and depth of the report. ERROR_MEMORY.
int refine_match(const struct refine_picture *picture, struct arena *arena,
                 struct self_calibration *self, struct refine_tracks *tracks,
                 struct refine_report *report);
size_t refine_match_need_bytes(int width, int height);

#ifdef __cplusplus
}
#endif

#endif
