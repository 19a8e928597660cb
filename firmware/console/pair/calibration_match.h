// SPDX-License-Identifier: Apache-2.0
/// Checks that a calibration belongs to a pair: same instrument and cameras, same sensor window,
/// and every axis where it was during calibration. A servo that is 0.9 degrees off moves a mug at
/// 1.8 m by 104 mm in depth, and no image shows it.
#ifndef VERGENCE_CONSOLE_PAIR_CALIBRATION_MATCH_H
#define VERGENCE_CONSOLE_PAIR_CALIBRATION_MATCH_H

#include <stdbool.h>

#include "console/pair/calibration_reply.h"
#include "console/pair/pair_instrument.h"
#include "core/message.h"
#include "rig/base/profile.h"
#include "rig/pair.h"
#include "rig/rig.h"
#include "stereo/geometry/calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What a pair was taken with, or the current state of the instrument.
struct calibration_match_state {
    struct calibration_origin origin;
    int width_px[RIG_SIDES], height_px[RIG_SIDES];  // size of the frames
    struct pair_instrument instrument;              // how far each axis repeats
};

/// Whether two positions of an axis, in its unit, differ by more than its repeatability.
bool calibration_match_is_apart(const struct pair_instrument *instrument, int axis, double one,
                                double other);

/// The instrument that a profile describes; its cameras are unknown.
struct pair_instrument calibration_match_instrument(const struct rig_profile *profile);

/// The angle of a servo's pulse; false: the instrument states none.
bool calibration_match_pan_deg(const struct pair_instrument *instrument, int side, double pulse_q4,
                               double *deg);

/// The state in which a session's pair was taken. If `instrument` is NULL (the session does not
/// record it), the built-in profile named `profile` is used if it exists.
void calibration_match_pair(const char *profile, const struct pair_instrument *instrument,
                            const struct pair *pair, struct calibration_match_state *state);

/// The state in which a rig was read last.
void calibration_match_now(const struct rig *rig, const struct pair_instrument *instrument,
                           struct calibration_match_state *state);

/// ERROR_MISMATCH if the calibration was made with another instrument, other cameras or another
/// window, or if an axis is further from its calibrated position than its repeatability. `message`
/// then names the axis, both values and the remedy; `accept` is the option or argument that accepts
/// the mismatch (NULL: already accepted, no advice is given). A servo that was not set since
/// bring-up is rejected too, as its position is unknown. Other values that only one side knows are
/// not compared. A calibration of the whole sensor fits every window of it.
int calibration_match(const struct calibration *calibration,
                      const struct calibration_match_state *state, const char *accept,
                      struct message *message);

/// Gives a state the calibration's instrument and cameras, where those that differ were accepted,
/// so that the rest can be compared.
void calibration_match_assume(const struct calibration *calibration,
                              struct calibration_match_state *state);

/// Whether an axis is known on one side only, so that it cannot be compared.
bool calibration_match_is_partial(const struct calibration *calibration,
                                  const struct calibration_origin *now);

/// Standard deviation in mm that all points at `depth_mm` share: that of the calibration, plus the
/// repeatability of the calibrated axes. `instrument` NULL: the built-in rig. Negative if the
/// calibration states neither. Pan: dz = z^2 / baseline * dangle for each camera. Zoom: dz = z * df
/// / f, with the mean of the two cameras, in the image centre, where zoom does not turn the view.
/// Focus and iris are not included. `now`: where the axes are; what was moved since the calibration
/// adds its effect. NULL: not known.
double calibration_match_sigma_mm(const struct calibration *calibration,
                                  const struct pair_instrument *instrument,
                                  const struct calibration_origin *now, double depth_mm);

#ifdef __cplusplus
}
#endif

#endif
