// SPDX-License-Identifier: Apache-2.0
/// Whether a calibration belongs to a pair: the same instrument and cameras, the same part of the
/// sensors, and every axis where it stood when the calibration was made. A servo that is 0.9
/// degrees away makes a mug at 1.8 m 104 mm nearer or farther, and no picture shows it.
#ifndef VERGENCE_DAEMON_SESSION_CALIBRATION_MATCH_H
#define VERGENCE_DAEMON_SESSION_CALIBRATION_MATCH_H

#include <stdbool.h>

#include "daemon/base/message.h"
#include "daemon/session/session.h"
#include "rig/profile.h"
#include "stereo/geometry/calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What a pair was taken with, or what the instrument is now.
struct calibration_match_state {
    struct calibration_origin origin;
    int width_px[RIG_SIDES], height_px[RIG_SIDES];  // of the frames
    struct session_instrument instrument;           // how far each axis repeats
};

/// Name and unit of an axis (enum calibration_axis_name). Static storage.
const char *calibration_match_axis_name(int axis);
const char *calibration_match_axis_unit(int axis);

/// Whether two places of an axis, in its unit, are further apart than it repeats.
bool calibration_match_is_apart(const struct session_instrument *instrument, int axis, double one,
                                double other);

/// The instrument of a profile; its cameras are not known.
struct session_instrument calibration_match_instrument(const struct rig_profile *profile);

/// What a session's pair was taken with. `instrument` NULL: the session does not say, and the
/// built-in profile of the name `profile` stands for it where there is one.
void calibration_match_pair(const char *profile, const struct session_instrument *instrument,
                            const struct pair *pair, struct calibration_match_state *state);

/// ERROR_MISMATCH when the calibration belongs to another instrument, other cameras or another
/// window, or an axis is further from where it was calibrated than it repeats: `message` names it,
/// both values, and what to do, where `accept` is how a user continues all the same (NULL: it is
/// accepted, and nothing is advised). A servo that was not set since the bring-up may stand
/// anywhere, and is refused as well; what else either side does not know is not compared. A
/// calibration of the whole sensor fits every window of it.
int calibration_match(const struct calibration *calibration,
                      const struct calibration_match_state *state, const char *accept,
                      struct message *message);

/// Whether an axis is known on one side of the comparison alone, so that it cannot be compared.
bool calibration_match_is_partial(const struct calibration *calibration,
                                  const struct calibration_origin *now);

/// Standard deviation in mm that all points at `depth_mm` share: the calibration's own, and how
/// well the axes that were calibrated repeat. `instrument` NULL: the built-in rig's. Negative when
/// the calibration says nothing of either. Pan: dz = z^2 / baseline * dangle for each camera. Zoom:
/// dz = z * df / f, of the two cameras' mean; in the middle of the image, where it does not turn
/// the view. Focus and iris are not part of it.
double calibration_match_sigma_mm(const struct calibration *calibration,
                                  const struct session_instrument *instrument, double depth_mm);

#ifdef __cplusplus
}
#endif

#endif
