// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_command.h"

#include <fcntl.h>
#include <stdio.h>

#include "core/error.h"
#include "daemon/base/memory.h"
#include "daemon/base/process.h"
#include "daemon/cli/options.h"
#include "daemon/cli/progress.h"
#include "daemon/surface/reconstruct_all.h"
#include "daemon/surface/reconstruct_session.h"
#include "daemon/surface/reconstruct_summary.h"
#include "daemon/surface/result/result_json.h"

static void expect(void *self, const double *work_ns, int stages) {
    progress_expect(self, work_ns, stages);
}

static void show_progress(void *self, int stage, const char *what, int done, int total) {
    progress_show(self, stage, what, done, total);
}

static int exit_code_of(int error) {
    switch (error) {
        case ERROR_OK:
            return CLIENT_OK;
        case ERROR_CANCELLED:
            return interrupt_exit_code();
        case ERROR_NO_SURFACE:
            return CLIENT_NO_SURFACE;
        case ERROR_MEMORY:
        case ERROR_BUFFER:
        case ERROR_FULL:
            return CLIENT_FAILED;
        default:
            return CLIENT_BAD_INPUT;
    }
}

static void print_notes(const struct reconstruct_job *job) {
    for (int i = 0; i < job->context.warning_count && !job->request->quiet; i++) {
        fprintf(stderr, "vergence: note: %s\n", job->context.warnings[i].text);
    }
}

static void print_outcome(const struct reconstruct_job *job) {
    const struct reconstruct_request *request = job->request;
    print_notes(job);
    if (request->json) {
        result_json_print(&job->context, stdout);
    } else if (!request->quiet) {
        reconstruct_summary_print(&job->context, request->out_path, stdout);
    }
}

static void print_failure(const struct reconstruct_job *job, int error) {
    if (error == ERROR_NO_SURFACE && job->context.self_calibrated) {
        print_notes(job);  // whether the cameras are where the calibration expects them
    }
    fprintf(stderr, "vergence reconstruct: %s%s\n", error == ERROR_MISMATCH ? "ERR MISMATCH " : "",
            job->message.text);
}

int reconstruct_command_run(const struct reconstruct_program *program, int argc, char **argv) {
    struct reconstruct_request request;
    struct reconstruct_source source = {.program = program};
    struct progress progress;
    static struct reconstruct_session session;
    struct reconstruct_caller caller = {.scale = "--scale",
                                        .smaller = "--scale or --region",
                                        .depth = "--near and --far",
                                        .search = "--near and --far, or --disparity",
                                        .accept = "--accept-mismatch",
                                        .read = reconstruct_inputs_read,
                                        .source = &source,
                                        .expect = expect,
                                        .progress = show_progress,
                                        .self = &progress};
    struct reconstruct_job job = {.program = program, .request = &request, .caller = &caller};
    const int exit_code = reconstruct_request_parse(argc, argv, &request);
    if (exit_code != OPTIONS_CONTINUE) {
        return exit_code;
    }
    if (request.debug_path != NULL && program->debug_file_count == 0) {
        fputs("vergence reconstruct: --debug is not supported by this program\n", stderr);
        return CLIENT_USAGE;
    }
    if (program->make_mesh == NULL &&
        (request.triangles > 0 || request.error_mm > 0 || request.compress)) {
        fputs(
            "vergence reconstruct: --triangles, --error and --compress are not supported by this "
            "program (it writes the full mesh only)\n",
            stderr);
        return CLIENT_USAGE;
    }
    if (result_format_check(request.files, program->writers, &job.message) != ERROR_OK) {
        fprintf(stderr, "vergence reconstruct: %s\n", job.message.text);
        return CLIENT_USAGE;
    }
    if (request.session_path != NULL) {
        session.parent = AT_FDCWD;
        session.path = request.session_path;
        session.number = (uint32_t)request.pair;
        session.load_calibration = program->load_calibration;
        session.target = program->target;
        session.missing =
            ": give --calibration FILE (or --rectified for a rectified pair without one)";
        caller.read = reconstruct_session_read;
        caller.source = &session;
    }
    interrupt_catch();
    memory_return_freed();
    if (request.all) {
        return exit_code_of(reconstruct_all_run(program, &request, &caller, &session, &progress));
    }
    progress_begin(&progress, request.quiet);
    const int error = reconstruct_job_run(&job);
    progress_end(&progress);
    if (error == ERROR_OK) {
        print_outcome(&job);
    } else {
        print_failure(&job, error);
    }
    reconstruct_job_end(&job);
    return exit_code_of(error);
}
