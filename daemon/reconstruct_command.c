// SPDX-License-Identifier: Apache-2.0
#include "daemon/reconstruct_command.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/client.h"
#include "daemon/interrupt.h"
#include "daemon/options.h"
#include "daemon/outdir.h"
#include "daemon/progress.h"
#include "daemon/reconstruct_inputs.h"
#include "daemon/reconstruct_request.h"
#include "daemon/reconstruct_session.h"
#include "daemon/reconstruct_summary.h"
#include "daemon/reconstruct_work.h"
#include "daemon/result_figures.h"
#include "daemon/result_json.h"
#include "daemon/workers.h"

/// A pair whose calibration fits gives more than this, short of blank walls; one whose rows are
/// some pixels apart does not.
static const double sparse_percent = 25;

/// One run of the command.
struct job {
    const struct reconstruct_command_abilities *abilities;
    struct reconstruct_request request;
    struct session_pair_files session;  // that the request names
    struct reconstruct_inputs inputs;
    struct reconstruct_options options;
    struct reconstruct_result result;
    struct reconstruct_context context;
    struct progress progress;
    struct outdir directory;
    struct reconstruct_debug debug;
    struct workers *workers;
    void *memory;
    size_t memory_bytes;
    uint64_t start_us;
    struct message message;
};

static bool show_progress(void *self, enum reconstruct_stage stage, int done, int total) {
    struct job *job = self;
    progress_show(&job->progress, (int)stage, reconstruct_stage_text(stage), done, total);
    return !interrupt_requested();
}

static uint64_t now_us(void *self) {
    (void)self;
    return progress_now_us();
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
            return CLIENT_FAILED;
        default:
            return CLIENT_BAD_INPUT;
    }
}

static void choose_options(struct job *job) {
    const struct reconstruct_request *request = &job->request;
    struct reconstruct_options *options = &job->options;
    *options = reconstruct_default_options();
    options->rectify.depth_near_mm = request->depth_mm[0];
    options->rectify.depth_far_mm = request->depth_mm[1];
    options->rectify.disparity_min = request->disparity[0];
    options->rectify.disparity_count = request->disparity[1];
    if (request->region_px[2] > 0) {
        options->rectify.region_x_px = request->region_px[0];
        options->rectify.region_y_px = request->region_px[1];
        options->rectify.region_width_px = request->region_px[2];
        options->rectify.region_height_px = request->region_px[3];
    }
    // The reader has done its part of the shrinking already.
    options->rectify.scale = request->scale * job->inputs.left.shrink;
    options->keep_all = request->keep_all;
    options->refine = !request->no_refine;
    if (request->preset >= 0) {
        options->preset = (enum match_preset)request->preset;
    }
    if (request->speckle_px >= 0) {
        options->speckle_px = request->speckle_px;
    }
}

static void fill_context(struct job *job) {
    struct reconstruct_context *context = &job->context;
    context->result = &job->result;
    context->calibration = &job->inputs.calibration;
    context->options = &job->options;
    context->left = job->inputs.left.image;
    context->right = job->inputs.right.image;
    context->left_path = job->request.left_path;
    context->right_path = job->request.right_path;
    context->calibration_path = job->request.calibration_path;
    context->calibration_format = job->inputs.calibration_format;
    context->ground_truth_path = job->request.ground_truth_path;
    context->mask_path = job->request.mask_path;
    context->ground_truth_scale = job->request.ground_truth_scale;
    context->metric = job->inputs.metric;
    context->shrink = job->inputs.left.shrink;
    context->version = client_version();
    context->build_id = client_build_id();
}

/// Files that are only needed at the end are missed before the work, not after it.
static int check_readable(const char *path, struct message *message) {
    if (path != NULL && access(path, R_OK) != 0) {
        return message_set(message, ERROR_ARGUMENT, "%s: %s", path, strerror(errno));
    }
    struct stat status;
    if (path != NULL && (stat(path, &status) != 0 || !S_ISREG(status.st_mode))) {
        return message_set(message, ERROR_ARGUMENT, "%s is not a file", path);
    }
    return ERROR_OK;
}

