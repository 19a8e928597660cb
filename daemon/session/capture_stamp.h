// SPDX-License-Identifier: Apache-2.0
/// The circumstances of a captured pair, as every result that is made of it carries them: which
/// session and pair, how far apart in time its frames were, and how the cameras stood.
#ifndef VERGENCE_DAEMON_SESSION_CAPTURE_STAMP_H
#define VERGENCE_DAEMON_SESSION_CAPTURE_STAMP_H

#include "daemon/base/json.h"
#include "rig/pair.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { CAPTURE_STAMP_LINES = 1 + RIG_SIDES, CAPTURE_STAMP_BYTES = 512 };

/// A pair of a session; what both point to must outlive the stamp. Pixels are not looked at.
struct capture_stamp {
    const char *session;      ///< its name; NULL: the images are of no session
    const struct pair *pair;  ///< its `number` is its place in the session, from 1
};

/// The line `line` (0: the pair, then the left and the right camera) for comments of a file and for
/// people: one line whatever the session is called, without an end. What nobody knows is left
/// out.
void capture_stamp_line(const struct capture_stamp *stamp, int line,
                        char text[CAPTURE_STAMP_BYTES]);

/// The same as the member "capture" of an object that is open; null for images of no session, and
/// for each value that nobody knows. Positions are arrays: before the pair, and after it.
void capture_stamp_json(const struct capture_stamp *stamp, struct json *json);

#ifdef __cplusplus
}
#endif

#endif
