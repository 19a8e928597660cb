// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/record.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/memory.h"
#include "daemon/base/raw_memory.h"
#include "daemon/files/file_io.h"
#include "daemon/files/own_remove.h"
#include "daemon/session/trace.h"

enum piece_kind { LINES, CHECKED_LINES, COMMAND, FRAME };

/// What the disk writer gets: lines of calls.log, a command for the index, or a frame.
struct piece {
    struct disk_writer_task task;
    struct record *record;
    enum piece_kind kind;
    struct raw_image image;  // FRAME: its pixels are `data`
    size_t bytes;
    uint16_t data[];
};

// ---- on the disk writer's thread. `last_error` is written before `failed`, as another thread may
// read it.

static int failed(const struct record *self) {
    return __atomic_load_n(&self->failed, __ATOMIC_ACQUIRE);
}

static void set_failed(struct record *self, int error) {
    __atomic_store_n(&self->failed, error, __ATOMIC_RELEASE);
}

static void give_up(struct record *self) {
    const bool full = file_error_is_full(errno);
    set_failed(self, message_set(&self->last_error, full ? ERROR_FULL : ERROR_IO,
                                 "%s/%s: cannot be written: %s", self->writer->path,
                                 SESSION_CALLS_NAME, strerror(errno)));
}

static void write_text(struct record *self, const char *text, size_t length) {
    INVARIANT(self->writer != NULL && self->log >= 0);
    if (failed(self) == 0 && !write_all(self->log, text, length)) {
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

static void write_piece(struct disk_writer_task *task) {
    struct piece *piece = (struct piece *)task;  // its first member
    struct record *self = piece->record;
    const char *const text = (const char *)piece->data;
    INVARIANT(self->writer != NULL && piece->kind <= FRAME);
    INVARIANT(piece->kind != COMMAND || text[piece->bytes - 1] == '\0');
    if (piece->kind == LINES || piece->kind == CHECKED_LINES) {
        write_text(self, text, piece->bytes);
        if (piece->kind == CHECKED_LINES) {
            write_check(self);
        }
    } else if (failed(self) == 0) {
        uint32_t crc32;
        set_failed(self, piece->kind == COMMAND
                             ? session_writer_command(self->writer, text, &self->last_error)
                             : session_writer_frame(self->writer, &piece->image, &crc32,
                                                    &self->last_error));
    }
    free(piece);
}

static void write_check_and_wait(void *cookie) {
    struct record *self = cookie;
    write_check(self);
    if (failed(self) == 0 && fsync(self->log) != 0) {
        give_up(self);
    }
}

static void write_out_of_memory(struct disk_writer_task *task) {
    char *const place = (char *)task;
    struct record *self = (struct record *)(void *)(place - offsetof(struct record, memory_task));
    if (failed(self) == 0) {
        set_failed(self, message_set(&self->last_error, ERROR_MEMORY,
                                     "%s: recording ended: out of memory", self->writer->path));
    }
}

// ---- on the recording thread

bool record_is_on(const struct record *self) {
    return self->writer != NULL && !self->ending && !self->out_of_memory && failed(self) == 0;
}

/// A piece for the disk writer; NULL: out of memory, which ends the recording.
static struct piece *new_piece(struct record *self, enum piece_kind kind, size_t bytes) {
    INVARIANT(self->writer != NULL);
    struct piece *piece = memory_available_bytes() >= bytes + RAW_MEMORY_RESERVE_BYTES
                              ? malloc(sizeof *piece + bytes)
                              : NULL;
    if (piece != NULL) {
        *piece = (struct piece){.task = {.work = write_piece, .bytes = sizeof *piece + bytes},
                                .record = self,
                                .kind = kind,
                                .bytes = bytes};
    } else if (!self->out_of_memory) {
        // A job too, as only the disk writer may set `last_error`.
        self->out_of_memory = true;
        self->memory_task = (struct disk_writer_task){.work = write_out_of_memory};
        disk_writer_submit(self->disk_writer, &self->memory_task);
    }
    return piece;
}

static void submit(struct record *self, enum piece_kind kind, const char *text, size_t bytes) {
    struct piece *piece = new_piece(self, kind, bytes);
    if (piece != NULL) {
        memcpy(piece->data, text, bytes);
        disk_writer_submit(self->disk_writer, &piece->task);
    }
}

static void submit_lines(struct record *self, enum piece_kind kind) {
    submit(self, kind, self->buffer, self->filled);
    self->filled = 0;
}

static void add_text(struct record *self, const char *text, size_t length) {
    INVARIANT(length <= RECORD_BUFFER_BYTES);
    if (self->filled + length > RECORD_BUFFER_BYTES) {
        submit_lines(self, LINES);
    }
    INVARIANT(self->filled + length <= RECORD_BUFFER_BYTES);
    memcpy(self->buffer + self->filled, text, length);
    self->filled += length;
}

/// The command or idling under way has made a call, or has succeeded: it is part of the recording.
static void release_part(struct record *self) {
    struct record_part *part = &self->part;
    if (!part->held) {
        return;
    }
    INVARIANT(part->bytes <= sizeof part->lines);
    part->held = false;
    if (part->command[0] != '\0') {
        submit(self, COMMAND, part->command, strlen(part->command) + 1);
    }
    add_text(self, part->lines, part->bytes);
}

/// Begins a command, or idling if `line` is empty.
static void begin_part(struct record *self, const char *line) {
    struct record_part *part = &self->part;
    INVARIANT(strlen(line) < sizeof part->command);
    part->held = record_is_on(self);
    part->begin = self->time;
    strcpy(part->command, line);
    part->bytes = 0;
    if (line[0] == '\0') {
        part->bytes = strlen(TRACE_IDLE "\n");
        memcpy(part->lines, TRACE_IDLE "\n", part->bytes);
        self->time.reads = 0;
    }
}

static void end_part(struct record *self, bool complete) {
    if (self->part.held && complete) {
        release_part(self);
    } else if (self->part.held) {
        self->time = self->part.begin;  // a replay will not read the clock there
    }
    self->part.held = false;
}

void record_call(struct record *self, const char *format, ...) {
    if (!record_is_on(self)) {
        return;
    }
    char line[TRACE_LINE_MAX + 1];
    const struct hal_clock *clock = self->inner.clock;
    const uint64_t before_us = self->time.us;
    self->time = (struct record_time){.us = clock->operations->now_us(clock->self)};
    INVARIANT(self->time.us >= before_us);
    int length = snprintf(line, sizeof line, "%" PRIu64 " ", self->time.us);
    va_list arguments;
    va_start(arguments, format);
    length += vsnprintf(line + length, sizeof line - (size_t)length, format, arguments);
    va_end(arguments);
    INVARIANT(length > 0 && (size_t)length < sizeof line);
    line[length] = '\n';
    release_part(self);
    self->calls++;
    add_text(self, line, (size_t)length + 1);
}

uint64_t record_clock(struct record *self, uint64_t now_us) {
    if (!record_is_on(self)) {
        return now_us;
    }
    struct record_part *part = &self->part;
    INVARIANT(now_us >= self->time.us);
    self->time.reads++;
    if (now_us < self->time.us + RECORD_CLOCK_STEP_US) {
        return self->time.us;
    }
    char line[64];
    const size_t length =
        (size_t)snprintf(line, sizeof line, TRACE_TIME "\n", now_us, self->time.reads);
    self->time = (struct record_time){.us = now_us};
    if (part->held && part->bytes + length <= sizeof part->lines) {
        memcpy(part->lines + part->bytes, line, length);
        part->bytes += length;
    } else {
        release_part(self);
        add_text(self, line, length);
    }
    return now_us;
}

bool record_frame(struct record *self, const struct hal_camera_frame *frame, uint32_t *crc32) {
    const struct raw_image *image = &frame->image;
    const size_t row_values = raw_image_row_values(image);
    INVARIANT(image->data != NULL && image->stride >= (ptrdiff_t)row_values);
    const size_t row_bytes = row_values * sizeof(uint16_t);
    struct piece *piece = new_piece(self, FRAME, row_bytes * (size_t)image->height_px);
    if (piece == NULL) {
        return false;
    }
    for (int y = 0; y < image->height_px; y++) {
        memcpy(piece->data + (size_t)y * row_values, raw_image_row(image, y), row_bytes);
    }
    piece->image = *image;
    piece->image.data = piece->data;
    piece->image.stride = (ptrdiff_t)row_values;
    *crc32 = session_writer_frame_crc(&piece->image);
    disk_writer_submit(self->disk_writer, &piece->task);
    return true;
}

// ---- the recording

static void remove_log(const struct record *self, const struct session_writer *writer) {
    own_remove(writer->directory, SESSION_CALLS_NAME,
               &(struct own_proof){.kind = OWN_OPEN, .fd = self->log});
}

/// Creates calls.log and syncs its name, but not its contents.
static int open_log(struct record *self, const struct session_writer *writer,
                    struct message *message) {
    // In an existing directory such a file is not ours.
    self->log = openat(writer->directory, SESSION_CALLS_NAME,
                       O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, SESSION_FILE_MODE);
    if (self->log >= 0 && sync_file(writer->directory)) {
        return ERROR_OK;
    }
    const int number = errno;
    if (self->log >= 0) {
        remove_log(self, writer);
        close(self->log);
        self->log = -1;
    }
    return message_set(message, file_error(number), "%s/%s: cannot be written: %s", writer->path,
                       SESSION_CALLS_NAME, strerror(number));
}

int record_start(struct record *self, struct session_writer *writer, struct message *message) {
    INVARIANT(self->writer == NULL);
    const int opened = open_log(self, writer, message);
    if (opened != 0) {
        return opened;
    }
    self->writer = writer;
    self->ending = false;
    self->out_of_memory = false;
    self->failed = 0;
    self->crc = 0;
    self->calls = 0;
    self->time = (struct record_time){.us = 0};
    self->part.held = false;
    self->filled = 0;
    // The ports that exist, so that a replay offers the same.
    char lines[128];
    const struct rig_ports *inner = &self->inner;
    const bool one = inner->camera[RIG_LEFT] == inner->camera[RIG_RIGHT];
    const int length =
        snprintf(lines, sizeof lines, TRACE_FIRST_LINE "\n" TRACE_PORTS "\n", inner->i2c != NULL,
                 self->i2c_operations.lines != NULL, inner->gpio != NULL, inner->lens_uart != NULL,
                 (inner->camera[RIG_LEFT] != NULL) + (!one && inner->camera[RIG_RIGHT] != NULL),
                 self->camera_operations[RIG_LEFT].control != NULL,
                 self->camera_operations[RIG_RIGHT].control != NULL);
    add_text(self, lines, (size_t)length);
    const int error = record_flush(self, message);
    if (error != ERROR_OK) {
        struct message again;
        remove_log(self, writer);
        record_stop(self, &again);
    }
    return error;
}

void record_command(struct record *self, const char *line) {
    INVARIANT(line[0] != '\0');
    self->cancelled = false;
    begin_part(self, line);
}

void record_command_end(struct record *self, int error) {
    end_part(self, error == ERROR_OK);
    if (record_is_on(self) && self->filled > 0) {
        submit_lines(self, CHECKED_LINES);  // a killed process loses no finished command
    }
}

int record_run(struct record *self, const struct command *command, const struct command_call *call,
               const char *line) {
    if ((command->flags & (COMMAND_NO_RIG | COMMAND_UNRECORDED)) != 0) {
        return command_run(command, call);
    }
    record_command(self, line);
    const int error = command_run(command, call);
    record_command_end(self, error);
    return error;
}

int record_idle(struct record *self, struct rig *rig) {
    // The command, which may be waiting for the disk.
    const struct record_part command = self->part;
    INVARIANT(rig->ports.clock != NULL);
    begin_part(self, "");
    const int error = rig_idle(rig);
    end_part(self, false);
    self->part = command;
    return error;
}

void record_cancel(struct record *self) {
    // A command without a call is not recorded.
    if (record_is_on(self) && !self->cancelled && !self->part.held) {
        self->cancelled = true;
        add_text(self, TRACE_CANCEL "\n", strlen(TRACE_CANCEL "\n"));
    }
}

int record_flush(struct record *self, struct message *message) {
    if (self->writer == NULL) {
        return ERROR_OK;
    }
    INVARIANT(self->log >= 0);
    submit_lines(self, LINES);
    disk_writer_run(self->disk_writer, write_check_and_wait, self);
    const int error = failed(self);
    return error != ERROR_OK ? message_set(message, error, "%s", self->last_error.text) : ERROR_OK;
}

uint64_t record_now_us(const struct record *self) {
    const struct hal_clock *clock = self->inner.clock;
    return clock->operations->now_us(clock->self);
}

bool record_is_under_way(const struct record *self) {
    return self->writer != NULL;
}

const char *record_cut(const struct record *self) {
    return self->writer != NULL && failed(self) != 0 ? self->last_error.text : NULL;
}

int record_stop(struct record *self, struct message *message) {
    self->ending = true;
    const int code = record_flush(self, message);
    if (self->log >= 0) {
        close(self->log);
    }
    self->log = -1;
    self->writer = NULL;
    return code;
}
