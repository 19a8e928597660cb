// SPDX-License-Identifier: Apache-2.0
// Reconstructs a surface from a captured pair into a directory of the instrument's files. It does
// not use the rig, so the next pair can be aimed meanwhile.
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"
#include "daemon/commands/surface_run.h"
#include "daemon/session/session_pairs.h"
#include "daemon/surface/length_check.h"
#include "daemon/surface/result/result_figures.h"

/// The options follow: the first RECONSTRUCT_SHARED of reconstruct_arguments.
enum { SESSION, OPTIONS, ARGUMENTS = OPTIONS + RECONSTRUCT_SHARED };

/// One call. Allocated, as it is large.
struct surface {
    const struct command_call *call;
    struct session_pairs pairs;  // work space
    struct surface_run run;
};

/// Whether a session can be read and has no pair: a capture was killed, or nothing was captured
/// yet. False for a damaged session, whose reader then reports the damage.
static bool is_empty(int root, const char *name, struct session_pairs *pairs) {
    struct session_reader reader;
    struct message message;
    memset(pairs, 0, sizeof *pairs);
    if (session_reader_open(&reader, root, name, NULL, &message) != ERROR_OK) {
        return false;
    }
    const bool empty = session_pairs_next(pairs, &reader, &message) == ERROR_MISSING;
    session_reader_close(&reader);
    return empty;
}

/// Finds the session whose index was written last, of those with a pair. False: none.
static bool find_newest(int root, char *name, struct session_pairs *pairs) {
    DIR *directory = files_list_below(root, "");
    struct timespec newest = {0, 0};
    bool found = false;
    if (directory == NULL) {
        return false;
    }
    for (const struct dirent *entry = readdir(directory); entry != NULL;
         entry = readdir(directory)) {
        char index[FILES_NAME_MAX + sizeof SESSION_INDEX_NAME + 1];
        struct stat about;
        if (entry->d_name[0] == '.' || strlen(entry->d_name) > FILES_NAME_MAX) {
            continue;
        }
        snprintf(index, sizeof index, "%.*s/" SESSION_INDEX_NAME, (int)FILES_NAME_MAX,
                 entry->d_name);
        if (fstatat(root, index, &about, AT_SYMLINK_NOFOLLOW) != 0) {
            continue;
        }
        const struct timespec when = about.st_mtim;
        const bool newer = !found || when.tv_sec > newest.tv_sec ||
                           (when.tv_sec == newest.tv_sec && when.tv_nsec > newest.tv_nsec);
        if (newer && !is_empty(root, entry->d_name, pairs)) {
            found = true;
            newest = when;
            strcpy(name, entry->d_name);
        }
    }
    closedir(directory);
    return found;
}

/// Chooses the session that was named, else the last pair in memory, else the newest session.
static int choose_session(struct surface *self) {
    const struct command_call *call = self->call;
    const struct command_value *value = &call->values[SESSION];
    struct surface_run *run = &self->run;
    int error = files_need_directory(call);
    if (error != ERROR_OK) {
        return error;
    }
    if (value->given) {
        error = files_check_plain(call, value->text);
        snprintf(run->session, sizeof run->session, "%s", value->text);
    } else if (run->request.pair == 0 &&
               (run->captured = last_pair_use(&daemon_of(call)->last_pair)) != NULL) {
        snprintf(run->session, sizeof run->session, "%s", run->captured->name);
        return ERROR_OK;
    } else if (!find_newest(daemon_of(call)->files_fd, run->session, &self->pairs)) {
        error =
            command_fail(call, ERROR_MISSING,
                         "reconstruct: no pair and no session with one (\"capture\" makes one)");
    }
    if (error != ERROR_OK) {
        return error;
    }
    // Rejects links: only sessions in "files" are read.
    const int fd = files_open_directory(call, run->session);
    if (fd >= 0) {
        close(fd);
    }
    return fd < 0 ? fd : ERROR_OK;
}

static int make_request(struct surface *self) {
    const struct command_value *values = self->call->values;
    struct reconstruct_request *request = &self->run.request;
    *request = reconstruct_request_defaults();
    command_store(reconstruct_arguments, RECONSTRUCT_SHARED, values + OPTIONS, request);
    const char *wrong = reconstruct_request_check_search(request);
    if (wrong != NULL) {
        return command_fail(self->call, ERROR_RANGE, "reconstruct: %s", wrong);
    }
    struct message message;
    const bool all = request->files != NULL && strcmp(request->files, SURFACE_RUN_ALL) == 0;
    int error =
        all ? ERROR_OK
            : result_format_check(request->files, reconstruct_program_system.writers, &message);
    if (error != ERROR_OK) {
        return command_fail(self->call, error, "reconstruct: %s", message.text);
    }
    error = length_check_depth(request->depth_mm[0], request->depth_mm[1],
                               "reconstruct: near and far", "", &message);
    return error == ERROR_OK ? ERROR_OK : command_fail(self->call, error, "%s", message.text);
}

static bool should_stop(void *cookie) {
    const struct surface *self = cookie;
    return daemon_should_stop(self->call);
}

static void show_progress(void *cookie, int stage, const char *what, int done, int total) {
    const struct surface *self = cookie;
    (void)stage;
    if (total > 0) {
        daemon_progress(self->call, what, (uint32_t)done, (uint32_t)total);
    }
}

static void send_bytes(void *cookie, const void *bytes, size_t length) {
    const struct surface *self = cookie;
    worker_send(job_of(self->call)->worker, bytes, length);
}

/// Whether the client takes the surface as it is made: a program that reads bytes and names no
/// files.
static bool is_streamed(const struct surface *self) {
    const struct job *job = job_of(self->call);
    return job->request.binary && !job->request.framed && !job->terminal && !job->watch.on &&
           self->run.request.files == NULL;
}

