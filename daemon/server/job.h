// SPDX-License-Identifier: Apache-2.0
/// A client's command: parsed by the event loop, run by a worker. Each connection has one job, so
/// a client's commands run one after the other.
#ifndef VERGENCE_DAEMON_SERVER_JOB_H
#define VERGENCE_DAEMON_SERVER_JOB_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "console/command.h"
#include "daemon/server/output.h"
#include "daemon/server/request.h"

enum { JOB_MESSAGE_BYTES = 1024, JOB_LINE_BYTES = REQUEST_PREFIX_MAX + COMMAND_LINE_MAX + 2 };

/// Value of `ahead_shown`: the client has not been informed that its job waits.
#define JOB_NOT_SHOWN UINT32_MAX

struct worker;

enum job_state {
    JOB_FREE,     ///< owned by the event loop
    JOB_WAITING,  ///< queued or running; owned by the worker
    JOB_DONE,     ///< the answer is in the output; owned by the event loop
};

/// A command repeated by `watch`.
struct job_watch {
    bool on;
    uint64_t interval_us;
    uint32_t rounds_left;  ///< 0: until cancelled
    char line[COMMAND_LINE_MAX + 1];
};

struct job {
    atomic_int state;       ///< enum job_state
    atomic_bool cancelled;  ///< by the client
    struct worker *worker;  ///< runs it
    struct output *output;
    bool terminal;
    struct request request;
    const struct command *command;
    char line[COMMAND_LINE_MAX + 1];  ///< as entered
    char storage[COMMAND_LINE_MAX + 1];
    struct command_value values[COMMAND_ARGUMENTS_MAX];
    struct job_watch watch;
    bool round;  ///< a round of `watch`: answered only if it fails or is the last
    bool quit;   ///< close the connection

    // While it is queued. Used by both threads, under the worker's lock.
    uint64_t queued_us;    ///< monotonic time at which it was queued
    uint32_t ahead;        ///< commands before it at that time
    uint32_t ahead_shown;  ///< last number shown to the client, or JOB_NOT_SHOWN
    int bar_columns;       ///< width of a bar on its terminal, to be erased by the answer; 0: none
};

#endif
