// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_job.h"

#include <errno.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "console/pair/calibration_match.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/monotonic.h"
#include "daemon/base/process.h"
#include "daemon/base/workers.h"
#include "daemon/session/session_pairs.h"
#include "daemon/surface/reconstruct_doubts.h"
#include "daemon/surface/reconstruct_pictures.h"
#include "daemon/surface/reconstruct_space.h"
#include "daemon/surface/reconstruct_summary.h"
#include "daemon/surface/result/result_figures.h"

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

/// Whether the program writes the file and the request wants it.
static bool is_wanted(const struct reconstruct_job *job, int format) {
    return job->program->writers[format] != NULL &&
           result_format_listed(job->request->files, result_formats[format].file_name);
}

/// Whether a writer, or a caller without any, reads the surface or the pictures as a whole.
static bool reads_whole(const struct reconstruct_job *job) {
    static const int whole[] = {RESULT_DEPTH_PNG, RESULT_LEFT_PNG, RESULT_RIGHT_PNG,
                                RESULT_MESH_GLB, RESULT_REPORT_HTML};
    const struct reconstruct_request *request = job->request;
    for (size_t i = 0; i < sizeof whole / sizeof *whole; i++) {
        if (is_wanted(job, whole[i])) {
            return true;
        }
    }
    const bool simplifies = request->triangles > 0 || request->error_mm > 0;
    return (request->out_path == NULL && job->sink == NULL) || request->debug_path != NULL ||
           (simplifies && job->program->make_mesh != NULL);
}

static void choose_options(struct reconstruct_job *job) {
    const struct reconstruct_request *request = job->request;
    struct reconstruct_options *options = &job->options;
    *options = reconstruct_default_options();
    options->rectify.depth_near_mm = request->depth_mm[0];
    options->rectify.depth_far_mm = request->depth_mm[1];
    if (request->disparity[1] > 0) {
        options->rectify.disparity_min = request->disparity[0];
        options->rectify.disparity_count = request->disparity[1];
    }
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
    options->recompute_surface = options->remake_pictures = !reads_whole(job);
    if (request->preset >= 0) {
        options->preset = (enum match_preset)request->preset;
    }
    if (request->speckle_px >= 0) {
        options->speckle_px = request->speckle_px;
    }
}

/// The form of the files.
static void choose_files(struct reconstruct_job *job) {
    job->context.compress = job->request->compress;
    job->context.mesh_unit = job->request->mesh_unit >= 0
                                 ? (enum reconstruct_unit)job->request->mesh_unit
                                 : RECONSTRUCT_MM;
}

/// Frees whole pages of rows [begin, end) of a map, but keeps their addresses.
static void free_rows(void *data, size_t row_bytes, int begin, int end) {
    const size_t page_bytes = (size_t)sysconf(_SC_PAGESIZE);
    char *first = (char *)data + row_bytes * (size_t)begin;
    char *last = (char *)data + row_bytes * (size_t)end;
    first += -(uintptr_t)first % page_bytes;
    last -= (uintptr_t)last % page_bytes;
    if (first < last) {
        (void)mmap(first, (size_t)(last - first), PROT_NONE,
                   MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_FIXED, -1, 0);
    }
}

