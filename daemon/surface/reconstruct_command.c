// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_command.h"

#include <fcntl.h>
#include <stdio.h>

#include "core/error.h"
#include "daemon/base/process.h"
#include "daemon/cli/options.h"
#include "daemon/cli/progress.h"
#include "daemon/surface/reconstruct_session.h"
#include "daemon/surface/reconstruct_summary.h"
#include "daemon/surface/result/result_json.h"
#include "daemon/surface/result/write.h"

static const struct result_writer writers[] = {
    {"disparity.pfm", false, write_pfm, WRITE_PFM_PIXEL_BYTES},
    {"reasons.pgm", false, write_reasons, 1},
    {"points.pcd", false, write_pcd, WRITE_PCD_PIXEL_BYTES},
    {"mesh.ply", false, write_ply, WRITE_PLY_PIXEL_BYTES},
    {"result.json", false, write_result, 0},
};

const struct reconstruct_outputs reconstruct_outputs_plain = {
    .writers = writers,
    .writer_count = sizeof writers / sizeof writers[0],
};

static const struct reconstruct_texts texts = {
    .scale = "--scale",
    .smaller = "--scale or --region",
    .depth = "--near and --far",
    .search = "--near and --far, or --disparity",
    .accept = "--accept-mismatch",
};

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

int reconstruct_command_run(const struct reconstruct_files *files,
                            const struct reconstruct_outputs *outputs, int argc, char **argv) {
    struct reconstruct_request request;
    struct reconstruct_files readable = *files;
    struct progress progress;
    static struct reconstruct_session session;
    struct reconstruct_caller caller = {.read = reconstruct_inputs_read,
                                        .source = &readable,
                                        .expect = expect,
                                        .progress = show_progress,
                                        .self = &progress};
    struct reconstruct_job job = {
        .outputs = outputs, .request = &request, .texts = &texts, .caller = &caller};
    const int exit_code = reconstruct_request_parse(argc, argv, &request);
    if (exit_code != OPTIONS_CONTINUE) {
        return exit_code;
    }
    if (request.debug_path != NULL && outputs->debug_maker == NULL) {
        fputs("vergence reconstruct: --debug is not supported by this program\n", stderr);
        return CLIENT_USAGE;
    }
    if (outputs->make_mesh == NULL &&
        (request.triangles > 0 || request.error_mm > 0 || request.compress)) {
        fputs(
            "vergence reconstruct: --triangles, --error and --compress are not supported by this "
            "program (it writes the full mesh only)\n",
            stderr);
        return CLIENT_USAGE;
    }
    if (result_files_check(request.files, outputs->writers, outputs->writer_count, &job.message) !=
        ERROR_OK) {
        fprintf(stderr, "vergence reconstruct: %s\n", job.message.text);
        return CLIENT_USAGE;
    }
    if (request.session_path != NULL) {
        session.parent = AT_FDCWD;
        session.path = request.session_path;
        session.number = (uint32_t)request.pair;
        session.load_calibration = files->load_calibration;
        session.missing =
            ": give --calibration FILE (or --rectified for a rectified pair without one)";
        caller.read = reconstruct_session_read;
        caller.source = &session;
    }
    interrupt_catch();
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
