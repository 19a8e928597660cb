// SPDX-License-Identifier: Apache-2.0
/// `vergence reconstruct --all`: every pair of a session, or of the sessions in a directory, in one
/// process. The results of pair 3 of the session `scene` go to OUT/0003, or OUT/scene/0003 if the
/// operand is a directory of sessions. OUT/pairs.json has a row for each pair and says what the
/// results were made with, so that a later run keeps those that would be the same.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_ALL_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_ALL_H

#include "daemon/cli/progress.h"
#include "daemon/surface/reconstruct_job.h"
#include "daemon/surface/reconstruct_session.h"
#include "daemon/surface/result/pairs_table.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Fills the zeroed table: all pairs of the sessions, or directories of sessions, at `paths`, with
/// what an earlier run has made of them. `more`: what the results depend on besides the request.
/// Of several paths a session's results go to OUT/scene/0003, too. The table is to be freed in any
/// case. 0, or errors with `message` set.
int reconstruct_all_begin(const struct reconstruct_request *request, const char *const *paths,
                          int count, const char *more, struct pairs_table *table,
                          struct message *message);

/// Runs it with the request's session and output directory, and prints the table. `session` has
/// the members that do not depend on the pair; `progress` is what `caller` shows. Returns 0 if all
/// pairs have results; else ERROR_CANCELLED, ERROR_FULL, or the error of the first pair that has
/// none: the errors of reconstruct_job_run. Each failure is one line on standard error.
int reconstruct_all_run(const struct reconstruct_program *program,
                        const struct reconstruct_request *request,
                        const struct reconstruct_caller *caller,
                        struct reconstruct_session *session, struct progress *progress);

#ifdef __cplusplus
}
#endif

#endif