/// The input that the file `name` in `directory` would replace; NULL: none.
static const char *replaced_input(const struct reconstruct_request *request, const char *directory,
                                  const char *name) {
    const char *const inputs[] = {request->left_path, request->right_path,
                                  request->calibration_path, request->ground_truth_path,
                                  request->mask_path};
    for (size_t i = 0; i < sizeof inputs / sizeof inputs[0]; i++) {
        if (inputs[i] != NULL && outdir_replaces(directory, name, inputs[i])) {
            return inputs[i];
        }
    }
    return NULL;
}

/// Results that stand in the same directory as what they are made from must not replace it.
static int protect_inputs(const struct job *job, struct message *message) {
    const struct reconstruct_request *request = &job->request;
    const char *option = "--out";
    const char *name = NULL;
    const char *input = NULL;
    for (int k = 0; input == NULL && k < job->abilities->writer_count; k++) {
        name = job->abilities->writers[k].file_name;
        input = replaced_input(request, request->out_path, name);
    }
    if (input == NULL && request->debug_path != NULL) {
        const struct reconstruct_debug_maker *maker = job->abilities->debug_maker;
        option = "--debug";
        for (int k = 0; input == NULL && k < maker->file_count; k++) {
            name = maker->file_names[k];
            input = replaced_input(request, request->debug_path, name);
        }
    }
    return input == NULL
               ? ERROR_OK
               : message_set(message, ERROR_ARGUMENT,
                             "%s would be replaced by the result %s; give %s another name", input,
                             name, option);
}

/// Ground truth that cannot be read is refused; what cannot be compared is said.
static int check_truth(struct job *job) {
    struct reconstruct_context *context = &job->context;
    const struct rectify_plan *plan = &job->result.plan;
    int size_px[2] = {0, 0};
    if (context->ground_truth_path == NULL) {
        return ERROR_OK;
    }
    if (job->abilities->check_truth == NULL) {
        reconstruct_context_warn(context,
                                 "--ground-truth is not used: this program writes no page "
                                 "that would compare with it");
        return ERROR_OK;
    }
    const int error = job->abilities->check_truth(context, size_px, &job->message);
    if (error != ERROR_OK) {
        return error;
    }
    if (size_px[0] != plan->width_px || size_px[1] != plan->height_px) {
        const bool resized = job->request.scale < 1 || job->request.scale > 1;
        const bool cut = job->request.region_px[2] > 0;
        reconstruct_context_warn(
            context,
            "the ground truth %s is not used: it is %dx%d pixels, the rectified left image %dx%d%s",
            context->ground_truth_path, size_px[0], size_px[1], plan->width_px, plan->height_px,
            resized && cut ? " (by --region and --scale: compare without them)"
            : resized      ? " (by --scale: compare without it)"
            : cut          ? " (by --region: compare without it)"
                           : "");
    }
    return ERROR_OK;
}

static int prepare(struct job *job) {
    const struct reconstruct_command_abilities *abilities = job->abilities;
    int error = reconstruct_session_resolve(&job->request, &job->session, &job->message);
    if (error == ERROR_OK) {
        error = check_readable(job->request.ground_truth_path, &job->message);
    }
    if (error == ERROR_OK) {
        error = check_readable(job->request.mask_path, &job->message);
    }
    if (error == ERROR_OK) {
        error = protect_inputs(job, &job->message);
    }
    if (error == ERROR_OK) {
        error = reconstruct_inputs_read(&job->request, abilities->formats, abilities->format_count,
                                        abilities->load_calibration, &job->inputs, &job->context,
                                        &job->message);
    }
    if (error != ERROR_OK) {
        return error;
    }
    choose_options(job);
    fill_context(job);
    job->context.read_us = progress_now_us() - job->start_us;
    error = rectify_plan_make(&job->inputs.calibration, &job->options.rectify, &job->result.plan);
    if (error != ERROR_OK) {
        reconstruct_summary_no_plan(error, &job->context, &job->message);
        return error;
    }
    return check_truth(job);
}

