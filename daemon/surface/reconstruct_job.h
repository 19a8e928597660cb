// SPDX-License-Identifier: Apache-2.0
/// One reconstruction from its inputs to a directory of results that appears whole or not at all:
/// shared by `vergence reconstruct` and the console's `reconstruct`. The caller supplies the source
/// of the images, the writers and an observer.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_JOB_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_JOB_H

#include "daemon/files/atomic_dir.h"
#include "daemon/surface/reconstruct_debug.h"
#include "daemon/surface/reconstruct_inputs.h"
#include "daemon/surface/reconstruct_request.h"
#include "daemon/surface/result/reconstruct_context.h"
#include "stereo/reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    RECONSTRUCT_JOB_WRITERS_MAX = 24,
    /// The stages that progress is reported for: enum reconstruct_stage, then writing the results.
    RECONSTRUCT_WORK_WRITE = RECONSTRUCT_STAGES,
    RECONSTRUCT_WORK_STAGES,
};

/// What can be written.
struct reconstruct_outputs {
    const struct result_writer *writers;  // run in this order; result.json must be last
    int writer_count;                     // 1..RECONSTRUCT_JOB_WRITERS_MAX
    /// Reads the ground truth and the mask that `context` names, so that unreadable files are
    /// rejected before the work; returns width and height. NULL: no writer compares with ground
    /// truth.
    int (*check_truth)(const struct reconstruct_context *context, int size_px[2],
                       struct message *message);
    const struct reconstruct_debug_maker *debug_maker;  // NULL: no images of the matcher
    /// Simplifies the surface for the mesh files: as `request` asks, or by default. The result must
    /// have triangles. ERROR_MEMORY, ERROR_CANCELLED with `message` set; may add warnings to
    /// `context`. NULL: mesh files hold the full surface.
    int (*make_mesh)(struct reconstruct_context *context, const struct reconstruct_request *request,
                     struct reconstruct_mesh *mesh, struct message *message);
    void (*free_mesh)(struct reconstruct_mesh *mesh);  // no effect on a zeroed mesh
};

/// What every build can write: no images, no report.
extern const struct reconstruct_outputs reconstruct_outputs_plain;

/// Observer of a job. All functions are called on the thread that runs the job.
struct reconstruct_observer {
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
    const struct reconstruct_source *source;
    const struct reconstruct_texts *texts;
    const struct reconstruct_observer *observer;
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
