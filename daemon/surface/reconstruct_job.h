// SPDX-License-Identifier: Apache-2.0
/// One reconstruction from its inputs to a directory of results that appears whole or not at all:
/// shared by `vergence reconstruct` and the console's `reconstruct`. The caller supplies the source
/// of the images and an observer, the program the writers. Without an output directory in the
/// request surface.compact goes to `sink`, or only `result` is made, with its points.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_JOB_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_JOB_H

#include "daemon/files/atomic_dir.h"
#include "daemon/surface/reconstruct_inputs.h"
#include "daemon/surface/reconstruct_program.h"
#include "daemon/surface/reconstruct_request.h"
#include "daemon/surface/result/compact.h"
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

/// The caller sets the first group of members, zeroes the rest, and owns everything pointed to.
struct reconstruct_job {
    const struct reconstruct_program *program;
    const struct reconstruct_request *request;
    const struct reconstruct_caller *caller;
    struct workers *pool;  // threads to be used; NULL: those of the request, for this job alone
    /// Check before the work that there is room for it and its files, which go into the directory
    /// `files` with its limit, see free_space_now.
    bool check_space;
    int files;
    uint64_t files_limit_bytes;

    const struct output_sink *sink;  // of surface.compact, for a request without files; NULL: none

    /// Only figures are read after the run, neither maps nor points: rows of the maps are freed as
    /// surface.compact is written, which takes the memory for it.
    bool frees_maps;

    struct reconstruct_context context;  // everything about the run, valid after it
    struct message message;              // reason of a failed run

    struct compact *compact;  // what the result was read from; NULL: it was measured
    struct reconstruct_inputs inputs;
    struct reconstruct_options options;
    struct reconstruct_result result;
    struct reconstruct_result mesh;
    struct atomic_dir directory;
    struct atomic_dir debug_directory;
    void *debug;  // the program's observer of the matcher; NULL: not requested
    struct workers *workers;
    void *memory;
    size_t memory_bytes;
    int freed_rows;  // of the maps
    uint64_t start_us;
};

/// Runs the job. Returns 0, or an error with `message` set, in which case nothing of it exists
/// under the output's name: ERROR_CANCELLED, ERROR_NO_SURFACE, ERROR_MEMORY, ERROR_BUFFER (results
/// could not be written; ERROR_FULL: no space), or errors of the inputs. reconstruct_job_end is
/// required in any case.
int reconstruct_job_run(struct reconstruct_job *job);

/// After a run without an output directory: writes the files into that of the request, whose
/// members files, triangles, error_mm, compress and mesh_unit may have changed. Errors as above.
/// Any number of times.
int reconstruct_job_write(struct reconstruct_job *job);

/// Frees everything; `context` is invalid afterwards.
void reconstruct_job_end(struct reconstruct_job *job);

#ifdef __cplusplus
}
#endif

#endif