static void free_map_rows(void *owner, int rows) {
    struct reconstruct_job *job = owner;
    const struct reconstruct_result *result = &job->result;
    const size_t width = (size_t)result->plan.width_px;
    const int begin = job->freed_rows;
    free_rows(result->match.disparity_q8.data, width * sizeof(int32_t), begin, rows);
    free_rows(result->match.reason.data, width, begin, rows);
    free_rows(result->match.confidence.data, width, begin, rows);
    free_rows(result->sigma.data, width, begin, rows);
    job->freed_rows = rows;
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
    context->rows_written = job->frees_maps ? free_map_rows : NULL;
    context->owner = job;
    choose_files(job);
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
static const char *replaced_input(const struct reconstruct_job *job, const char *directory,
                                  const char *name) {
    const struct reconstruct_request *request = job->request;
    // A surface is written again as it was.
    const char *compact_path = is_wanted(job, RESULT_COMPACT) ? NULL : request->compact_path;
    const char *const inputs[] = {
        request->left_path,        request->right_path,        compact_path,
        request->calibration_path, request->ground_truth_path, request->mask_path};
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
    for (int k = 0; input == NULL && request->out_path != NULL && k < RESULT_FORMATS; k++) {
        if (job->program->writers[k] != NULL) {
            name = result_formats[k].file_name;
            input = replaced_input(job, request->out_path, name);
        }
    }
    if (input == NULL && request->debug_path != NULL) {
        option = "--debug";
        for (int k = 0; input == NULL && k < job->program->debug_file_count; k++) {
            name = job->program->debug_files[k];
            input = replaced_input(job, request->debug_path, name);
        }
    }
    return input == NULL
               ? ERROR_OK
               : message_set(message, ERROR_ARGUMENT,
                             "%s would be replaced by the result %s (give %s another name)", input,
                             name, option);
}

/// Which options may explain an image that is not as large as the ground truth; "" for none.
static const char *explain_size(const struct reconstruct_request *request) {
    const bool resized = request->scale < 1 || request->scale > 1;
    const bool cut = request->region_px[2] > 0;
    if (resized && cut) {
        return " (by --region and --scale: compare without them)";
    }
    if (resized) {
        return " (by --scale: compare without it)";
    }
    return cut ? " (by --region: compare without it)" : "";
}

/// Unreadable ground truth is an error; ground truth that cannot be compared gives a warning.
static int check_truth(struct reconstruct_job *job) {
    struct reconstruct_context *context = &job->context;
    const struct rectify_plan *plan = &job->result.plan;
    int size_px[2] = {0, 0};
    if (context->ground_truth_path == NULL) {
        return ERROR_OK;
    }
    if (job->program->check_truth == NULL) {
        reconstruct_context_warn(
            context,
            "--ground-truth is ignored: this program writes no page that would compare with it");
        return ERROR_OK;
    }
    const int error = job->program->check_truth(context, size_px, &job->message);
    if (error != ERROR_OK) {
        return error;
    }
    if (size_px[0] != plan->width_px || size_px[1] != plan->height_px) {
        reconstruct_context_warn(
            context,
            "the ground truth %s is ignored: it is %dx%d pixels, the rectified left image %dx%d%s",
            context->ground_truth_path, size_px[0], size_px[1], plan->width_px, plan->height_px,
            explain_size(job->request));
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
            job->caller->search);
    }
}

/// Whether all names of files are good.
static int check_files(struct reconstruct_job *job) {
    int error = check_readable(job->request->ground_truth_path, &job->message);
    if (error != ERROR_OK) {
        return error;
    }
    error = check_readable(job->request->mask_path, &job->message);
    if (error != ERROR_OK) {
        return error;
    }
    return protect_inputs(job, &job->message);
}

