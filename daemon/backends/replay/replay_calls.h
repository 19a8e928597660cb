// SPDX-License-Identifier: Apache-2.0
/// Shared by the two replay modes: not for users of replay.h.
#ifndef VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_CALLS_H
#define VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_CALLS_H

#include "daemon/backends/replay/replay_camera.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Checks calls.log, reads its header and sets the ports. 0, or an error as for replay_open.
int replay_calls_open(struct replay *self, struct message *message);

/// Consumes a mark (trace_idle, trace_cancel) of the log if it comes next.
bool replay_calls_take_mark(struct replay *self, void (*print)(char *text));

/// Reads all pairs of the session and sets up two cameras and a clock.
int replay_pairs_open(struct replay *self, struct message *message);

#ifdef __cplusplus
}
#endif

#endif
