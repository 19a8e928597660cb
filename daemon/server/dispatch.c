// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/dispatch.h"

#include <stdio.h>

#include "core/error.h"
#include "core/invariant.h"

void dispatch_answer(struct dispatch *self, struct job *job, int error, const char *message) {
    INVARIANT(error <= 0 && message != NULL);
    const struct reply_sink sink = output_sink(job->output);
    reply_begin(&self->reply, &sink, &job->request, job->terminal);
    self->reply.bar_columns = job->bar_columns;
    reply_end(&self->reply, error, message);
}

int dispatch_parse(struct dispatch *self, const char *line, struct job *job, char *message,
                   size_t message_bytes) {
    const struct daemon *daemon = self->daemon;
    snprintf(job->line, sizeof job->line, "%s", line);
    return command_parse(line, daemon->table.rows, daemon->table.count, job->storage, job->values,
                         &job->command, message, message_bytes);
}

void dispatch_submit(struct dispatch *self, struct job *job) {
    const bool general = (job->command->flags & COMMAND_NO_RIG) != 0;
    struct daemon *daemon = self->daemon;
    INVARIANT(atomic_load(&job->state) == JOB_WAITING);
    if (!worker_submit(general ? &daemon->general_worker : &daemon->rig_worker, job)) {
        atomic_store(&job->state, JOB_FREE);
        dispatch_answer(self, job, ERROR_BUSY, "too many commands are waiting: try again later");
    }
}
