// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_all.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "daemon/base/monotonic.h"
#include "daemon/base/process.h"
#include "daemon/base/workers.h"
#include "daemon/cli/options.h"
#include "daemon/files/directory_names.h"
#include "daemon/session/session_pairs.h"
#include "daemon/surface/result/pairs_table.h"
#include "daemon/surface/result/result_figures.h"

struct all {
    const struct reconstruct_program *program;
    const struct reconstruct_request *request;
    const struct reconstruct_caller *caller;
    struct reconstruct_session *session;
    struct progress *progress;
    struct workers *workers;
    struct pairs_table table;
    int name_width;
    struct message message;
};

// ---- which pairs

static struct pairs_row *add_row(struct pairs_table *table, const char *session, const char *label,
                                 uint32_t number) {
    struct pairs_row *row = pairs_table_add(table);
    if (row == NULL) {
        return NULL;
    }
    row->number = number;
    snprintf(row->session, sizeof row->session, "%s", session);
    const char *slash = label[0] != '\0' && number > 0 ? "/" : "";
    char digits[16] = "";
    if (number > 0) {
        snprintf(digits, sizeof digits, "%04u", (unsigned)number);
    }
    snprintf(row->name, sizeof row->name, "%s%s%s", label, slash, digits);
    return row;
}

static void describe(const struct session_pairs *pairs, struct pairs_row *row) {
    snprintf(row->made_of, sizeof row->made_of,
             "%08" PRIx32 " %08" PRIx32 " %08" PRIx32 " %08" PRIx32, pairs->pair.frame_crc[0],
             pairs->pair.frame_crc[1], pairs->has_calibration ? pairs->calibration_crc : 0,
             pairs->has_zoom_calibration ? pairs->zoom_calibration_crc : 0);
}

/// Adds the pairs of a session; what makes it unreadable is a row of its own, after them.
static int add_session(struct pairs_table *table, const char *path, const char *label,
                       struct message *message) {
    struct session_reader reader;
    struct session_pairs *pairs = calloc(1, sizeof *pairs);
    if (pairs == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", path);
    }
    struct message wrong = {.text = ""};
    struct pairs_row *row = NULL;
    bool memory = true;
    int got = session_reader_open(&reader, AT_FDCWD, path, &pairs->event, &wrong);
    if (got == ERROR_OK) {
        while (memory && (got = session_pairs_next(pairs, &reader, &wrong)) == 1) {
            row = add_row(table, path, label, pairs->count);
            memory = row != NULL;
            if (memory) {
                describe(pairs, row);
            }
        }
        session_reader_close(&reader);
    }
    free(pairs);
    if (memory && got < 0) {
        row = add_row(table, path, label, 0);
        memory = row != NULL;
        if (memory) {
            row->error = got;
            row->message = wrong;
        }
    }
    return memory ? ERROR_OK : message_set(message, ERROR_MEMORY, "%s: out of memory", path);
}

