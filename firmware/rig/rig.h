// SPDX-License-Identifier: Apache-2.0
/// The instrument: its parts, settings and state. It allocates no memory and calls no system
/// function: everything comes through the interfaces of hal/.
///
/// Only one thread at a time may call these functions. Every wait has a deadline on `clock`, calls
/// the observer at least every 100 ms, and feeds the bridge's watchdog meanwhile. After an error of
/// a part, `last_error` names it. Functions that move something then leave the rig in its safe
/// state: servos at rest or where they are, motors stopped, streams off.
#ifndef VERGENCE_RIG_RIG_H
#define VERGENCE_RIG_RIG_H

#include <stdint.h>

#include "rig/base/rig_state.h"
#include "rig/safe.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The interface that this profile requires but the ports do not have, such as "an I2C bus"; NULL:
/// none is missing. Static storage.
const char *rig_ports_missing(const struct rig_profile *profile, const struct rig_ports *ports);

/// Copies profile, ports and observer (NULL: none). Does not touch any device. The profile must
/// pass rig_profile_check, and the ports must have every interface that it requires.
void rig_init(struct rig *self, const struct rig_profile *profile, const struct rig_ports *ports,
              const struct rig_observer *observer);

/// Finds and identifies every part of the profile and sets it to a known state. Does not centre the
/// servos: they stay where they are until the first rig_pan. If a part is missing, the others are
/// still checked, so that one run shows all problems; the rig is then RIG_SAFE, and the error is
/// that of the first.
int rig_bringup(struct rig *self);

/// Call at least every 100 ms while no other call runs: feeds the bridge's watchdog, and detects a
/// bridge that has restarted or gone (ERROR_RESTARTED, ERROR_I2C_NACK; the rig is then RIG_SAFE).
int rig_serve(struct rig *self);

/// The same between commands, when in virtual time the clock decides whether anything is due.
int rig_idle(struct rig *self);

/// Checks all parts without moving any, and updates `health`. Returns the first error.
int rig_check(struct rig *self);

/// Turns a camera to an angle in radians * 1e6 from its middle, positive to +x (right). Waits until
/// it has stopped. The horn's last step comes from three dead bands below. Measured in the
/// simulated rig (dead band 3 us = 0.29 degrees; 30 moves of 2 servos, half of them of up to 1.1
/// degrees): an error of at most 0.01 degrees without the servo's repeatability, and of 0.29
/// without the approach from below; with a repeatability of 0.3 degrees rms, which cannot be
/// corrected, 0.30 rms. Within three dead bands of the servo's lower limit there is no room for the
/// approach. The horn has no position sensor: a servo that is jammed or has no supply is not
/// detected, and ERROR_JAMMED does not occur. ERROR_RANGE: outside the limits of profile or servo;
/// ERROR_TIMEOUT: the bridge does not send the width. After ERROR_CANCELLED the servos stay where
/// they were.
int rig_pan(struct rig *self, unsigned side, int32_t angle_urad);
/// Turns both cameras at once; if one angle is rejected, neither moves.
int rig_pan_both(struct rig *self, int32_t left_urad, int32_t right_urad);
/// Reads the angle at which the bridge has the servo now.
int rig_pan_read(struct rig *self, unsigned side, int32_t *angle_urad);

/// Moves an axis of a lens (of both lenses at once if `sides` is 3; bits RIG_LEFT, RIG_RIGHT) to a
/// position, from the profile's side because of backlash, and waits until it has arrived.
/// ERROR_JAMMED: no movement; ERROR_TIMEOUT: it does not arrive, or its controller does not answer;
/// for details and times see rig/lens_move.h. On any error all motors are at rest, but for those of
/// a controller that does not answer: they end where they were sent, within their range.
int rig_lens_move_to(struct rig *self, unsigned sides, enum lens_axis axis, int32_t position);
/// The same, with a position for each side; that of a side that does not move is not read. If one
/// is rejected, neither moves.
int rig_lens_move_each(struct rig *self, unsigned sides, enum lens_axis axis,
                       const int32_t positions[RIG_SIDES]);
