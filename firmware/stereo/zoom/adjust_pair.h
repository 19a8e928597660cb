// SPDX-License-Identifier: Apache-2.0
/// Self-calibration from one pair: sparse matches of the two raw pictures, searched where the
/// calibration's uncertainty allows, correct what they show of lenses and pose before the pair is
/// rectified. A pair cannot show the focal length common to both cameras, and pan hardly; the
/// report says what remains.
#ifndef VERGENCE_STEREO_ZOOM_ADJUST_PAIR_H
#define VERGENCE_STEREO_ZOOM_ADJUST_PAIR_H

#include "core/arena.h"
#include "stereo/zoom/adjust_expect.h"

#ifdef __cplusplus
extern "C" {
#endif

enum adjust_health { ADJUST_GOOD, ADJUST_TOUCH_UP, ADJUST_CALIBRATE };

struct adjust_sigma {
    double before, after;
};

struct adjust_report {
    int corners;                // distinct points of the left picture
    int matches, used;          // pairs of points, and those that fit
    double rows_before_px;      // median distance from the epipolar line
    double rows_px;             // the same after the correction
    double noise_px;            // noise of one coordinate of a match
    double depth_mm;            // median of the matches, left camera
    struct adjust_sigma depth;  // mm, common to all points, at that depth; without scale
    struct adjust_sigma focal;  // relative, common to both cameras
    struct adjust_sigma ratio;  // relative, of the focal lengths, right to left
    struct adjust_sigma vergence_rad;
    double chi_square_score;  // result of adjust_chi_square_score
    enum adjust_health health;
};

/// Whether a pair with many distinct points has hardly any that fit: the cameras are not where the
/// calibration expects them, or show different things.
bool adjust_pair_is_lost(const struct adjust_report *report);

/// Word for a health: good, touch up, calibrate.
const char *adjust_health_text(enum adjust_health health);

/// Points that were matched, of any states.
struct adjust_tracks {
    struct adjust_track *track;
    int count, max;
};

/// Matches a pair and adds the points that fit to `tracks`, which must have room for
/// SPARSE_LEFT_MAX more; then `adjustment` fits all of them. With fewer than 20 new ones none is
/// added and `report->used` is 0. Sets the matches, rows, noise and depth of the report.
/// ERROR_MEMORY.
int adjust_pair_match(const struct adjust_picture *picture, struct arena *arena,
                      struct adjustment *adjustment, struct adjust_tracks *tracks,
                      struct adjust_report *report);
size_t adjust_pair_match_need_bytes(int width, int height);

/// The sigmas and the health of a report, of a state of `adjustment` after its pair was matched.
void adjust_pair_assess(const struct adjust_picture *picture, const struct adjustment *adjustment,
                        struct adjust_report *report);

/// Matches the pair and corrects `adjustment`, begun with the pair's state. With fewer than 20
/// matches that fit, nothing is corrected (`report->used` is 0). ERROR_MEMORY.
int adjust_pair(const struct adjust_picture *picture, struct arena *arena,
                struct adjustment *adjustment, struct adjust_report *report);
size_t adjust_pair_need_bytes(int width, int height);

/// The calibration of a pair's pictures as they are, from a solved state and its assessed report.
/// Errors of zoom_calibration_at.
int adjust_conclude(const struct zoom_calibration *calibration,
                    const struct adjust_picture *picture, const struct adjustment *adjustment,
                    const struct adjust_report *report, struct calibration *result,
                    struct calibration_fault *fault);

/// The pair's calibration for its pictures as they are, from a calibration of any zoom: adjusted as
/// far as the pictures allow, with its remaining uncertainty. Errors of zoom_calibration_at.
int adjust_calibration(const struct zoom_calibration *calibration,
                       const struct adjust_picture *picture, struct arena *arena,
                       struct calibration *result, struct adjust_report *report,
                       struct calibration_fault *fault);
size_t adjust_calibration_need_bytes(int width, int height);

#ifdef __cplusplus
}
#endif

#endif
