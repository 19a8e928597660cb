// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/record_disk.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/files/file_error.h"
#include "daemon/files/write_all.h"

// `last_error` is written before `failed` is set, as another thread may read it.

int record_disk_failed(const struct record *self) {
    return __atomic_load_n(&self->failed, __ATOMIC_ACQUIRE);
}

static void set_failed(struct record *self, int error) {
    __atomic_store_n(&self->failed, error, __ATOMIC_RELEASE);
}

// ---- on the disk writer's thread

static void give_up(struct record *self) {
    const bool full = file_error_is_full(errno);
    set_failed(self, message_set(&self->last_error, full ? ERROR_FULL : ERROR_IO,
                                 "%s/%s: cannot be written: %s", self->writer->path,
                                 SESSION_CALLS_NAME, strerror(errno)));
}

static void write_text(struct record *self, const char *text, size_t length) {
    if (record_disk_failed(self) == 0 && !write_all(self->log, text, length)) {
        give_up(self);
    }
    self->crc = crc_update(self->crc, text, length);
}

/// Writes the CRC of everything so far; a replay uses only what is covered by one.
static void write_check(struct record *self) {
    char line[sizeof TRACE_CHECK + SESSION_CRC_DIGITS + 2];
    const int length = snprintf(line, sizeof line, TRACE_CHECK "%08" PRIx32 "\n", self->crc);
    write_text(self, line, (size_t)length);
}

/// Calls queued for the disk.
struct lines {
    struct disk_writer_task task;
    struct record *record;
    bool checked;  // the CRC follows
    size_t length;
    char text[];
};

static void write_lines(struct disk_writer_task *task) {
    // The job is its first member.
    struct lines *lines = (struct lines *)task;
    write_text(lines->record, lines->text, lines->length);
    if (lines->checked) {
        write_check(lines->record);
    }
    free(lines);
}

/// A frame queued for the disk.
struct frame_copy {
    struct disk_writer_task task;
    struct record *record;
    struct pair_frame frame;
    uint16_t data[];
};

static void write_frame(struct disk_writer_task *task) {
    struct frame_copy *copy = (struct frame_copy *)task;
    struct record *record = copy->record;
    uint32_t crc32 = 0;
    if (record_disk_failed(record) == 0) {
        const int error =
            session_writer_frame(record->writer, &copy->frame, &crc32, &record->last_error);
        if (error != 0) {
            set_failed(record, error);
        }
    }
    free(copy);
}

/// A command queued for the index.
struct command_copy {
    struct disk_writer_task task;
    struct record *record;
    char text[];
};

static void write_command(struct disk_writer_task *task) {
    struct command_copy *copy = (struct command_copy *)task;
    struct record *record = copy->record;
    if (record_disk_failed(record) == 0) {
        const int error = session_writer_command(record->writer, copy->text, &record->last_error);
        if (error != 0) {
            set_failed(record, error);
        }
    }
    free(copy);
}

static void write_check_and_wait(void *cookie) {
    struct record *self = cookie;
    write_check(self);
    if (record_disk_failed(self) == 0 && fsync(self->log) != 0) {
        give_up(self);
    }
}

// ---- on the recording thread

/// A job too, as only the disk writer may set `last_error`.
static void write_out_of_memory(struct disk_writer_task *task) {
    char *const place = (char *)task;
    struct record *self = (struct record *)(void *)(place - offsetof(struct record, memory_task));
    if (record_disk_failed(self) == 0) {
        set_failed(self, message_set(&self->last_error, ERROR_MEMORY,
                                     "%s: recording ended: out of memory", self->writer->path));
    }
}

static void no_memory(struct record *self) {
    if (!self->out_of_memory) {
        self->out_of_memory = true;
        self->memory_task = (struct disk_writer_task){.work = write_out_of_memory};
        disk_writer_submit(self->disk_writer, &self->memory_task);
    }
}

static void hand_over(struct record *self, bool checked) {
    struct lines *lines = malloc(sizeof *lines + self->filled);
    if (lines == NULL) {
        no_memory(self);
    } else {
        *lines = (struct lines){.task = {.work = write_lines, .bytes = self->filled},
                                .record = self,
                                .checked = checked,
                                .length = self->filled};
        memcpy(lines->text, self->buffer, self->filled);
        disk_writer_submit(self->disk_writer, &lines->task);
    }
    self->filled = 0;
}

void record_disk_text(struct record *self, const char *text, size_t length) {
    INVARIANT(length <= RECORD_BUFFER_BYTES);
    if (self->filled + length > RECORD_BUFFER_BYTES) {
        hand_over(self, false);
    }
    memcpy(self->buffer + self->filled, text, length);
    self->filled += length;
}

bool record_disk_frame(struct record *self, const struct hal_camera_frame *frame, uint32_t *crc32) {
    struct pair_frame saved = {.width_px = frame->width_px,
                               .height_px = frame->height_px,
                               .bits = frame->bits,
                               .layout = frame->layout};
    saved.stride = session_frame_row_values(&saved);
    INVARIANT(frame->data != NULL && frame->stride >= saved.stride);
    const size_t row_bytes = saved.stride * sizeof(uint16_t);
    const size_t bytes = sizeof(struct frame_copy) + row_bytes * saved.height_px;
    struct frame_copy *copy = malloc(bytes);
    if (copy == NULL) {
        no_memory(self);
        return false;
    }
    for (size_t y = 0; y < saved.height_px; y++) {
        memcpy(copy->data + y * saved.stride, frame->data + y * frame->stride, row_bytes);
    }
    saved.data = copy->data;
    *crc32 = session_writer_frame_crc(&saved);
    copy->task = (struct disk_writer_task){.work = write_frame, .bytes = bytes};
    copy->record = self;
    copy->frame = saved;
    disk_writer_submit(self->disk_writer, &copy->task);
    return true;
}

void record_disk_command(struct record *self, const char *text) {
    const size_t bytes = sizeof(struct command_copy) + strlen(text) + 1;
    struct command_copy *copy = malloc(bytes);
    if (copy == NULL) {
        no_memory(self);
        return;
    }
    copy->task = (struct disk_writer_task){.work = write_command, .bytes = bytes};
    copy->record = self;
    strcpy(copy->text, text);
    disk_writer_submit(self->disk_writer, &copy->task);
}

void record_disk_send(struct record *self) {
    if (self->filled > 0) {
        hand_over(self, true);
    }
}

int record_disk_flush(struct record *self) {
    hand_over(self, false);
    disk_writer_run(self->disk_writer, write_check_and_wait, self);
    return record_disk_failed(self);
}
