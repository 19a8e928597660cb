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
#include "daemon/session/calibration_match.h"
#include "daemon/session/capture.h"
#include "daemon/session/session_pairs.h"
#include "daemon/surface/length_check.h"
#include "daemon/surface/reconstruct_job.h"
#include "daemon/surface/reconstruct_session.h"
#include "daemon/surface/result/result_figures.h"

/// The options follow: the first RECONSTRUCT_SHARED of reconstruct_arguments.
enum { SESSION, OPTIONS, ARGUMENTS = OPTIONS + RECONSTRUCT_SHARED };

/// One call. Allocated, as it is large.
struct surface {
    const struct command_call *call;
    char session[FILES_NAME_MAX + 1];
    char result[FILES_NAME_MAX + 64];
    char out_path[ATOMIC_DIR_PATH_BYTES];
    char *stored;                    // the saved calibration; NULL: none, or not read
    struct session_pairs pairs;      // work space
    struct captured_pair *captured;  // the pair in memory; NULL: the pair is in a session
    struct reconstruct_session source;
    struct reconstruct_request request;
    struct reconstruct_job job;
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
    int error = files_need_directory(call);
    if (error != ERROR_OK) {
        return error;
    }
    if (value->given) {
        error = files_check_plain(call, value->text);
        snprintf(self->session, sizeof self->session, "%s", value->text);
    } else if (self->request.pair == 0 &&
               (self->captured = last_pair_use(&daemon_of(call)->last_pair)) != NULL) {
        snprintf(self->session, sizeof self->session, "%s", self->captured->name);
        return ERROR_OK;
    } else if (!find_newest(daemon_of(call)->files_fd, self->session, &self->pairs)) {
        error =
            command_fail(call, ERROR_MISSING,
                         "reconstruct: no pair and no session with one (\"capture\" makes one)");
    }
    if (error != ERROR_OK) {
        return error;
    }
    // Rejects links: only sessions in "files" are read.
    const int fd = files_open_directory(call, self->session);
    if (fd >= 0) {
        close(fd);
    }
    return fd < 0 ? fd : ERROR_OK;
}

static void load_saved(struct surface *self) {
    const struct hal_store *store = daemon_of(self->call)->store;
    size_t length = 0;
    if (store == NULL) {
        return;
    }
    self->stored = malloc(STORE_CALIBRATION_BYTES);
    const int error = self->stored == NULL
                          ? ERROR_MEMORY
                          : store->operations->load(store->self, STORE_CALIBRATION, self->stored,
                                                    STORE_CALIBRATION_BYTES, &length);
    if (error == ERROR_OK) {
        INVARIANT(length <= STORE_CALIBRATION_BYTES);
        self->source.stored_text = self->stored;
        self->source.stored_length = length;
    } else if (error != ERROR_MISSING) {
        self->source.stored_error = error;  // reported only if the session has no calibration
    }
}

static int make_request(struct surface *self) {
    const struct command_value *values = self->call->values;
    self->request = reconstruct_request_defaults();
    command_store(reconstruct_arguments, RECONSTRUCT_SHARED, values + OPTIONS, &self->request);
    const char *wrong = reconstruct_request_check_search(&self->request);
    if (wrong != NULL) {
        return command_fail(self->call, ERROR_RANGE, "reconstruct: %s", wrong);
    }
    struct message message;
    int error =
        result_format_check(self->request.files, reconstruct_program_system.writers, &message);
    if (error != ERROR_OK) {
        return command_fail(self->call, error, "reconstruct: %s", message.text);
    }
    error = length_check_depth(self->request.depth_mm[0], self->request.depth_mm[1],
                               "reconstruct: near and far", "", &message);
    if (error != ERROR_OK) {
        return command_fail(self->call, error, "%s", message.text);
    }
    self->source.missing = ", and none is saved (\"calibration set FILE\" first)";
    self->source.parent = daemon_of(self->call)->files_fd;
    self->source.path = self->session;
    self->source.number = (uint32_t)self->request.pair;
    return ERROR_OK;
}

