// SPDX-License-Identifier: Apache-2.0
/// One reconstruction from its inputs to a directory of results that appears whole or not at all:
/// shared by `vergence reconstruct` and the console's `reconstruct`. The caller supplies the source
/// of the images, the writers and an observer.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_JOB_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_JOB_H

#include "daemon/files/atomic_dir.h"
#include "daemon/surface/reconstruct_inputs.h"
#include "daemon/surface/reconstruct_outputs.h"
#include "daemon/surface/reconstruct_request.h"
#include "daemon/surface/result/reconstruct_context.h"
#include "stereo/reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    /// The stages that progress is reported for: enum reconstruct_stage, then writing the results.
    RECONSTRUCT_WORK_WRITE = RECONSTRUCT_STAGES,
    RECONSTRUCT_WORK_STAGES,
};

/// What every build can write: no images, no report.
extern const struct reconstruct_outputs reconstruct_outputs_plain;

/// Who runs a job: where its inputs come from and who observes it. All functions are called on the
/// thread that runs the job.
struct reconstruct_caller {
    /// Provides what the request asks for and adds assumptions and doubts to the context's
    /// warnings. Returns 0, or a negative error code with `message` set and nothing to free. What
    /// `source` points to stays valid until the job ends.
    int (*read)(void *source, const struct reconstruct_request *request,
                struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                struct message *message);
    void *source;
    /// True: the job should end soon with ERROR_CANCELLED. NULL: only signals end it.
    bool (*should_stop)(void *self);
    /// Relative work of the stages 0 to `stages` - 1, before they begin. NULL: not wanted.
    void (*expect)(void *self, const double *work_ns, int stages);
    /// `done` of `total` parts of a stage are done; `what` has static storage.
    void (*progress)(void *self, int stage, const char *what, int done, int total);
    void *self;
};

/// The caller sets the first group of members, zeroes the rest, and owns everything pointed to.
struct reconstruct_job {
    const struct reconstruct_outputs *outputs;
    const struct reconstruct_request *request;
    const struct reconstruct_texts *texts;
    const struct reconstruct_caller *caller;
    /// Check before the work that there is room for it and its files, which go into the directory
    /// `files` with its limit, see free_space_now.
    bool check_space;
    int files;
    uint64_t files_limit_bytes;

    struct reconstruct_context context;  // after a run: everything about it
    struct message message;              // after a failed run: the reason

    struct reconstruct_inputs inputs;
    struct reconstruct_options options;
    struct reconstruct_result result;
    struct reconstruct_mesh mesh;
    struct atomic_dir directory;
    struct reconstruct_debug debug;
    struct workers *workers;
    void *memory;
    size_t memory_bytes;
    uint64_t start_us;
};

/// Runs the job. Returns 0, or an error with `message` set, in which case nothing of it exists
/// under the output's name: ERROR_CANCELLED, ERROR_NO_SURFACE, ERROR_MEMORY, ERROR_BUFFER (results
/// could not be written; ERROR_FULL: no space), or errors of the inputs. reconstruct_job_end is
/// required in any case.
int reconstruct_job_run(struct reconstruct_job *job);

/// Frees everything; `context` is invalid afterwards.
void reconstruct_job_end(struct reconstruct_job *job);

#ifdef __cplusplus
}
#endif

#endif
