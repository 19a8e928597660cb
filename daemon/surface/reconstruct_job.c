// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_job.h"

#include <errno.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/monotonic.h"
#include "daemon/base/process.h"
#include "daemon/base/workers.h"
#include "daemon/session/calibration_match.h"
#include "daemon/surface/reconstruct_beyond.h"
#include "daemon/surface/reconstruct_pictures.h"
#include "daemon/surface/reconstruct_space.h"
#include "daemon/surface/reconstruct_summary.h"
#include "daemon/surface/result/result_figures.h"

/// A pair with a matching calibration exceeds this unless the scene is a blank wall; a pair whose
/// rows are some pixels apart does not.
static const double sparse_percent = 25;

/// Recorded pairs have up to 6 % of such texture, a chessboard in view 10 to 20, a fence 30.
static const double repeating_max_percent = 10;

static const char interrupted[] = "interrupted; nothing was written";

static bool show_progress(void *self, enum reconstruct_stage stage, int done, int total) {
    const struct reconstruct_job *job = self;
    job->caller->progress(job->caller->self, (int)stage, reconstruct_stage_text(stage), done,
                          total);
    return !interrupt_requested();
}

static uint64_t now_us(void *self) {
    (void)self;
    return monotonic_now_us();
}

static void choose_options(struct reconstruct_job *job) {
    const struct reconstruct_request *request = job->request;
    struct reconstruct_options *options = &job->options;
    *options = reconstruct_default_options();
    options->rectify.depth_near_mm = request->depth_mm[0];
    options->rectify.depth_far_mm = request->depth_mm[1];
    options->rectify.disparity_min = request->disparity[0];
    options->rectify.disparity_count = request->disparity[1];
    options->rectify.allow_beyond = request->rectified && request->calibration_path == NULL;
    if (request->region_px[2] > 0) {
        options->rectify.region_x_px = request->region_px[0];
        options->rectify.region_y_px = request->region_px[1];
        options->rectify.region_width_px = request->region_px[2];
        options->rectify.region_height_px = request->region_px[3];
    }
    // The reader has already done its part of the shrinking.
    options->rectify.scale = request->scale * job->inputs.left.shrink;
    options->keep_all = request->keep_all;
    options->fill = request->fill;
    options->refine = !request->no_refine;
    // Only the host's writers read the surface as a whole.
    options->recompute_surface = job->outputs->make_mesh == NULL;
    if (request->preset >= 0) {
        options->preset = (enum match_preset)request->preset;
    }
    if (request->speckle_px >= 0) {
        options->speckle_px = request->speckle_px;
    }
}

static void fill_context(struct reconstruct_job *job) {
    struct reconstruct_context *context = &job->context;
    context->result = &job->result;
    context->calibration = &job->inputs.calibration;
    context->options = &job->options;
    context->left = job->inputs.left.image;
    context->right = job->inputs.right.image;
    context->left_path = job->inputs.left.path;
    context->right_path = job->inputs.right.path;
    context->calibration_path = job->inputs.calibration_path;
    context->calibration_format = job->inputs.calibration_format;
    context->ground_truth_path = job->request->ground_truth_path;
    context->mask_path = job->request->mask_path;
    context->ground_truth_scale = job->request->ground_truth_scale;
    context->metric = job->inputs.metric;
    context->shrink = job->inputs.left.shrink;
    context->compress = job->request->compress;
    if (job->request->mesh_unit >= 0) {
        context->mesh_unit = (enum reconstruct_unit)job->request->mesh_unit;
    }
    context->version = version_text();
    context->build_id = version_build_id();
}

/// Checks files that are only needed at the end before the work.
static int check_readable(const char *path, struct message *message) {
    if (path != NULL && access(path, R_OK) != 0) {
        return message_set(message, ERROR_ARGUMENT, "%s: %s", path, strerror(errno));
    }
    struct stat status;
    if (path != NULL && (stat(path, &status) != 0 || !S_ISREG(status.st_mode))) {
        return message_set(message, ERROR_ARGUMENT, "%s: not a file", path);
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
        if (inputs[i] != NULL && atomic_dir_replaces(directory, name, inputs[i])) {
            return inputs[i];
        }
    }
    return NULL;
}