/// Reads the session and sets the path of the results, which depends on the pair found.
static int read_session(void *cookie, const struct reconstruct_request *request,
                        struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                        struct message *message) {
    struct surface *self = cookie;
    const char *files = daemon_of(self->call)->config.files;
    const int error = reconstruct_session_read(&self->source, request, inputs, context, message);
    if (error != ERROR_OK) {
        return error;
    }
    struct stat about;
    snprintf(self->result, sizeof self->result, "surface-%s-%u", self->session,
             self->source.pair.pair.number);
    // Rejects links: results are only written in "files".
    if (fstatat(daemon_of(self->call)->files_fd, self->result, &about, AT_SYMLINK_NOFOLLOW) == 0 &&
        S_ISLNK(about.st_mode)) {
        return message_set(message, ERROR_ARGUMENT, "%s: is a link (remove it)", self->result);
    }
    const int length =
        snprintf(self->out_path, sizeof self->out_path, "%s/%s", files, self->result);
    INVARIANT(length > 0 && (size_t)length < sizeof self->out_path);
    return ERROR_OK;
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

static void reply_points(const struct surface *self) {
    const struct reconstruct_result *result = self->job.context.result;
    reply_number(self->call, "points", result_figures_measured_count(result), 0, NULL);
    if (self->job.context.options->fill) {
        reply_number(self->call, "filled", result->reason_count[REASON_FILLED], 0, NULL);
    }
}

static void reply_figures(const struct surface *self) {
    const struct command_call *call = self->call;
    const struct reconstruct_context *context = &self->job.context;
    const struct reconstruct_result *result = context->result;
    struct result_figures_quantiles spread;
    reply_text(call, "session", self->session);
    reply_number(call, "pair", self->source.pair.pair.number, 0, NULL);
    reply_number(call, "skew", (double)self->source.pair.pair.skew_us, 0, "us");
    reply_text(call, "result", self->result);
    reply_text(call, "calibration", context->calibration->id);
    reply_text(call, "calibration_from", self->source.own ? "session" : "kept");
    reply_text(call, "calibration_cut", self->source.cut ? "yes" : "no");
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

/// Adds the warnings to the message, as they are likely causes of the failure.
static int refuse_with_notes(const struct surface *self, int error) {
    const struct reconstruct_context *context = &self->job.context;
    char text[MESSAGE_BYTES];
    size_t length = (size_t)snprintf(text, sizeof text, "%s", self->job.message.text);
    const int notes = error == ERROR_NO_SURFACE ? context->warning_count : 0;
    for (int i = 0; i < notes && length < sizeof text; i++) {
        length += (size_t)snprintf(text + length, sizeof text - length, "; note: %s",
                                   context->warnings[i].text);
    }
    // In this job ERROR_BUFFER is a full disk.
    return command_fail(self->call, error == ERROR_BUFFER ? ERROR_IO : error, "%s", text);
}

/// Leaves the memory of the stages for `system`.
static void keep_peaks(const struct surface *self) {
    struct daemon *daemon = daemon_of(self->call);
    _Static_assert((int)RECONSTRUCT_STAGES <= (int)DAEMON_STAGES_MAX, "all stages fit");
    for (int stage = 0; stage < RECONSTRUCT_STAGES; stage++) {
        daemon->stages[stage].name = reconstruct_stage_text((enum reconstruct_stage)stage);
        daemon->stages[stage].peak_bytes = self->job.result.stage_peak_bytes[stage];
    }
}

static int compute(struct surface *self) {
    const struct reconstruct_caller caller = {.scale = "scale",
                                              .smaller = "scale",
                                              .depth = "near and far",
                                              .search = "near and far",
                                              .accept = CAPTURE_ACCEPT_WORD,
                                              .read = read_session,
                                              .source = self,
                                              .should_stop = should_stop,
                                              .progress = show_progress,
                                              .self = self};
    struct reconstruct_job *job = &self->job;
    self->request.out_path = self->out_path;
    job->program = &reconstruct_program_system;
    job->request = &self->request;
    job->caller = &caller;
    job->check_space = true;
    job->files = daemon_of(self->call)->files_fd;
    job->files_limit_bytes = (uint64_t)daemon_of(self->call)->config.files_limit_mb * 1000000;
    int error = reconstruct_job_run(job);
    keep_peaks(self);
    if (error == ERROR_OK) {
        reply_figures(self);
    } else {
        error = refuse_with_notes(self, error);
    }
    reconstruct_job_end(job);
    return error;
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
        self->source.captured = self->captured;
        load_saved(self);
        error = compute(self);
    }
    last_pair_give_back(self->captured);
    free(self->stored);
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
         "Writes " RESULT_FORMAT_SYSTEM_NAMES "or those that \"files\" lists, to the directory "
         "surface-SESSION-PAIR, which appears once it is complete. Uses the session's "
         "calibration, else the saved one; one of the whole sensor is cut to the frames' window. "
         "1 % of the points are nearer than depth_near, 1 % farther than depth_far. A lower scale "
         "takes less memory and time.",
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
