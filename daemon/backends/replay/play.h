// SPDX-License-Identifier: Apache-2.0
/// Carries out a recording's commands again, on an instrument that has nothing but the recorded
/// calls behind it, and compares the pairs with the recorded ones.
///
/// What a command does depends on the answers of the hardware alone, so the same build gives the
/// same calls and the same pairs, to the last bit. Another build may not: then this says where.
#ifndef VERGENCE_DAEMON_BACKENDS_REPLAY_PLAY_H
#define VERGENCE_DAEMON_BACKENDS_REPLAY_PLAY_H

#include <stdbool.h>
#include <stdint.h>

#include "daemon/base/message.h"
#include "daemon/session/session.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Whoever watches; any pointer may be NULL.
struct play_observer {
    bool (*go_on)(void *self);  ///< false: end soon with ERROR_CANCELLED
    void (*progress)(void *self, const char *what, uint32_t done, uint32_t total);
    void *self;
};

/// What came out.
struct play_outcome {
    char build[SESSION_NAME_MAX + 1], profile[SESSION_NAME_MAX + 1];  ///< that recorded it
    uint32_t commands, calls, pairs;                                  ///< that were the same
    bool same;                                                        ///< all of them
    bool cut;  ///< the recording was cut off (a kill, a full disk); up to there it was played
    uint32_t command, call;   ///< of the first difference, from 1; 0: none
    struct message departed;  ///< what it was; "" when there is none
};

/// Plays the session `path`, as openat(2) understands it with the descriptor `parent`. 0: it was
/// played, with what came out in `*outcome`; ERROR_CANCELLED; ERROR_MISSING: it is no recording, or
/// not one command of it is whole;
/// others of replay_open, with `message` set.
int play_session(int parent, const char *path, const struct play_observer *observer,
                 struct play_outcome *outcome, struct message *message);

#ifdef __cplusplus
}
#endif

#endif
