// SPDX-License-Identifier: Apache-2.0
/// A command of a client on its way: parsed by the event loop, carried out by a crew. Each
/// connection has one, so a client's commands run one after the other.
#ifndef VERGENCE_DAEMON_REPLY_JOB_H
#define VERGENCE_DAEMON_REPLY_JOB_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "console/command.h"
#include "daemon/reply/output.h"
#include "daemon/reply/request.h"

enum { JOB_MESSAGE_BYTES = 1024, JOB_LINE_BYTES = REQUEST_PREFIX_MAX + COMMAND_LINE_MAX + 2 };

/// The client of a job has not been told that it waits.
#define JOB_NOT_SHOWN UINT32_MAX

enum job_state {
    JOB_FREE,     ///< the event loop's
    JOB_WAITING,  ///< in a crew's queue, or under way; the crew's
    JOB_DONE,     ///< the event loop's again: the answer is in the output
};

/// A command that is repeated.
struct job_watch {
    bool on;
    uint64_t interval_us;
    uint32_t rounds_left;  ///< 0: until it is cancelled
    char line[COMMAND_LINE_MAX + 1];
};

struct job {
    atomic_int state;       ///< enum job_state
    atomic_bool cancelled;  ///< by the client
    struct output *output;
    bool terminal;
    struct request request;
    const struct command *command;
    char line[COMMAND_LINE_MAX + 1];  ///< as it was given
    char storage[COMMAND_LINE_MAX + 1];
    struct command_value values[COMMAND_ARGUMENTS_MAX];
    struct job_watch watch;
    bool round;  ///< this is a round of `watch`: no answer unless it fails or is the last
    bool quit;   ///< the connection is to end

    // While it waits for others'; both threads', under the lock of the crew.
    uint64_t queued_us;    ///< monotonic; since when
    uint32_t ahead;        ///< commands that stood before it then
    uint32_t ahead_shown;  ///< of them, when its client was told last; JOB_NOT_SHOWN
    bool bar_shown;        ///< on its terminal, which the answer is to wipe
};

#endif
