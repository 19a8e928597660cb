// SPDX-License-Identifier: Apache-2.0
#include "daemon/commands/surface_run.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "console/pair/capture.h"
#include "daemon/commands/commands.h"

static void load_saved(struct surface_run *self) {
    const struct hal_store *store = self->daemon->store;
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

/// Reads the session and sets the path of the results, which depends on the pair found.
static int read_session(void *cookie, const struct reconstruct_request *request,
                        struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                        struct message *message) {
    struct surface_run *self = cookie;
    const int error = reconstruct_session_read(&self->source, request, inputs, context, message);
    snprintf(self->result, sizeof self->result, "surface-%s-%u", self->session,
             self->source.pair.pair.number);
    if (error != ERROR_OK || !self->keep) {
        return error;
    }
    struct stat about;
    // Rejects links: results are only written in "files".
    if (fstatat(self->daemon->files_fd, self->result, &about, AT_SYMLINK_NOFOLLOW) == 0 &&
        S_ISLNK(about.st_mode)) {
        return message_set(message, ERROR_ARGUMENT, "%s: is a link (remove it)", self->result);
    }
    const int length = snprintf(self->out_path, sizeof self->out_path, "%s/%s",
                                self->daemon->config.files, self->result);
    INVARIANT(length > 0 && (size_t)length < sizeof self->out_path);
    return ERROR_OK;
}

/// Leaves the memory of the stages for `system`.
static void keep_peaks(const struct surface_run *self) {
    struct daemon *daemon = self->daemon;
    _Static_assert((int)RECONSTRUCT_STAGES <= (int)DAEMON_STAGES_MAX, "all stages fit");
    for (int stage = 0; stage < RECONSTRUCT_STAGES; stage++) {
        daemon->stages[stage].name = reconstruct_stage_text((enum reconstruct_stage)stage);
        daemon->stages[stage].peak_bytes = self->job.result.stage_peak_bytes[stage];
    }
}

/// Adds the warnings to the message, as they are likely causes of the failure.
static void explain(struct surface_run *self, int error) {
    const struct reconstruct_context *context = &self->job.context;
    size_t length =
        (size_t)snprintf(self->message, sizeof self->message, "%s", self->job.message.text);
    const int notes = error == ERROR_NO_SURFACE ? context->warning_count : 0;
    for (int i = 0; i < notes && length < sizeof self->message; i++) {
        length += (size_t)snprintf(self->message + length, sizeof self->message - length,
                                   "; note: %s", context->warnings[i].text);
    }
}

int surface_run(struct surface_run *self) {
    struct reconstruct_job *job = &self->job;
    self->caller = (struct reconstruct_caller){.scale = "scale",
                                               .smaller = "scale",
                                               .depth = "near and far",
                                               .search = "near and far",
                                               .accept = CAPTURE_ACCEPT_WORD,
                                               .read = read_session,
                                               .source = self,
                                               .should_stop = self->should_stop,
                                               .progress = self->progress,
                                               .self = self->self};
    self->source.missing = ", and none is saved (\"calibration set FILE\" first)";
    self->source.parent = self->daemon->files_fd;
    self->source.path = self->session;
    self->source.number = (uint32_t)self->request.pair;
    self->source.captured = self->captured;
    load_saved(self);
    self->request.out_path = self->keep ? self->out_path : NULL;
    if (self->sink.put != NULL) {
        INVARIANT(!self->keep);
        self->request.files = "";
        job->sink = &self->sink;
    } else if (self->request.files == NULL) {
        self->request.files = SURFACE_RUN_FILES;
    } else if (strcmp(self->request.files, SURFACE_RUN_ALL) == 0) {
        self->request.files = NULL;
    }
    job->program = &reconstruct_program_system;
    job->request = &self->request;
    job->caller = &self->caller;
    job->check_space = true;
    job->frees_maps = self->frees_maps;
    job->files = self->daemon->files_fd;
    job->files_limit_bytes = (uint64_t)self->daemon->config.files_limit_mb * 1000000;
    const int error = reconstruct_job_run(job);
    keep_peaks(self);
    if (error != ERROR_OK) {
        explain(self, error);
    }
    // In this job ERROR_BUFFER is a full disk.
    return error == ERROR_BUFFER ? ERROR_IO : error;
}

static bool should_stop(void *cookie) {
    struct surface_run *self = cookie;
    return atomic_load(&self->stop);
}

static void note_progress(void *cookie, int stage, const char *what, int done, int total) {
    struct surface_run *self = cookie;
    (void)stage;
    atomic_store(&self->stage, what);
    atomic_store(&self->done, done);
    atomic_store(&self->total, total);
}

static void run(void *cookie) {
    struct surface_run *self = cookie;
    self->error = surface_run(self);
}

/// On the rig's thread, every 50 ms.
static void watch(void *cookie) {
    struct surface_run *self = cookie;
    const struct disk_writer *disk_writer = &self->daemon->disk_writer;
    if (disk_writer->meanwhile != NULL) {
        disk_writer->meanwhile(disk_writer->self);  // looks after the rig
    }
    const char *stage = atomic_load(&self->stage);
    const int total = atomic_load(&self->total);
    if (daemon_should_stop(self->call)) {
        atomic_store(&self->stop, true);
    }
    if (stage != NULL && total > 0) {
        daemon_progress(self->call, stage, (uint32_t)atomic_load(&self->done), (uint32_t)total);
    }
}

int surface_run_beside(struct surface_run *self, const struct command_call *call) {
    self->call = call;
    self->daemon = daemon_of(call);
    self->should_stop = should_stop;
    self->progress = note_progress;
    self->self = self;
    struct disk_writer thread = {.meanwhile = watch, .self = self};
    if (!disk_writer_start(&thread)) {
        snprintf(self->message, sizeof self->message, "out of memory for a thread");
        return ERROR_MEMORY;
    }
    disk_writer_run(&thread, run, self);
    disk_writer_stop(&thread);
    return self->error;
}

void surface_run_end(struct surface_run *self) {
    if (self->job.program != NULL) {
        reconstruct_job_end(&self->job);
    }
    last_pair_give_back(self->captured);
    self->captured = NULL;
    free(self->stored);
    self->stored = NULL;
}