/// Results in the same directory as the inputs must not replace them.
static int protect_inputs(const struct reconstruct_job *job, struct message *message) {
    const struct reconstruct_request *request = job->request;
    const char *option = "--out";
    const char *name = NULL;
    const char *input = NULL;
    for (int k = 0; input == NULL && k < job->outputs->writer_count; k++) {
        name = job->outputs->writers[k].file_name;
        input = replaced_input(request, request->out_path, name);
    }
    if (input == NULL && request->debug_path != NULL) {
        const struct reconstruct_debug_maker *maker = job->outputs->debug_maker;
        option = "--debug";
        for (int k = 0; input == NULL && k < maker->file_count; k++) {
            name = maker->file_names[k];
            input = replaced_input(request, request->debug_path, name);
        }
    }
    return input == NULL
               ? ERROR_OK
               : message_set(message, ERROR_ARGUMENT,
                             "%s would be replaced by the result %s (give %s another name)", input,
                             name, option);
}

/// Unreadable ground truth is an error; ground truth that cannot be compared gives a warning.
static int check_truth(struct reconstruct_job *job) {
    struct reconstruct_context *context = &job->context;
    const struct rectify_plan *plan = &job->result.plan;
    int size_px[2] = {0, 0};
    if (context->ground_truth_path == NULL) {
        return ERROR_OK;
    }
    if (job->outputs->check_truth == NULL) {
        reconstruct_context_warn(
            context,
            "--ground-truth is ignored: this program writes no page that would compare with it");
        return ERROR_OK;
    }
    const int error = job->outputs->check_truth(context, size_px, &job->message);
    if (error != ERROR_OK) {
        return error;
    }
    if (size_px[0] != plan->width_px || size_px[1] != plan->height_px) {
        const bool resized = job->request->scale < 1 || job->request->scale > 1;
        const bool cut = job->request->region_px[2] > 0;
        reconstruct_context_warn(
            context,
            "the ground truth %s is ignored: it is %dx%d pixels, the rectified left image %dx%d%s",
            context->ground_truth_path, size_px[0], size_px[1], plan->width_px, plan->height_px,
            resized && cut ? " (by --region and --scale: compare without them)"
            : resized      ? " (by --scale: compare without it)"
            : cut          ? " (by --region: compare without it)"
                           : "");
    }
    return ERROR_OK;
}

static void warn_assumed_depths(struct reconstruct_job *job) {
    const struct rectify_plan *plan = &job->result.plan;
    if (plan->depth_range_assumed) {
        reconstruct_context_warn(
            &job->context,
            "no depth range was given; disparities %d to %d px were searched (set it by %s)",
            plan->disparity_min, plan->disparity_min + plan->disparity_count - 1,
            job->context.texts->search);
    }
}

static int prepare(struct reconstruct_job *job) {
    int error = check_readable(job->request->ground_truth_path, &job->message);
    if (error == ERROR_OK) {
        error = check_readable(job->request->mask_path, &job->message);
    }
    if (error == ERROR_OK) {
        error = protect_inputs(job, &job->message);
    }
    if (error == ERROR_OK) {
        const struct reconstruct_caller *caller = job->caller;
        error =
            caller->read(caller->source, job->request, &job->inputs, &job->context, &job->message);
    }
    if (error != ERROR_OK) {
        return error;
    }
    choose_options(job);
    fill_context(job);
    job->context.read_us = monotonic_now_us() - job->start_us;
    error = reconstruct_pictures_assess(&job->context, &job->message);
    if (error != ERROR_OK) {
        return error;
    }
    error = rectify_plan_make(&job->inputs.calibration, &job->options.rectify, &job->result.plan);
    if (error != ERROR_OK) {
        reconstruct_summary_no_plan(error, &job->context, &job->message);
        return error;
    }
    struct triangulate_plan measurable;
    error = triangulate_plan_make(&job->result.plan, NULL, &measurable);
    if (error != ERROR_OK) {
        const struct rectify_plan *plan = &job->result.plan;
        return message_set(
            &job->message, error,
            "images of %dx%d pixels with a focal length of %.6g px and a baseline of %.6g mm "
            "cannot be measured (limits: %.0f times the focal length to each side of the axis, "
            "baseline 100 m): check the focal length, or select a part with --region",
            plan->width_px, plan->height_px, plan->f_px, plan->baseline_mm, TRIANGULATE_SLOPE_MAX);
    }
    warn_assumed_depths(job);
    return check_truth(job);
}

