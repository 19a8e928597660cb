// SPDX-License-Identifier: Apache-2.0
/// Turns the lines of clients into commands of the table, and these into jobs of the workers. For
/// the event loop's thread.
#ifndef VERGENCE_DAEMON_SERVER_DISPATCH_H
#define VERGENCE_DAEMON_SERVER_DISPATCH_H

#include <stddef.h>

#include "daemon/server/daemon.h"

struct dispatch {
    struct daemon *daemon;
    struct reply reply;  ///< used for answers that do not come from a worker
};

/// Parses a command line into `job`, see command_parse.
int dispatch_parse(struct dispatch *self, const char *line, struct job *job, char *message,
                   size_t message_bytes);
/// Queues the job. If the queue is full, answers with an error and sets the job to JOB_FREE.
void dispatch_submit(struct dispatch *self, struct job *job);
/// Answers at once, with an error or (0) with success; no worker has the job.
void dispatch_answer(struct dispatch *self, struct job *job, int error, const char *message);

#endif
