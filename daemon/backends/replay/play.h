// SPDX-License-Identifier: Apache-2.0
/// Runs a recording's commands again on an instrument that is backed only by the recorded calls,
/// and compares the pairs with the recorded ones.
///
/// A command depends only on the answers of the hardware, so the same build makes the same calls
/// and gives bit-identical pairs. With another build the first difference is reported.
#ifndef VERGENCE_DAEMON_BACKENDS_REPLAY_PLAY_H
#define VERGENCE_DAEMON_BACKENDS_REPLAY_PLAY_H

#include <stdbool.h>
#include <stdint.h>

#include "daemon/base/message.h"
#include "daemon/session/session.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Observer of a replay; any pointer may be NULL.
struct play_observer {
    bool (*should_stop)(void *self);  ///< return true to end soon with ERROR_CANCELLED
    void (*progress)(void *self, const char *what, uint32_t done, uint32_t total);
    void *self;
};

/// The result.
struct play_outcome {
    /// Build and profile of the recorder.
    char build[SESSION_NAME_MAX + 1], profile[SESSION_NAME_MAX + 1];
    uint32_t commands, calls, pairs;  ///< numbers of successful comparisons
    bool same;                        ///< everything matched
    bool cut;  ///< the recording was cut off (a kill, a full disk) and replayed up to there
    uint32_t command, call;   ///< position of the first difference, from 1; 0: none
    struct message mismatch;  ///< the difference; "" if there is none
};

/// Replays the session `path`, relative to the descriptor `parent` as for openat(2). Returns 0 if
/// it was replayed, with the result in `*outcome`; ERROR_CANCELLED; ERROR_MISSING: not a recording,
/// or no command in it is complete; other errors of replay_open, with `message` set.
int play_session(int parent, const char *path, const struct play_observer *observer,
                 struct play_outcome *outcome, struct message *message);

#ifdef __cplusplus
}
#endif

#endif