static int prepare(struct reconstruct_job *job) {
    const struct reconstruct_caller *caller = job->caller;
    int error = check_files(job);
    error = error != ERROR_OK ? error
                              : caller->read(caller->source, job->request, &job->inputs,
                                             &job->context, &job->message);
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

static int take_workers(struct reconstruct_job *job) {
    job->workers = job->pool != NULL ? job->pool : workers_create(job->request->threads);
    return job->workers != NULL
               ? ERROR_OK
               : message_set(&job->message, ERROR_MEMORY, "out of memory for threads");
}

/// Reads a surface that was measured already, in place of all stages.
static int restore(struct reconstruct_job *job) {
    const struct reconstruct_request *request = job->request;
    struct reconstruct_context *context = &job->context;
    int error = check_files(job);
    error = error != ERROR_OK ? error : take_workers(job);
    error = error != ERROR_OK ? error
                              : compact_read(request->compact_path, workers_parallel(job->workers),
                                             &job->compact, &job->message);
    if (error != ERROR_OK) {
        return error;
    }
    const double work_ns[RECONSTRUCT_WORK_STAGES] = {[RECONSTRUCT_WORK_WRITE] = 1};
    if (job->caller->expect != NULL) {
        job->caller->expect(job->caller->self, work_ns, RECONSTRUCT_WORK_STAGES);
    }
    *context = job->compact->context;
    job->result = job->compact->result;
    context->caller = job->caller;
    context->result = &job->result;
    context->ground_truth_path = request->ground_truth_path;
    context->mask_path = request->mask_path;
    context->ground_truth_scale = request->ground_truth_scale;
    choose_files(job);
    return check_truth(job);
}

static int allocate(struct reconstruct_job *job) {
    const int error = take_workers(job);
    if (error != ERROR_OK) {
        return error;
    }
    job->context.threads = workers_parallel(job->workers)->threads;
    struct free_space need =
        reconstruct_space_need(&job->context, job->program, job->request->files);
    need.files_bytes = job->request->out_path != NULL ? need.files_bytes : 0;
    job->context.arena_bytes = job->memory_bytes = (size_t)need.memory_bytes;
    if (job->check_space) {
        const struct free_space available = free_space_now(job->files, job->files_limit_bytes);
        if (!free_space_fits(&available, &need)) {
            return reconstruct_space_refuse(&job->context, job->program, job->request->files,
                                            &available, &job->message);
        }
    }
    job->memory = mmap(NULL, job->memory_bytes, PROT_READ | PROT_WRITE,
                       MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (job->memory == MAP_FAILED) {
        job->memory = NULL;
        return message_set(&job->message, ERROR_MEMORY,
                           "out of memory: %.0f MB are required (make the images smaller with %s)",
                           (double)job->memory_bytes / 1e6, job->caller->smaller);
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
    work_ns[RECONSTRUCT_DEVELOP] = 0;  // included in the work of rectification
    work_ns[RECONSTRUCT_RECTIFY] = (develop_ns * raw_pixels + rectify_ns * pixels) / threads;
    work_ns[RECONSTRUCT_MATCH] = match_cell_ns * cells / matching;
    work_ns[RECONSTRUCT_REFINE] = options->refine ? refine_ns * pixels / threads : 0;
    work_ns[RECONSTRUCT_TRIANGULATE] = triangulate_ns * pixels / threads;
    work_ns[RECONSTRUCT_MESH] = mesh_ns * pixels;
    work_ns[RECONSTRUCT_WORK_WRITE] = write_ns * pixels;
}

/// Of the memory of the stages only the result's stays, so that there is more for files.
static void free_working_memory(struct reconstruct_job *job, size_t used_bytes) {
    const size_t page_bytes = (size_t)sysconf(_SC_PAGESIZE);
    const size_t kept_bytes = (used_bytes + page_bytes - 1) / page_bytes * page_bytes;
    if (kept_bytes > 0 && kept_bytes < job->memory_bytes &&
        munmap((char *)job->memory + kept_bytes, job->memory_bytes - kept_bytes) == 0) {
        job->memory_bytes = kept_bytes;
    }
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
    free_working_memory(job, arena.used_bytes);
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

/// Only if a file will contain it.
static int simplify(struct reconstruct_job *job) {
    const struct reconstruct_request *request = job->request;
    const bool requested = request->triangles > 0 || request->error_mm > 0;
    if (job->program->make_mesh == NULL || job->result.triangle_count == 0 ||
        !(is_wanted(job, RESULT_MESH_GLB) || (requested && is_wanted(job, RESULT_MESH_PLY)))) {
        return ERROR_OK;
    }
    const int error = job->program->make_mesh(&job->context, request, &job->mesh, &job->message);
    if (error == ERROR_OK) {
        job->context.mesh_requested = requested;
        job->context.mesh = &job->mesh;
    }
    return error;
}

/// Whether a file has nothing to hold: millimetres, a surface nearer than infinity, or the picture
/// of the right camera.
static bool is_void(const struct reconstruct_job *job, int name) {
    const struct result_format *format = &result_formats[name];
    const bool beyond =
        job->result.triangle_count == 0 && job->result.reason_count[REASON_BEYOND] > 0;
    return (format->metric_only && !job->context.metric) || (format->of_surface && beyond) ||
           (name == RESULT_RIGHT_PNG && job->compact != NULL);
}

static int write_file(struct reconstruct_job *job, int name) {
    char path[ATOMIC_DIR_PATH_BYTES];
    job->caller->progress(job->caller->self, RECONSTRUCT_WORK_WRITE, "write", name, RESULT_FORMATS);
    if (interrupt_requested()) {
        return message_set(&job->message, ERROR_CANCELLED, "%s", interrupted);
    }
    if (!is_wanted(job, name) || is_void(job, name)) {
        return ERROR_OK;
    }
    atomic_dir_file_path(&job->directory, result_formats[name].file_name, path);
    const int error = job->program->writers[name](&job->context, path, &job->message);
    if (error != ERROR_OK) {
        atomic_dir_name_final(&job->directory, &job->message);
    }
    return error;
}

/// Writes into the hidden directory; last what may take the maps with it.
static int write_results(struct reconstruct_job *job) {
    int error = simplify(job);
    for (int i = 0; i < RESULT_FORMATS && error == ERROR_OK; i++) {
        error = i == RESULT_COMPACT ? ERROR_OK : write_file(job, i);
    }
    return error == ERROR_OK ? write_file(job, RESULT_COMPACT) : error;
}

/// Names of the results, of all that the program writes or of those that are wanted. Returns their
/// number.
static int list_names(const struct reconstruct_job *job, bool all, const char **names) {
    int count = 0;
    for (int i = 0; i < RESULT_FORMATS; i++) {
        if (all ? job->program->writers[i] != NULL : is_wanted(job, i)) {
            names[count++] = result_formats[i].file_name;
        }
    }
    return count;
}

static int commit_results(struct reconstruct_job *job) {
    const char *names[RESULT_FORMATS];
    const int count = list_names(job, true, names);
    return atomic_dir_commit(&job->directory, names, count, names[count - 1], &job->message);
}

/// Starts to observe the matcher and creates the hidden directory, if the request asks for images
/// of its stages.
static int begin_debug(struct reconstruct_job *job) {
    const struct reconstruct_program *program = job->program;
    const struct reconstruct_request *request = job->request;
    const int height_px = job->result.plan.height_px;
    if (request->debug_path == NULL) {
        return ERROR_OK;
    }
    INVARIANT(program->debug_file_count > 0);
    const int row = request->debug_row >= 0 ? request->debug_row : height_px / 2;
    if (row >= height_px) {
        return message_set(&job->message, ERROR_ARGUMENT,
                           "--debug-row: no row %d (the rectified left image has 0 to %d)", row,
                           height_px - 1);
    }
    const int error =
        atomic_dir_begin(&job->debug_directory, request->debug_path, program->debug_files,
                         program->debug_file_count, &job->message);
    if (error != ERROR_OK) {
        // Failing to write is a failure, not bad input.
        return error == ERROR_ARGUMENT ? ERROR_BUFFER : error;
    }
    job->debug = program->debug_begin(&job->options, row);
    return job->debug != NULL
               ? ERROR_OK
               : message_set(&job->message, ERROR_MEMORY, "out of memory for --debug");
}

/// Images are also written if no surface was found (`error`), as they may show why. If they cannot
/// be written, nothing is.
static int finish_debug(struct reconstruct_job *job, int error) {
    const struct reconstruct_program *program = job->program;
    struct message message;
    if (job->debug == NULL) {
        return error;
    }
    int failed = program->debug_write(job->debug, &job->context, &job->debug_directory, &message);
    if (failed != ERROR_OK) {
        atomic_dir_name_final(&job->debug_directory, &message);
    } else {
        failed = atomic_dir_commit(&job->debug_directory, program->debug_files,
                                   program->debug_file_count,
                                   program->debug_files[program->debug_file_count - 1], &message);
    }
    if (failed != ERROR_OK) {
        job->message = message;
    }
    return failed != ERROR_OK ? failed : error;
}

static int begin_directory(struct reconstruct_job *job) {
    const char *names[RESULT_FORMATS];
    const int count = list_names(job, false, names);
    if (session_pairs_here(job->request->out_path)) {
        return message_set(&job->message, ERROR_BUFFER,
                           "%s: is a session, which results do not belong into (name another "
                           "directory)",
                           job->request->out_path);
    }
    const int error =
        atomic_dir_begin(&job->directory, job->request->out_path, names, count, &job->message);
    // Failing to write is a failure, not bad input.
    return error == ERROR_ARGUMENT ? ERROR_BUFFER : error;
}

/// All stages.
static int measure(struct reconstruct_job *job) {
    int error = allocate(job);
    if (error != ERROR_OK) {
        return error;
    }
    error = compute(job);
    if (error != ERROR_OK) {
        return error;
    }
    find_common_sigma(job);
    reconstruct_doubts_record(&job->context);
    job->context.notes_measured = job->context.warning_count;
    return ERROR_OK;
}

/// Everything up to the hidden files, or the end of the stream.
static int make_results(struct reconstruct_job *job) {
    const int error = job->compact == NULL ? measure(job) : ERROR_OK;
    if (error != ERROR_OK) {
        return error;
    }
    if (job->request->out_path != NULL) {
        return write_results(job);
    }
    return job->sink != NULL ? compact_send(&job->context, job->sink, &job->message) : ERROR_OK;
}

static int run(struct reconstruct_job *job) {
    int error = job->request->compact_path != NULL ? restore(job) : prepare(job);
    if (error != ERROR_OK) {
        return error;
    }
    const bool writes = job->request->out_path != NULL;
    error = writes ? begin_directory(job) : ERROR_OK;
    if (error != ERROR_OK) {
        return error;
    }
    error = begin_debug(job);
    if (error != ERROR_OK) {
        return error;
    }
    error = make_results(job);
    if (error == ERROR_OK || error == ERROR_NO_SURFACE) {
        error = finish_debug(job, error);
    }
    return error == ERROR_OK && writes ? commit_results(job) : error;
}

static int write_again(struct reconstruct_job *job) {
    if (job->program->make_mesh != NULL) {
        job->program->free_mesh(&job->mesh);
    }
    job->mesh = (struct reconstruct_result){0};
    job->context.mesh = NULL;
    job->context.mesh_requested = false;
    choose_files(job);
    int error = protect_inputs(job, &job->message);
    if (error != ERROR_OK) {
        return error;
    }
    error = begin_directory(job);
    if (error != ERROR_OK) {
        return error;
    }
    error = write_results(job);
    if (error == ERROR_OK) {
        error = commit_results(job);
    }
    atomic_dir_abort(&job->directory);
    return error;
}

int reconstruct_job_write(struct reconstruct_job *job) {
    INVARIANT(job->request->out_path != NULL && (job->memory != NULL || job->compact != NULL));
    job->message.text[0] = '\0';
    interrupt_ask(job->caller->should_stop, job->caller->self);
    const int error = write_again(job);
    interrupt_ask(NULL, NULL);
    INVARIANT(error == ERROR_OK || job->message.text[0] != '\0');
    return error;
}

int reconstruct_job_run(struct reconstruct_job *job) {
    job->start_us = monotonic_now_us();
    job->context.caller = job->caller;
    job->directory = job->debug_directory = (struct atomic_dir){.lock_fd = -1};
    interrupt_ask(job->caller->should_stop, job->caller->self);
    const int error = run(job);
    interrupt_ask(NULL, NULL);
    INVARIANT(error == ERROR_OK || job->message.text[0] != '\0');
    return error;
}

void reconstruct_job_end(struct reconstruct_job *job) {
    if (job->program->make_mesh != NULL) {
        job->program->free_mesh(&job->mesh);
    }
    atomic_dir_abort(&job->debug_directory);
    if (job->debug != NULL) {
        job->program->debug_end(job->debug);
    }
    atomic_dir_abort(&job->directory);
    if (job->pool == NULL) {
        workers_destroy(job->workers);
    }
    if (job->memory != NULL) {
        munmap(job->memory, job->memory_bytes);
    }
    compact_free(job->compact);
    reconstruct_inputs_free(&job->inputs);
}
