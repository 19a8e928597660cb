// SPDX-License-Identifier: Apache-2.0
/// Where the images of a result came from: session and pair, time between the two frames, and axis
/// positions. Every result made from a captured pair carries it.
#ifndef VERGENCE_DAEMON_SESSION_CAPTURE_INFO_H
#define VERGENCE_DAEMON_SESSION_CAPTURE_INFO_H

#include "daemon/base/json.h"
#include "daemon/session/session.h"
#include "rig/pair.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { CAPTURE_INFO_LINES = 1 + RIG_SIDES, CAPTURE_INFO_BYTES = 512 };

/// A pair of a session; the pointers must outlive this. Pixels are not read.
struct capture_info {
    const char *session;      ///< its name; NULL: the images are not from a session
    const struct pair *pair;  ///< its `number` is its position in the session, from 1
    /// What took it, for the angles of its servos; NULL: unknown, pulses are stated instead.
    const struct pair_instrument *instrument;
};

/// Line `line` (0: the pair, 1: left camera, 2: right camera) for file comments and for people: a
/// single line without a line end, whatever the session's name. Unknown values are left out.
void capture_info_line(const struct capture_info *info, int line, char text[CAPTURE_INFO_BYTES]);

/// Writes the same as member "capture" of the open object; null for images that are not from a
/// session, and null for each unknown value. Positions are arrays: before the pair, after the pair.
void capture_info_json(const struct capture_info *info, struct json *json);

#ifdef __cplusplus
}
#endif

#endif
