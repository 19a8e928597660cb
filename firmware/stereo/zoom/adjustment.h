// SPDX-License-Identifier: Apache-2.0
/// What pictures show about the cameras that took them. The unknowns are small corrections of each
/// camera at each state of the motors (a view); their prior follows from the calibration: the
/// covariance of its parameters, the irregularity of its functions, and the motors' deviations, of
/// which drift and pan are common to all states. Observations of the same points in several views
/// then give the most probable corrections and the covariance that remains: what no picture shows
/// keeps the sigma of the prior.
#ifndef VERGENCE_STEREO_ZOOM_ADJUSTMENT_H
#define VERGENCE_STEREO_ZOOM_ADJUSTMENT_H

#include "core/arena.h"
#include "core/parallel.h"
#include "stereo/zoom/adjust_target.h"

#ifdef __cplusplus
extern "C" {
#endif

struct adjustment {
    int views, terms;
    // Views before and after the correction.
    struct camera_view nominal[ADJUST_VIEWS_MAX], view[ADJUST_VIEWS_MAX];
    double correction[ADJUST_TERMS_MAX];
    double
        pull[ADJUST_TERMS_MAX];    // pull of the observations on each correction, against the prior
    struct adjust_target *target;  // placed target in view; NULL: none
    struct watch watch;
    double *prior;      // terms x terms: covariance = prior prior^T, lower triangle
    double *posterior;  // the same, of what remains
    double *work;       // three of that size; the first: normal equations of the last fit
};

/// A point that several views see.
struct adjust_track {
    int count;
    int view[ADJUST_SEEN_MAX];
    double pixel_px[ADJUST_SEEN_MAX][2];
    struct far_point point;
    bool at_infinity;  // known to be: both cameras see it in one direction
    bool is_placed;    // `point` is where a fit before has put it
    double sigma_px;   // standard deviation of one coordinate of an observation
    double residual;   // rms in px of the last fit, of what the point cannot absorb
    bool rejected;
};

/// Views and prior of `states` <= ADJUST_STATES_MAX states. Pan is untouched between states. Takes
/// its memory from the arena. ERROR_MEMORY.
int adjustment_begin(const struct zoom_calibration *calibration, const struct zoom_state *state,
                     int states, struct arena *arena, struct adjustment *adjustment);
size_t adjustment_need_bytes(int states);

/// Places a point where its first two observations meet, then fits all of them. False if the point
/// is behind a camera, or a lens does not see it.
bool adjustment_track_place(const struct adjustment *adjustment, struct adjust_track *track);

/// The residual of a track of two observations in px, signed, and its derivatives with respect to
/// the corrections of the two views, so that only what the point cannot absorb remains. False if
/// the point cannot be placed.
bool adjustment_track_epipolar(const struct adjustment *adjustment, struct adjust_track *track,
                               double *residual_px, double derivative[2 * VIEW_TERMS]);

/// The corrections that fit the tracks, from the present ones on, with Cauchy weights. Tracks with
/// `rejected` set are not used. Returns the number of tracks used; with none, the prior is back.
int adjustment_solve(struct adjustment *adjustment, struct adjust_track *tracks, int count);

/// Standard deviation of `gradient` times the corrections, before and after.
double adjust_prior_sigma(const struct adjustment *adjustment, const double *gradient);
double adjust_posterior_sigma(const struct adjustment *adjustment, const double *gradient);

/// The most probable change of a term beside all corrections, and its standard deviation, from the
/// last fit: what the prior holds to be impossible, such as a camera that turned between states.
/// INFINITY: nothing shows it.
void adjust_extra_term(const struct adjustment *adjustment, int term, double *change,
                       double *sigma);

/// How much larger the corrections are than the calibration allows: the standard score of the sum
/// of their squares in independent parts of the prior, with as many degrees of freedom as the
/// pictures show. Beyond 4 the rig is not the one that was calibrated.
double adjust_chi_square_score(const struct adjustment *adjustment);

/// By how much what remains unknown is larger than the prior says, as the corrections are: Birge's
/// ratio, the square root of chi-square over its degrees of freedom; at least 1.
double adjust_birge_ratio(const struct adjustment *adjustment);

/// Gradient of the depth, in the left camera's frame, of the point that the views of a state see:
/// in the left view at `left_px`, at `depth_mm`.
bool adjustment_depth_gradient(const struct adjustment *adjustment, int state,
                               const double left_px[2], double depth_mm,
                               double gradient[ADJUST_TERMS_MAX]);

#ifdef __cplusplus
}
#endif

#endif
