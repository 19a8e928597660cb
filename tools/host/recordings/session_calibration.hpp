// SPDX-License-Identifier: Apache-2.0
/// The calibration of a session's pair, for the frames as they were recorded.
#ifndef VERGENCE_TOOLS_HOST_RECORDINGS_SESSION_CALIBRATION_HPP
#define VERGENCE_TOOLS_HOST_RECORDINGS_SESSION_CALIBRATION_HPP

#include "daemon/session/session_pairs.h"

/// The calibration of the pair that `pairs` found last: that of the file `path` ("": the pair's
/// own). It is cut to the frames' part of the sensor, and then reduced to frames of 1/`shrink` of
/// their size. 0, or errors with `last_error` set: ERROR_MISSING if there is none,
/// ERROR_SIZE_MISMATCH, and those of the calibration's text.
int session_calibration(const session_reader &reader, const session_pairs &pairs, const char *path,
                        int shrink, calibration *value, message *last_error);

#endif
