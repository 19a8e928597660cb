// SPDX-License-Identifier: Apache-2.0
/// Shared by the two replay modes: not for users of replay.h.
#ifndef VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_CALLS_H
#define VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_CALLS_H

#include "daemon/backends/replay/replay.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Checks calls.log, reads its header and sets the ports. 0, or an error as for replay_open.
int replay_calls_open(struct replay *self, struct message *message);

/// Consumes a mark (trace_idle, trace_cancel) of the log if it comes next.
bool replay_calls_take_mark(struct replay *self, void (*print)(char *text));

/// Reads all pairs of the session and sets up two cameras and a clock.
int replay_pairs_open(struct replay *self, struct message *message);

/// Lends a frame with the pixels of `frame`. 0, ERROR_MEMORY (two are lent already, or out of
/// memory) or an error of session_reader_frame, with `trouble` set.
int replay_camera_lend(struct replay_camera *camera, const struct pair_frame *form, uint32_t crc32,
                       struct hal_camera_frame *frame);
void replay_camera_take_back(struct replay_camera *camera, const struct hal_camera_frame *frame);

#ifdef __cplusplus
}
#endif

#endif
