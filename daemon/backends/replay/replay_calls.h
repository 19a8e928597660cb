// SPDX-License-Identifier: Apache-2.0
/// What the two ways of playing share: not for users of replay.h.
#ifndef VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_CALLS_H
#define VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_CALLS_H

#include "daemon/backends/replay/replay.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Checks calls.log, reads its head, and sets the ports. 0 or an error as replay_open.
int replay_calls_open(struct replay *self, struct message *message);

/// Takes a mark (trace_idle, trace_cancel) off the log if it comes next.
bool replay_calls_take_mark(struct replay *self, void (*print)(char *text));

/// Reads all pairs of the session and sets two cameras and a clock.
int replay_pairs_open(struct replay *self, struct message *message);

/// A frame to lend, with the pixels of `frame`; 0, ERROR_MEMORY (two are lent already, or there is
/// no memory) or an error of session_reader_frame, with `trouble` set.
int replay_camera_lend(struct replay_camera *camera, const struct pair_frame *form, uint32_t crc32,
                       struct hal_camera_frame *frame);
void replay_camera_take_back(struct replay_camera *camera, const struct hal_camera_frame *frame);

#ifdef __cplusplus
}
#endif

#endif
