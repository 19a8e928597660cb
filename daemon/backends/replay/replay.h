// SPDX-License-Identifier: Apache-2.0
/// Replays a recorded session as cameras, buses and clock. Two modes:
///
/// - calls.log (written by daemon/record): every call gets its recorded answer. A call that differs
/// from the recorded one ends the replay: `last_error` states in one line both calls and the place.
/// From then on calls fail with ERROR_IO and every wait returns at once, so that nothing hangs.
/// - pairs only (a session without calls.log): two cameras deliver the recorded frames in order,
/// for a profile without bridge, servos and lenses.
///
/// The same calls give the same bytes: the system time is not used.
#ifndef VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_H
#define VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_H

#include <stdbool.h>

#include "daemon/backends/replay/replay_camera.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Opens the session `path` (see session_reader_open) and checks calls.log up to the last line that
/// is certainly complete; anything a kill cut off after it is not replayed. Errors: those of
/// session_reader_open; ERROR_CRC, ERROR_VERSION, ERROR_MISSING (neither calls nor pairs).
/// `profile` (SESSION_NAME_MAX + 1 bytes; may be NULL) receives the name of the recorded profile.
/// The object is large and must not be moved while open.
int replay_open(struct replay *self, int parent, const char *path, char *profile,
                struct message *message);

/// Whether rig_idle was called at this point of the recording: then call it and ask again. Ask
/// before each command and at the end. Consumes the mark of record_idle.
bool replay_idle_is_next(struct replay *self);

/// Whether the recorded command was cancelled here: then `should_stop` of the rig's observer must
/// return true for the rest of the command. Consumes the mark of record_cancel.
bool replay_cancel_is_next(struct replay *self);

/// Whether every recorded call was made, or every pair was delivered.
bool replay_is_over(const struct replay *self);

/// Pairs only: both cameras show the next pair from now on. Call after a capture.
void replay_next_pair(struct replay *self);

/// Releases everything. Harmless after replay_open failed.
void replay_close(struct replay *self);

#ifdef __cplusplus
}
#endif

#endif