static int add_sessions(struct pairs_table *table, const char *directory, struct message *message) {
    char **names = NULL;
    const int fd = open(directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    const int count = fd >= 0 ? directory_names(fd, &names) : -1;
    const int before = table->count;
    int error = ERROR_OK;
    if (count < 0) {
        error = message_set(message, ERROR_ARGUMENT, "%s: %s", directory, strerror(errno));
    }
    if (fd >= 0) {
        close(fd);
    }
    for (int i = 0; i < count; i++) {
        char path[SESSION_READ_PATH_BYTES];
        const int length = snprintf(path, sizeof path, "%s/%s", directory, names[i]);
        if (error == ERROR_OK && length < (int)sizeof path && session_pairs_here(path)) {
            error = add_session(table, path, names[i], message);
        }
        free(names[i]);
    }
    free(names);
    if (error == ERROR_OK && table->count == before) {
        error = message_set(message, ERROR_ARGUMENT,
                            "%s: neither a session nor a directory of sessions", directory);
    }
    return error;
}

// ---- what they are made with

static void print_text(FILE *stream, const char *name, const char *value) {
    struct stat status;
    fprintf(stream, " --%s %s", name, value);
    if (stat(value, &status) == 0) {
        fprintf(stream, " (%lld bytes of %lld.%09ld)", (long long)status.st_size,
                (long long)status.st_mtim.tv_sec, status.st_mtim.tv_nsec);
    }
}

/// An option, if it is not the default.
static void print_setting(FILE *stream, const struct command_argument *argument,
                          const struct reconstruct_request *request,
                          const struct reconstruct_request *defaults) {
    const char *field = (const char *)request + argument->offset;
    const char *unset = (const char *)defaults + argument->offset;
    const int count = argument->count > 0 ? argument->count : 1;
    if (argument->kind == COMMAND_TEXT) {
        const char *value = *(const char *const *)(const void *)field;
        if (value != NULL) {
            print_text(stream, argument->name, value);
        }
        return;
    }
    if (memcmp(field, unset, options_value_bytes(argument)) == 0) {
        return;
    }
    fprintf(stream, " --%s", argument->name);
    for (int i = 0; i < count && argument->kind != COMMAND_FLAG; i++) {
        if (argument->kind == COMMAND_NUMBER) {
            fprintf(stream, " %.17g", ((const double *)(const void *)field)[i]);
        } else {
            fprintf(stream, " %d", ((const int *)(const void *)field)[i]);
        }
    }
}

/// The program's version and the options that change results; of files also when they were written.
static bool print_settings(const struct reconstruct_request *request, const char *more,
                           char **text) {
    static const char others[] = " all out threads json quiet ";
    const struct reconstruct_request defaults = reconstruct_request_defaults();
    size_t length = 0;
    FILE *stream = open_memstream(text, &length);
    if (stream == NULL) {
        return false;
    }
    fputs(version_text(), stream);
    for (size_t i = 0; i < reconstruct_argument_count; i++) {
        char word[64];
        snprintf(word, sizeof word, " %s ", reconstruct_arguments[i].name);
        if (strstr(others, word) == NULL) {
            print_setting(stream, &reconstruct_arguments[i], request, &defaults);
        }
    }
    fputs(more, stream);
    const bool failed = ferror(stream) != 0;
    return fclose(stream) == 0 && !failed;
}

/// Adds a session, with its name as label unless it is `alone`, or a directory of sessions.
static int add_path(struct pairs_table *table, const char *path, bool alone,
                    struct message *message) {
    if (!session_pairs_here(path)) {
        return add_sessions(table, path, message);
    }
    if (alone) {
        return add_session(table, path, "", message);
    }
    const char *slash = strrchr(path, '/');
    return add_session(table, path, slash != NULL ? slash + 1 : path, message);
}

int reconstruct_all_begin(const struct reconstruct_request *request, const char *const *paths,
                          int count, const char *more, struct pairs_table *table,
                          struct message *message) {
    int error = ERROR_OK;
    if (session_pairs_here(request->out_path)) {
        return message_set(message, ERROR_BUFFER,
                           "%s: is a session, which results do not belong into (name another "
                           "directory)",
                           request->out_path);
    }
    for (int i = 0; i < count && error == ERROR_OK; i++) {
        error = add_path(table, paths[i], count == 1, message);
    }
    if (error == ERROR_OK && !print_settings(request, more, &table->settings)) {
        error = message_set(message, ERROR_MEMORY, "out of memory");
    }
    if (error == ERROR_OK) {
        pairs_table_keep(table, request->out_path);
    }
    return error;
}

// ---- the work

static void print_line(const struct all *self, const struct pairs_row *row) {
    if (self->request->json || self->request->quiet) {
        return;
    }
    printable_print(stdout, row->name);
    const int gap = self->name_width - (int)strlen(row->name);
    printf("%*s", gap > 0 ? gap : 0, "");
    if (row->done) {
        char depth[24] = "-", sigma[24] = "-";
        if (isfinite(row->depth_mm)) {
            snprintf(depth, sizeof depth, "%.1f", row->depth_mm);
        }
        if (isfinite(row->sigma_mm)) {
            snprintf(sigma, sizeof sigma, "%.3g", row->sigma_mm);
        }
        printf("  %9" PRIu32 "  %9s  %8s  %7.1f  %5d%s\n", row->points, depth, sigma, row->seconds,
               row->notes, row->kept ? "  kept" : "");
    } else {
        puts("  failed");
    }
    fflush(stdout);
}

static void fill_row(struct pairs_row *row, const struct reconstruct_job *job) {
    const struct reconstruct_context *context = &job->context;
    row->done = true;
    row->points = surface_figures_measured_count(&job->result);
    row->notes = context->warning_count;
    if (context->metric && context->has_spread) {
        row->depth_mm = context->spread.depth_mm[1];
        row->sigma_mm = job->options.refine ? context->spread.sigma_mm[1] : NAN;
    }
    row->seconds = (double)(monotonic_now_us() - job->start_us) / 1e6;
}

static void measure(struct all *self, struct pairs_row *row) {
    struct reconstruct_request request = *self->request;
    struct reconstruct_caller caller = *self->caller;
    char out[SESSION_READ_PATH_BYTES];
    struct reconstruct_job job = {
        .program = self->program, .request = &request, .caller = &caller, .pool = self->workers};
    if (snprintf(out, sizeof out, "%s/%s", self->request->out_path, row->name) >= (int)sizeof out) {
        row->error = message_set(&row->message, ERROR_ARGUMENT, "path too long");
        return;
    }
    request.out_path = out;
    request.session_path = self->session->path = row->session;
    self->session->number = row->number;
    caller.read = reconstruct_session_read;
    caller.source = self->session;
    row->error = reconstruct_job_run(&job);
    if (row->error == ERROR_OK) {
        fill_row(row, &job);
    } else {
        row->message = job.message;
    }
    reconstruct_job_end(&job);
}

static void report_failure(const struct pairs_row *row) {
    fputs("vergence reconstruct: ", stderr);
    printable_print(stderr, row->name);
    fprintf(stderr, "%s%s\n", row->name[0] != '\0' ? ": " : "", row->message.text);
}

/// Measures what is missing. What no pair can do without ends it.
static int measure_all(struct all *self) {
    int first = ERROR_OK;
    for (int i = 0; i < self->table.count; i++) {
        struct pairs_row *row = &self->table.rows[i];
        if (!row->done && row->error == ERROR_OK) {
            progress_begin(self->progress, self->request->quiet);
            measure(self, row);
            progress_end(self->progress);
        }
        if (row->error == ERROR_CANCELLED) {
            return message_set(&self->message, ERROR_CANCELLED,
                               "interrupted; the same command continues");
        }
        print_line(self, row);
        if (row->error != ERROR_OK) {
            report_failure(row);
            first = first != ERROR_OK ? first : row->error;
        }
        const int error =
            row->done && !row->kept
                ? pairs_table_save(&self->table, self->request->out_path, &self->message)
                : ERROR_OK;
        if (error != ERROR_OK || row->error == ERROR_FULL) {
            return error != ERROR_OK ? error
                                     : message_set(&self->message, ERROR_FULL,
                                                   "no space; the same command continues");
        }
    }
    return first;
}

static void print_end(const struct all *self, uint64_t begin_us) {
    int done = 0, kept = 0, failed = 0;
    for (int i = 0; i < self->table.count; i++) {
        done += self->table.rows[i].done && !self->table.rows[i].kept;
        kept += self->table.rows[i].kept;
        failed +=
            self->table.rows[i].error != ERROR_OK && self->table.rows[i].error != ERROR_CANCELLED;
    }
    if (self->request->json) {
        pairs_table_print(&self->table, stdout);
    } else if (!self->request->quiet) {
        printf("%d pair%s: %d measured in %.1f s, %d kept, %d failed\n", self->table.count,
               self->table.count == 1 ? "" : "s", done,
               (double)(monotonic_now_us() - begin_us) / 1e6, kept, failed);
    }
}

static int run(struct all *self) {
    const uint64_t begin_us = monotonic_now_us();
    int error = reconstruct_all_begin(self->request, &self->request->session_path, 1, "",
                                      &self->table, &self->message);
    if (error != ERROR_OK) {
        return error;
    }
    self->workers = workers_create(self->request->threads);
    if (self->workers == NULL) {
        return message_set(&self->message, ERROR_MEMORY, "out of memory");
    }
    for (int i = 0; i < self->table.count; i++) {
        const int width = (int)strlen(self->table.rows[i].name);
        self->name_width = width > self->name_width ? width : self->name_width;
    }
    if (!self->request->json && !self->request->quiet) {
        printf("%-*s  %9s  %9s  %8s  %7s  %5s\n", self->name_width, "pair", "points", "depth mm",
               "sigma mm", "seconds", "notes");
    }
    error = measure_all(self);
    const int saved = error == ERROR_FULL
                          ? ERROR_OK
                          : pairs_table_save(&self->table, self->request->out_path, &self->message);
    print_end(self, begin_us);
    return error != ERROR_OK ? error : saved;
}

int reconstruct_all_run(const struct reconstruct_program *program,
                        const struct reconstruct_request *request,
                        const struct reconstruct_caller *caller,
                        struct reconstruct_session *session, struct progress *progress) {
    struct all self = {.program = program,
                       .request = request,
                       .caller = caller,
                       .session = session,
                       .progress = progress,
                       .name_width = (int)sizeof "pair" - 1};
    const int error = run(&self);
    if (self.message.text[0] != '\0') {
        fprintf(stderr, "vergence reconstruct: %s\n", self.message.text);
    }
    workers_destroy(self.workers);
    pairs_table_free(&self.table);
    return error;
}