static int allocate(struct reconstruct_job *job) {
    job->workers = workers_create(job->request->threads);
    if (job->workers == NULL) {
        return message_set(&job->message, ERROR_MEMORY, "out of memory for threads");
    }
    job->context.threads = workers_parallel(job->workers)->threads;
    const struct free_space need =
        reconstruct_space_need(&job->context, job->outputs, job->request->files);
    job->context.arena_bytes = job->memory_bytes = (size_t)need.memory_bytes;
    if (job->check_space) {
        const struct free_space available = free_space_now(job->files, job->files_limit_bytes);
        if (!free_space_fits(&available, &need)) {
            return reconstruct_space_refuse(&job->context, job->outputs, job->request->files,
                                            &available, &job->message);
        }
    }
    job->memory = mmap(NULL, job->memory_bytes, PROT_READ | PROT_WRITE,
                       MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (job->memory == MAP_FAILED) {
        job->memory = NULL;
        return message_set(&job->message, ERROR_MEMORY,
                           "out of memory: %.0f MB are required (make the images smaller with %s)",
                           (double)job->memory_bytes / 1e6, job->context.texts->smaller);
    }
    return ERROR_OK;
}

/// Measured on pairs of 1.4 and 16.8 million pixels with one thread, per pixel or per cell of
/// `match_work`. Only rough ratios matter.
static const double develop_ns = 20, rectify_ns = 9, match_cell_ns = 1.6, refine_ns = 65,
                    triangulate_ns = 55, mesh_ns = 65, write_ns = 1000;

/// Estimates each stage's time in ns, as measured on one processor. `raw`: one of the images.
static void estimate_work(const struct raw_image *raw, const struct rectify_plan *plan,
                          const struct reconstruct_options *options, int threads,
                          double work_ns[RECONSTRUCT_WORK_STAGES]) {
    INVARIANT(threads >= 1);
    const double raw_pixels = (double)raw->width_px * raw->height_px;
    const double pixels = (double)plan->width_px * plan->height_px;
    const struct match_options match = reconstruct_match_options(plan, options);
    const double cells = (double)match_work(plan->width_px, plan->height_px, &match);
    // The greedy path is single-threaded.
    const int matching = options->preset == MATCH_PRESET_PAPER ? 1 : threads;
    work_ns[RECONSTRUCT_PLAN] = 0;
    work_ns[RECONSTRUCT_DEVELOP] = 0;  // while rectifying
    work_ns[RECONSTRUCT_RECTIFY] = (develop_ns * raw_pixels + rectify_ns * pixels) / threads;
    work_ns[RECONSTRUCT_MATCH] = match_cell_ns * cells / matching;
    work_ns[RECONSTRUCT_REFINE] = options->refine ? refine_ns * pixels / threads : 0;
    work_ns[RECONSTRUCT_TRIANGULATE] = triangulate_ns * pixels / threads;
    work_ns[RECONSTRUCT_MESH] = mesh_ns * pixels;
    work_ns[RECONSTRUCT_WORK_WRITE] = write_ns * pixels;
}

static int compute(struct reconstruct_job *job) {
    const struct reconstruct_environment environment = {
        .parallel = workers_parallel(job->workers),
        .now_us = now_us,
        .progress = show_progress,
        .self = job,
    };
    double work_ns[RECONSTRUCT_WORK_STAGES];
    estimate_work(&job->context.left, &job->result.plan, &job->options, job->context.threads,
                  work_ns);
    if (job->caller->expect != NULL) {
        job->caller->expect(job->caller->self, work_ns, RECONSTRUCT_WORK_STAGES);
    }
    struct arena arena;
    arena_init(&arena, job->memory, job->memory_bytes);
    const struct rectify_plan plan = job->result.plan;
    const int error =
        reconstruct_run(&job->context.left, &job->context.right, &job->inputs.calibration, &plan,
                        &job->options, &environment, &arena, &job->result);
    job->context.total_us = monotonic_now_us() - job->start_us;
    struct rusage usage = {0};
    getrusage(RUSAGE_SELF, &usage);
    job->context.rss_peak_bytes = (size_t)usage.ru_maxrss * 1024;
    if (error == ERROR_NO_SURFACE) {
        reconstruct_summary_no_surface(&job->context, &job->message);
    } else if (error == ERROR_CANCELLED) {
        message_set(&job->message, error, "%s", interrupted);
    } else if (error != ERROR_OK) {
        message_set(&job->message, error, "the reconstruction failed: %s", error_text(error));
    }
    return error;
}

static void find_common_sigma(struct reconstruct_job *job) {
    struct reconstruct_context *context = &job->context;
    context->depth_sigma_common_mm = -1;
    context->has_spread =
        job->result.vertex_count > 0 && result_figures_spread(&job->result, &context->spread);
    if (context->metric && context->has_spread) {
        context->depth_sigma_common_mm = calibration_match_sigma_mm(
            context->calibration, context->has_instrument ? &context->instrument : NULL,
            context->has_instrument ? &context->axes : NULL, context->spread.depth_mm[1]);
    }
}

static void record_doubts(struct reconstruct_job *job) {
    const double density_percent = result_figures_density_percent(&job->result);
    struct message cause;
    if (reconstruct_pictures_explain(&job->context, &cause)) {
        reconstruct_context_warn(&job->context, "only %.0f %% of the pixels could be measured: %s",
                                 density_percent, cause.text);
    } else if (density_percent < sparse_percent) {
        reconstruct_context_warn(
            &job->context,
            "only %.0f %% of the pixels could be measured: check that the calibration belongs to "
            "these images, and that the scene is within the search",
            density_percent);
    }
    reconstruct_beyond_note(&job->context);
    const uint32_t points = result_figures_measured_count(&job->result);
    const double repeating_percent = points > 0 ? 100.0 * job->result.repeating_count / points : 0;
    if (repeating_percent > repeating_max_percent) {
        reconstruct_context_warn(&job->context,
                                 "%.0f %% of the points lie on repeating texture: they may all be "
                                 "off by one period; a narrower search (%s) leaves fewer periods",
                                 repeating_percent < 100 ? repeating_percent : 100,
                                 job->context.texts->search);
    }
    const struct triangulate_vertical *vertical = &job->result.vertical;
    const double scale = job->options.rectify.scale;
    if (vertical->samples == 0) {
        reconstruct_context_warn(&job->context,
                                 "too few textured matches to check that the rows of the rectified "
                                 "images correspond");
    }
    const char *fault = result_figures_rows_fault(vertical, &job->result.plan, scale);
    if (fault != NULL) {
        reconstruct_context_warn(&job->context,
                                 "the rows of the rectified images are %.2f px apart (median; 95 "
                                 "%%: %.2f px): the calibration does not fit these images: %s",
                                 vertical->median_px, vertical->p95_px, fault);
    }
}

static bool is_wanted(const struct reconstruct_job *job, const char *file_name) {
    const char *list = job->request->files;
    return list == NULL || result_files_has(list, file_name);
}

/// Only if a file will contain it.
static int simplify(struct reconstruct_job *job) {
    const struct reconstruct_request *request = job->request;
    const bool requested = request->triangles > 0 || request->error_mm > 0;
    if (job->outputs->make_mesh == NULL || job->result.triangle_count == 0 ||
        !(is_wanted(job, "mesh.glb") || (requested && is_wanted(job, "mesh.ply")))) {
        return ERROR_OK;
    }
    const int error = job->outputs->make_mesh(&job->context, request, &job->mesh, &job->message);
    if (error == ERROR_OK) {
        job->mesh.requested = requested;
        job->context.mesh = &job->mesh;
    }
    return error;
}

/// Writes into the hidden directory.
static int write_results(struct reconstruct_job *job) {
    const struct reconstruct_outputs *outputs = job->outputs;
    for (int i = 0; i < outputs->writer_count; i++) {
        const struct result_writer *writer = &outputs->writers[i];
        char path[ATOMIC_DIR_PATH_BYTES];
        job->caller->progress(job->caller->self, RECONSTRUCT_WORK_WRITE, "write", i,
                              outputs->writer_count);
        if (interrupt_requested()) {
            return message_set(&job->message, ERROR_CANCELLED, "%s", interrupted);
        }
        if (!is_wanted(job, writer->file_name) || (writer->metric_only && !job->context.metric) ||
            reconstruct_beyond_skips(&job->result, writer->file_name)) {
            continue;
        }
        atomic_dir_file_path(&job->directory, writer->file_name, path);
        const int error = writer->write(&job->context, path, &job->message);
        if (error != ERROR_OK) {
            atomic_dir_name_final(&job->directory, &job->message);
            return error;
        }
    }
    return ERROR_OK;
}

/// Names of the results, of all or of those that are wanted. Returns their number.
static int list_names(const struct reconstruct_job *job, bool all, const char **names) {
    const struct reconstruct_outputs *outputs = job->outputs;
    int count = 0;
    INVARIANT(outputs->writer_count >= 1 &&
              outputs->writer_count <= RECONSTRUCT_OUTPUTS_WRITERS_MAX);
    for (int i = 0; i < outputs->writer_count; i++) {
        if (all || is_wanted(job, outputs->writers[i].file_name)) {
            names[count++] = outputs->writers[i].file_name;
        }
    }
    return count;
}

static int commit_results(struct reconstruct_job *job) {
    const char *names[RECONSTRUCT_OUTPUTS_WRITERS_MAX];
    const int count = list_names(job, true, names);
    return atomic_dir_commit(&job->directory, names, count, names[count - 1], &job->message);
}

/// Images are also written if no surface was found, as they may show why. If they cannot be
/// written, nothing is.
static int draw(struct reconstruct_job *job, int error) {
    struct message message;
    const int debug_error = reconstruct_debug_finish(&job->debug, &job->context, &message);
    if (debug_error != ERROR_OK) {
        job->message = message;
    }
    return debug_error != ERROR_OK ? debug_error : error;
}

static int begin_directory(struct reconstruct_job *job) {
    const char *names[RECONSTRUCT_OUTPUTS_WRITERS_MAX];
    const int count = list_names(job, false, names);
    const int error =
        atomic_dir_begin(&job->directory, job->request->out_path, names, count, &job->message);
    // Failing to write is a failure, not bad input.
    return error == ERROR_ARGUMENT ? ERROR_BUFFER : error;
}

static int run(struct reconstruct_job *job) {
    int error = prepare(job);
    error = error == ERROR_OK ? begin_directory(job) : error;
    if (error == ERROR_OK) {
        error = reconstruct_debug_begin(&job->debug, job->outputs->debug_maker, job->request,
                                        &job->result.plan, &job->options, &job->message);
    }
    error = error == ERROR_OK ? allocate(job) : error;
    error = error == ERROR_OK ? compute(job) : error;
    if (error == ERROR_OK) {
        find_common_sigma(job);
        record_doubts(job);
        error = simplify(job);
    }
    error = error == ERROR_OK ? write_results(job) : error;
    if (error == ERROR_OK || error == ERROR_NO_SURFACE) {
        error = draw(job, error);
    }
    return error == ERROR_OK ? commit_results(job) : error;
}

int reconstruct_job_run(struct reconstruct_job *job) {
    job->start_us = monotonic_now_us();
    job->context.texts = job->texts;
    job->directory = job->debug.directory = (struct atomic_dir){.lock_fd = -1};
    interrupt_ask(job->caller->should_stop, job->caller->self);
    const int error = run(job);
    interrupt_ask(NULL, NULL);
    INVARIANT(error == ERROR_OK || job->message.text[0] != '\0');
    return error;
}

void reconstruct_job_end(struct reconstruct_job *job) {
    if (job->outputs->make_mesh != NULL) {
        job->outputs->free_mesh(&job->mesh);
    }
    reconstruct_debug_end(&job->debug);
    atomic_dir_abort(&job->directory);
    workers_destroy(job->workers);
    if (job->memory != NULL) {
        munmap(job->memory, job->memory_bytes);
    }
    reconstruct_inputs_free(&job->inputs);
}