static void reply_points(const struct surface *self) {
    const struct reconstruct_result *result = self->run.job.context.result;
    reply_number(self->call, "points", surface_figures_measured_count(result), 0, NULL);
    if (self->run.job.context.options->fill) {
        reply_number(self->call, "filled", result->reason_count[REASON_FILLED], 0, NULL);
    }
}

static void reply_figures(const struct surface *self) {
    const struct command_call *call = self->call;
    const struct reconstruct_context *context = &self->run.job.context;
    const struct reconstruct_result *result = context->result;
    struct surface_figures_spread spread;
    reply_text(call, "session", self->run.session);
    reply_number(call, "pair", self->run.source.pair.pair.number, 0, NULL);
    reply_number(call, "skew", (double)self->run.source.pair.pair.skew_us, 0, "us");
    reply_text(call, "result", self->run.result);
    reply_text(call, "calibration", context->calibration->id);
    reply_text(call, "calibration_from", self->run.source.own ? "session" : "kept");
    reply_text(call, "calibration_cut", self->run.source.cut ? "yes" : "no");
    reply_points(self);
    reply_number(call, "triangles", result->triangle_count, 0, NULL);
    reply_number(call, "density", result_figures_density_percent(result), 1, "%");
    if (result->vertex_count > 0 && reconstruct_context_spread(context, &spread)) {
        reply_number(call, "depth_median", spread.depth_mm[1], 3, "mm");
        reply_number(call, "depth_near", spread.depth_mm[0], 3, "mm");
        reply_number(call, "depth_far", spread.depth_mm[2], 3, "mm");
        reply_number(call, "depth_sigma", spread.sigma_mm[1], 3, "mm");
    }
    const double common_mm = context->depth_sigma_common_mm;
    if (common_mm >= 0) {
        reply_number(call, "depth_sigma_common", common_mm, 3, "mm");
    }
    if (context->self_calibrated) {
        reply_number(call, "corrected_by", context->self_calibration.used, 0, NULL);
        reply_text(call, "health", adjust_health_text(context->self_calibration.health));
        if (context->with_pair > 0) {
            reply_text(call, "with_pair", context->with_pair_used ? "pan stood still" : "not used");
        }
        reply_number(call, "rows_refined", context->self_calibration.rows_px, 3, "px");
        commands_calibration_adjusted(call, &context->self_calibration);
    }
    if (context->mismatch.text[0] != '\0') {
        reply_text(call, "accepted_mismatch", context->mismatch.text);
    }
    if (result->vertical.samples > 0) {
        reply_number(call, "rows_apart", result->vertical.median_px, 3, "px");
    }
    reply_number(call, "time", (double)context->total_us / 1e6, 2, "s");
    reply_group_begin(call, "notes", true);
    for (int i = 0; i < context->warning_count; i++) {
        reply_text(call, NULL, context->warnings[i].text);
    }
    reply_group_end(call);
}

static int compute(struct surface *self) {
    struct surface_run *run = &self->run;
    run->daemon = daemon_of(self->call);
    run->frees_maps = true;
    run->keep = !is_streamed(self);
    if (!run->keep) {
        run->sink = (struct output_sink){send_bytes, self};
    }
    run->should_stop = should_stop;
    run->progress = show_progress;
    run->self = self;
    const int error = surface_run(run);
    if (error != ERROR_OK) {
        return command_fail(self->call, error, "%s", run->message);
    }
    reply_figures(self);
    return ERROR_OK;
}

static int run_reconstruct(const struct command_call *call) {
    struct surface *self = calloc(1, sizeof *self);
    if (self == NULL) {
        return command_fail(call, ERROR_MEMORY, "reconstruct: out of memory");
    }
    self->call = call;
    int error = make_request(self);
    if (error == ERROR_OK) {
        error = choose_session(self);
    }
    if (error == ERROR_OK) {
        error = compute(self);
    }
    surface_run_end(&self->run);
    free(self);
    return error;
}

static struct command_argument arguments[ARGUMENTS] = {
    {.name = "SESSION",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = FILES_NAME_MAX,
     .optional = true,
     .help =
         "session of the pair; default: the pair captured last, in memory, else the newest session",
     .candidates = files_candidates_session},
};

static const struct command commands[] = {
    {.name = "reconstruct",
     .summary = "measure a surface from the last pair, or from a recorded one",
     .help =
         "Writes " SURFACE_RUN_FILES ", of which \"vergence reconstruct\" makes all other files on "
         "a PC, or what \"files\" lists of " RESULT_FORMAT_SYSTEM_NAMES "or \"all\", to the "
         "directory surface-SESSION-PAIR, which appears once it is complete. Uses the session's "
         "calibration, else the saved one; one of the whole sensor is cut to the frames' window. "
         "1 % of the points are nearer than depth_near, 1 % farther than depth_far. A lower scale "
         "takes less memory and time. A program that asks with @binary, without \"files\", gets "
         "the bytes of surface.compact before the answer, and nothing is written; not over a "
         "serial line with CRCs.",
     .arguments = arguments,
     .argument_count = ARGUMENTS,
     .flags = COMMAND_NO_RIG | COMMAND_LONG | COMMAND_GROUP_MEASURE | COMMAND_DAILY,
     .run = run_reconstruct},
};

const struct command *commands_reconstruct_table(size_t *count) {
    memcpy(&arguments[OPTIONS], reconstruct_arguments,
           RECONSTRUCT_SHARED * sizeof reconstruct_arguments[0]);
    *count = 1;
    return commands;
}