/// Reads the positions of a lens at rest `readings` times (1 .. 32; each takes about 60 ms), for
/// their means without outliers, and stores these in `measured`.
int rig_lens_read_mean(struct rig *self, unsigned side, unsigned readings,
                       struct lens_mean means[LENS_AXES]);
/// The mean in whole counts; INT32_MIN as there.
int32_t lens_mean_counts(const struct lens_mean *mean);
/// The same means of RIG_LENS_READINGS readings, in whole counts; INT32_MIN: no such axis.
int rig_lens_read(struct rig *self, unsigned side, int32_t positions[LENS_AXES]);
int rig_lens_limits(struct rig *self, unsigned side, enum lens_axis axis,
                    struct lens_limits *limits);

/// Position of an axis at a time, such as that of an exposure, in 1/16 count, and its standard
/// error: from the readings that moves and rig_lens_read take, with their times. At rest their
/// mean, while it moves a line through those around the time (focus/position_fit.h): a time is best
/// asked for when four more readings have come. The position is that of the motor on the
/// potentiometer's scale. While it moves in the direction in which targets are approached, the ring
/// follows as it does at its targets; in the other direction it is off by the play.
///
/// Measured with the simulated motors and line (motion_lens_track_test, 200 sweeps a row), rms/max
/// in counts; "turns": within 0.3 s of a start or stop:
///
///                                 readings/s   moves         turns         after the move
///   one lens moves, 150 counts/s  18           0.41  3.6     0.74   5.5    0.60  1.9
///   one lens moves, 200 counts/s  18           0.42  2.8     0.91   9.0    0.58  1.7
///   both move, 150 counts/s        8.6         0.44  2.4     1.2   13      0.60  1.9
///   both move, 200 counts/s        8.5         0.42  2.2     1.0   12      0.57  2.0
///
/// These errors over the reported standard errors: 1.1 rms while it moves, 1.4 where it turns.
///
/// ERROR_NOT_CONNECTED: the side has no such axis; ERROR_NOT_READY: there is no reading at this
/// time or later yet (step the move, or read); ERROR_MISSING: there are none near it, or it was too
/// long ago (the last 32 are kept); ERROR_UNSUPPORTED: the axis moves, and the controller has no
/// position sensors.
int rig_lens_position_at(const struct rig *self, unsigned side, enum lens_axis axis,
                         uint64_t time_us, int32_t *position_q4, uint16_t *sigma_q4);

/// Set exposure (1 .. RIG_EXPOSURE_MAX_US) and gain of one or both cameras (`sides` as above).
/// `*applied`: the nearest possible value, also that of an exposure that a camera rejects with
/// ERROR_RANGE, if it reports one. ERROR_RANGE and ERROR_UNSUPPORTED of a camera: `rejected` has
/// the details.
int rig_exposure(struct rig *self, unsigned sides, uint32_t exposure_us, uint32_t *applied_us);
int rig_gain(struct rig *self, unsigned sides, uint16_t gain_q3, uint16_t *applied_q3);

/// Sets the focus of a camera that has a focus control of its own (`focus_steps` of struct
/// rig_camera): 0 .. 1000 of its range, larger values nearer, as V4L2 has it. Frames
/// count again after the time that such lenses take. ERROR_RANGE; ERROR_UNSUPPORTED: no focus
/// control.
int rig_focus_part(struct rig *self, unsigned side, int32_t part, int32_t *applied);

/// Sets the part of the sensor that frames show: centred, every `skip`-th pixel. Behind the bridge:
/// multiples of 2 * `skip` up to the whole sensor, else ERROR_RANGE. A camera with its own port has
/// a list of sizes and no `skip`, else ERROR_UNSUPPORTED; `rejected` has the details.
int rig_window(struct rig *self, uint16_t width_px, uint16_t height_px, uint8_t skip);
/// The same anywhere on the sensors of `sides` behind the bridge (`where_px`: of the whole sensor;
/// column and row even). The windows of both sides have the same size and `skip`, so those of one
/// side must be those in force; else ERROR_RANGE. ERROR_UNSUPPORTED: cameras with their own ports.
int rig_window_at(struct rig *self, unsigned sides, const struct rig_rectangle *where_px,
                  uint8_t skip);

#ifdef __cplusplus
}
#endif

#endif