static int allocate(struct job *job) {
    job->workers = workers_create(job->request.threads);
    if (job->workers == NULL) {
        return message_set(&job->message, ERROR_MEMORY, "not enough memory for threads");
    }
    job->context.threads = workers_parallel(job->workers)->threads;
    job->memory_bytes =
        reconstruct_need_bytes(job->context.left.width_px, job->context.left.height_px,
                               &job->result.plan, &job->options, job->context.threads);
    job->context.arena_bytes = job->memory_bytes;
    job->memory = mmap(NULL, job->memory_bytes, PROT_READ | PROT_WRITE,
                       MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (job->memory == MAP_FAILED) {
        job->memory = NULL;
        return message_set(&job->message, ERROR_MEMORY,
                           "not enough memory: %.0f MB are needed; make the images smaller by "
                           "--scale or --region",
                           (double)job->memory_bytes / 1e6);
    }
    return ERROR_OK;
}

static int compute(struct job *job) {
    const struct reconstruct_environment environment = {
        .parallel = workers_parallel(job->workers),
        .now_us = now_us,
        .progress = show_progress,
        .self = job,
    };
    double work_ns[RECONSTRUCT_WORK_STAGES];
    reconstruct_work_estimate(&job->context.left, &job->result.plan, &job->options,
                              job->context.threads, work_ns);
    progress_expect(&job->progress, work_ns, RECONSTRUCT_WORK_STAGES);
    struct arena arena;
    arena_init(&arena, job->memory, job->memory_bytes);
    const struct rectify_plan plan = job->result.plan;
    const int error =
        reconstruct_run(&job->context.left, &job->context.right, &job->inputs.calibration, &plan,
                        &job->options, &environment, &arena, &job->result);
    job->context.total_us = progress_now_us() - job->start_us;
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    job->context.rss_peak_bytes = (size_t)usage.ru_maxrss * 1024;
    if (error == ERROR_NO_SURFACE) {
        reconstruct_summary_no_surface(&job->result, &job->message);
    } else if (error == ERROR_CANCELLED) {
        message_set(&job->message, error, "interrupted; nothing was written");
    } else if (error != ERROR_OK) {
        message_set(&job->message, error, "the reconstruction failed: %s", error_text(error));
    }
    return error;
}

static void note_doubts(struct job *job) {
    const struct rectify_plan *plan = &job->result.plan;
    if (plan->depth_range_assumed) {
        reconstruct_context_warn(&job->context,
                                 "no depth range was stated; disparities %d to %d px were searched "
                                 "(--depth or --disparity say what to search)",
                                 plan->disparity_min,
                                 plan->disparity_min + plan->disparity_count - 1);
    }
    const double density_percent = result_figures_density_percent(&job->result);
    if (density_percent < sparse_percent) {
        reconstruct_context_warn(&job->context,
                                 "only %.0f %% of the pixels could be measured: does the "
                                 "calibration belong to these images, and is the scene within the "
                                 "search?",
                                 density_percent);
    }
    const struct triangulate_vertical *vertical = &job->result.vertical;
    if (vertical->samples == 0) {
        reconstruct_context_warn(&job->context,
                                 "too few textured matches to check that the rows of the rectified "
                                 "images correspond");
    }
    if (vertical->samples > 0 && vertical->median_px > 0.5) {
        reconstruct_context_warn(&job->context,
                                 "the rows of the rectified images are %.2f px apart (median): the "
                                 "calibration does not fit these images well",
                                 vertical->median_px);
    }
}

/// Into the hidden directory.
static int write_results(struct job *job) {
    const struct reconstruct_command_abilities *abilities = job->abilities;
    for (int i = 0; i < abilities->writer_count; i++) {
        const struct result_writer *writer = &abilities->writers[i];
        char path[OUTDIR_PATH_BYTES];
        progress_show(&job->progress, RECONSTRUCT_WORK_WRITE, "write", i, abilities->writer_count);
        if (interrupt_requested()) {
            return message_set(&job->message, ERROR_CANCELLED, "interrupted; nothing was written");
        }
        if (writer->metric_only && !job->context.metric) {
            continue;
        }
        outdir_file_path(&job->directory, writer->file_name, path);
        const int error = writer->write(&job->context, path, &job->message);
        if (error != ERROR_OK) {
            outdir_name_final(&job->directory, &job->message);
            return error;
        }
    }
    return ERROR_OK;
}

static int commit_results(struct job *job) {
    const struct reconstruct_command_abilities *abilities = job->abilities;
    const char *names[RECONSTRUCT_COMMAND_WRITERS_MAX];
    INVARIANT(abilities->writer_count >= 1 &&
              abilities->writer_count <= RECONSTRUCT_COMMAND_WRITERS_MAX);
    for (int i = 0; i < abilities->writer_count; i++) {
        names[i] = abilities->writers[i].file_name;
    }
    return outdir_commit(&job->directory, names, abilities->writer_count,
                         names[abilities->writer_count - 1], &job->message);
}

/// Pictures are there as well where no surface was found: they may say why. Where they cannot be
/// written, nothing is.
static int draw(struct job *job, int error) {
    struct message message;
    const int debug_error = reconstruct_debug_finish(&job->debug, &job->context, &message);
    if (debug_error != ERROR_OK) {
        job->message = message;
    }
    return debug_error != ERROR_OK ? debug_error : error;
}

static int run(struct job *job) {
    int error = prepare(job);
    if (error == ERROR_OK) {
        error = outdir_begin(&job->directory, job->request.out_path, &job->message);
        // Not being able to write is a failure, not a bad input.
        error = error != ERROR_OK ? ERROR_BUFFER : ERROR_OK;
    }
    if (error == ERROR_OK) {
        error = reconstruct_debug_begin(&job->debug, job->abilities->debug_maker, &job->request,
                                        &job->result.plan, &job->options, &job->message);
    }
    if (error == ERROR_OK) {
        error = allocate(job);
    }
    if (error == ERROR_OK) {
        error = compute(job);
    }
    if (error == ERROR_OK) {
        note_doubts(job);
        error = write_results(job);
    }
    if (error == ERROR_OK || error == ERROR_NO_SURFACE) {
        error = draw(job, error);
    }
    if (error == ERROR_OK) {
        error = commit_results(job);
    }
    progress_end(&job->progress);
    return error;
}

static void print_outcome(struct job *job) {
    for (int i = 0; i < job->context.warning_count && !job->request.quiet; i++) {
        fprintf(stderr, "vergence: note: %s\n", job->context.warnings[i].text);
    }
    if (job->request.json) {
        result_json_print(&job->context, stdout);
    } else if (!job->request.quiet) {
        reconstruct_summary_print(&job->context, job->request.out_path, stdout);
    }
}

static void clean_up(struct job *job) {
    reconstruct_debug_end(&job->debug);
    outdir_abort(&job->directory);
    workers_destroy(job->workers);
    if (job->memory != NULL) {
        munmap(job->memory, job->memory_bytes);
    }
    reconstruct_inputs_free(&job->inputs);
}

int reconstruct_command_run(const struct reconstruct_command_abilities *abilities, int argc,
                            char **argv) {
    struct job job = {.abilities = abilities,
                      .directory = {.lock_fd = -1},
                      .debug = {.directory = {.lock_fd = -1}}};
    const int exit_code = reconstruct_request_parse(argc, argv, &job.request);
    if (exit_code != OPTIONS_CONTINUE) {
        return exit_code;
    }
    if (job.request.debug_path != NULL && abilities->debug_maker == NULL) {
        fputs("vergence reconstruct: --debug is not for this program: it writes no pictures\n",
              stderr);
        return CLIENT_USAGE;
    }
    interrupt_catch();
    job.start_us = progress_now_us();
    progress_begin(&job.progress, job.request.quiet);
    const int error = run(&job);
    if (error == ERROR_OK) {
        print_outcome(&job);
    } else {
        fprintf(stderr, "vergence reconstruct: %s\n", job.message.text);
    }
    clean_up(&job);
    return exit_code_of(error);
}
