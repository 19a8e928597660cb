// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/session_write.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/directory_names.h"
#include "daemon/files/file_io.h"
#include "daemon/files/own_remove.h"
#include "daemon/session/session_files.h"
#include "daemon/session/session_read.h"

#define DIRECTORY_MODE 0750
enum { SUM_BYTES = 4096 };

static int fail(const struct session_writer *self, const char *name, struct message *message) {
    const int reason = errno;
    const bool full = file_error_is_full(reason);
    return message_set(message, full ? ERROR_FULL : ERROR_IO, "%s/%s: cannot be written: %s",
                       self->path, name, strerror(reason));
}

/// Appends a line; it is on disk when this returns 0, lines of registers with the next line of
/// another kind. An incomplete line is cut off again, here or by the next call.
static int append(struct session_writer *self, const char *line, size_t length,
                  struct message *message) {
    const bool later = self->event.kind == SESSION_REGISTERS;
    INVARIANT(self->index >= 0 && self->good_bytes >= 0);
    if (ftruncate(self->index, self->good_bytes) != 0 ||
        lseek(self->index, self->good_bytes, SEEK_SET) != self->good_bytes ||
        !write_all(self->index, line, length) || (!later && fsync(self->index) != 0)) {
        const int code = fail(self, SESSION_INDEX_NAME, message);
        // If this fails too, readers skip the incomplete line.
        if (ftruncate(self->index, self->good_bytes) == 0) {
            fsync(self->index);
        }
        return code;
    }
    self->good_bytes += (int64_t)length;
    self->crc = crc_update(self->crc, line, length);
    return 0;
}

static int append_event(struct session_writer *self, struct message *message) {
    char line[SESSION_LINE_MAX + 1 + 1 + SESSION_CRC_DIGITS + 1 + 1];
    const int length = session_event_print(&self->event, line);
    if (length < 0) {
        return message_set(message, length, "%s: the event is too long, or its frame is invalid",
                           self->path);
    }
    const uint32_t crc = crc_update(self->crc, line, (size_t)length);
    const int tail = snprintf(line + length, sizeof line - (size_t)length, " %08" PRIx32 "\n", crc);
    return append(self, line, (size_t)(length + tail), message);
}

static int name_is_taken(const char *path, struct message *message) {
    return message_set(message, ERROR_ARGUMENT,
                       "%s: already contains a session (give another name)", path);
}

static bool is_empty(int parent, const char *path) {
    char **names = NULL;
    const int directory = openat(parent, path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    const int count = directory < 0 ? 0 : directory_names(directory, &names);
    for (int i = 0; i < count; i++) {
        free(names[i]);
    }
    free(names);
    if (directory >= 0) {
        close(directory);
    }
    return count <= 0;
}

bool session_writer_exists(int parent, const char *path) {
    char index[SESSION_WRITE_PATH_BYTES + sizeof SESSION_INDEX_NAME + 1];
    struct stat status;
    snprintf(index, sizeof index, "%s/" SESSION_INDEX_NAME, path);
    return fstatat(parent, index, &status, AT_SYMLINK_NOFOLLOW) == 0;
}

int session_writer_check(int parent, const char *path, struct message *message) {
    struct stat status;
    if (fstatat(parent, path, &status, AT_SYMLINK_NOFOLLOW) != 0) {
        return ERROR_OK;  // other errors show when it is created
    }
    if (!S_ISDIR(status.st_mode)) {
        return message_set(message, ERROR_ARGUMENT,
                           "%s: exists and is not a directory (give another name)", path);
    }
    // Other things in it would look like a part of the session.
    if (session_writer_exists(parent, path)) {
        return name_is_taken(path, message);
    }
    return is_empty(parent, path) ? 0
                                  : message_set(message, ERROR_ARGUMENT,
                                                "%s: exists and contains other things (give "
                                                "another name)",
                                                path);
}

static int begin_directory(struct session_writer *self, int parent, struct message *message) {
    self->made = mkdirat(parent, self->path, DIRECTORY_MODE) == 0;
    if (!self->made && errno != EEXIST) {
        return message_set(message, file_error(errno), "%s: cannot be created: %s", self->path,
                           strerror(errno));
    }
    self->directory = openat(parent, self->path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    // Only a directory without an index may become a session; an index is never overwritten.
    self->index = self->directory < 0
                      ? -1
                      : openat(self->directory, SESSION_INDEX_NAME,
                               O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, SESSION_FILE_MODE);
    if (self->index < 0) {
        const int reason = errno;
        if (self->directory >= 0) {
            close(self->directory);
            self->directory = -1;
        }
        if (self->made) {
            own_remove(parent, self->path, &(struct own_proof){.kind = OWN_EMPTY});
        }
        return reason == EEXIST
                   ? name_is_taken(self->path, message)
                   : message_set(message, file_error(reason), "%s: cannot begin a session: %s",
                                 self->path, strerror(reason));
    }
    return ERROR_OK;
}

static void copy_text(char *target, size_t bytes, const char *text) {
    snprintf(target, bytes, "%s", text != NULL ? text : "");
}

/// A writer of the session at `path`, without files yet.
static int set_up(struct session_writer *self, const char *path, struct message *message) {
    memset(self, 0, sizeof *self);
    self->directory = self->index = -1;
    self->free_bytes = UINT64_MAX;
    if (strlen(path) >= sizeof self->path) {
        return message_set(message, ERROR_ARGUMENT, "%s: name too long", path);
    }
    copy_text(self->path, sizeof self->path, path);
    return ERROR_OK;
}

int session_writer_begin(struct session_writer *self, int parent, const char *path,
                         const char *build, const char *profile, const char *date,
                         struct message *message) {
    int code = set_up(self, path, message);
    code = code != 0 ? code : begin_directory(self, parent, message);
    if (code != 0) {
        return code;
    }
    struct session_event *event = &self->event;
    event->kind = SESSION_BEGIN;
    event->version = SESSION_VERSION;
    copy_text(event->build, sizeof event->build, build);
    copy_text(event->profile, sizeof event->profile, profile);
    copy_text(event->date, sizeof event->date, date);
    int appended = append_event(self, message);
    // The index's name is in the session's directory, whose name is in its parent.
    if (appended == 0 &&
        !(sync_file(self->directory) && sync_directory_at(self->directory, ".."))) {
        appended = fail(self, SESSION_INDEX_NAME, message);
    }
    if (appended != 0) {
        session_writer_discard(self, parent);
    }
    return appended;
}

int session_writer_instrument(struct session_writer *self, const struct pair_instrument *instrument,
                              struct message *message) {
    self->event.kind = SESSION_INSTRUMENT;
    self->event.instrument = *instrument;
    return append_event(self, message);
}

static bool is_there(const struct session_writer *self, const char *name) {
    struct stat status;
    return fstatat(self->directory, name, &status, AT_SYMLINK_NOFOLLOW) == 0;
}

// ---- more events of an existing session

/// Where the events end that stay, and the CRC of all before.
static int find_end(struct session_writer *self, int parent, const char *path,
                    struct message *message) {
    struct session_reader reader;
    struct session_event *event = &self->event;
    int got = session_reader_open(&reader, parent, path, event, message);
    if (got != 0) {
        return got;
    }
    if (event->version != SESSION_VERSION) {
        session_reader_close(&reader);
        return message_set(message, ERROR_VERSION,
                           "%s: written by another version (give another name)", path);
    }
    do {
        self->good_bytes = (int64_t)reader.at;
        self->crc = reader.crc;
        got = session_reader_next(&reader, event, message);
        self->pairs += got == 1 && event->kind == SESSION_PAIR;
    } while (got == 1 && event->kind != SESSION_END);
    session_reader_close(&reader);
    return got < 0 ? got : 0;
}

int session_writer_resume(struct session_writer *self, int parent, const char *path,
                          struct message *message) {
    int code = set_up(self, path, message);
    code = code != 0 ? code : find_end(self, parent, path, message);
    if (code != 0) {
        return code;
    }
    self->resumed = true;
    self->resumed_crc = self->crc;
    self->resumed_bytes = self->good_bytes;
    self->directory = openat(parent, path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (self->directory >= 0 && is_there(self, SESSION_CALLS_NAME)) {
        close(self->directory);
        self->directory = -1;
        return message_set(message, ERROR_ARGUMENT,
                           "%s: is a recording, to which nothing is added (give another name)",
                           path);
    }
    self->index = self->directory < 0 ? -1
                                      : openat(self->directory, SESSION_INDEX_NAME,
                                               O_WRONLY | O_NOFOLLOW | O_CLOEXEC);
    if (self->index < 0) {
        const int failed = fail(self, SESSION_INDEX_NAME, message);
        if (self->directory >= 0) {
            close(self->directory);
            self->directory = -1;
        }
        return failed;
    }
    return ERROR_OK;
}

// ---- files named by their contents

/// Gives the temporary file its name once it is on disk. `written`: no error so far.
static int finish_part(struct session_writer *self, struct atomic_file *part, bool written,
                       const char *name, struct message *message) {
    return atomic_file_end(part, written) ? 0 : fail(self, name, message);
}

/// Writes a text under its `name`, and the event in `self->event` that refers to it.
static int write_named(struct session_writer *self, const char *name, const char *text,
                       size_t length, struct message *message) {
    if (!is_there(self, name)) {
        struct atomic_file part;
        if (!atomic_file_begin(&part, self->directory, name, SESSION_FILE_MODE)) {
            return fail(self, name, message);
        }
        const bool written = write_all(part.fd, text, length);
        const int code = finish_part(self, &part, written, name, message);
        if (code != 0) {
            return code;
        }
    }
    return append_event(self, message);
}

int session_writer_calibration(struct session_writer *self, const char *text, size_t length,
                               struct message *message) {
    char name[SESSION_NAME_MAX + 1];
    self->event.kind = SESSION_CALIBRATION;
    self->event.crc32 = crc_update(0, text, length);
    session_calibration_name(self->event.crc32, name);
    return write_named(self, name, text, length, message);
}

int session_writer_zoom_calibration(struct session_writer *self, const char *text, size_t length,
                                    struct message *message) {
    char name[SESSION_NAME_MAX + 1];
    self->event.kind = SESSION_ZOOM_CALIBRATION;
    self->event.crc32 = crc_update(0, text, length);
    session_zoom_calibration_name(self->event.crc32, name);
    return write_named(self, name, text, length, message);
}

/// Receives the bytes of a frame's file: computes their CRC, and optionally writes them.
struct frame_sink {
    unsigned char *buffer;
    size_t capacity, filled;
    int part;  // -1: compute the CRC only
    uint32_t crc;
    bool failed;
};

static void flush_sink(struct frame_sink *sink) {
    sink->crc = crc_update(sink->crc, sink->buffer, sink->filled);
    if (sink->part >= 0 && !sink->failed) {
        sink->failed = !write_all(sink->part, sink->buffer, sink->filled);
    }
    sink->filled = 0;
}

static void sink_byte(struct frame_sink *sink, unsigned byte) {
    if (sink->filled == sink->capacity) {
        flush_sink(sink);
    }
    INVARIANT(sink->filled < sink->capacity);
    sink->buffer[sink->filled++] = (unsigned char)byte;
}

static void pour_frame(const struct raw_image *image, struct frame_sink *sink) {
    char head[SESSION_NAME_MAX + 1];
    const int head_bytes = session_frame_head(image, head);
    for (int i = 0; i < head_bytes; i++) {
        sink_byte(sink, (unsigned char)head[i]);
    }
    const size_t row_values = raw_image_row_values(image);
    const bool wide = session_frame_value_bytes(image) == 2;
    for (int y = 0; y < image->height_px; y++) {
        const uint16_t *row = raw_image_row(image, y);
        for (size_t x = 0; x < row_values; x++) {
            if (wide) {
                sink_byte(sink, row[x] >> 8);
            }
            sink_byte(sink, row[x] & 0xFFu);
        }
    }
    flush_sink(sink);
}

uint32_t session_writer_frame_crc(const struct raw_image *image) {
    unsigned char buffer[SUM_BYTES];
    INVARIANT(image->data != NULL && image->stride >= (ptrdiff_t)raw_image_row_values(image));
    struct frame_sink sum = {.buffer = buffer, .capacity = sizeof buffer, .part = -1};
    pour_frame(image, &sum);
    return sum.crc;
}

int session_writer_frame(struct session_writer *self, const struct raw_image *image,
                         uint32_t *crc32, struct message *message) {
    INVARIANT(image->data != NULL && image->stride >= (ptrdiff_t)raw_image_row_values(image));
    if (image->bits < 8 || image->bits > 16 || image->width_px <= 0 || image->height_px <= 0) {
        return message_set(message, ERROR_RANGE, "%s: invalid frame: %d x %d, %d bits", self->path,
                           image->width_px, image->height_px, image->bits);
    }
    const uint32_t sum = session_writer_frame_crc(image);
    char name[SESSION_NAME_MAX + 1];
    session_frame_name(sum, name);
    if (!is_there(self, name)) {
        const uint64_t bytes = (uint64_t)raw_image_row_values(image) * (uint64_t)image->height_px *
                               (uint64_t)session_frame_value_bytes(image);
        if (bytes > self->free_bytes) {
            errno = ENOSPC;
            return fail(self, name, message);
        }
        self->free_bytes -= self->free_bytes != UINT64_MAX ? bytes : 0;
        struct atomic_file part;
        if (!atomic_file_begin(&part, self->directory, name, SESSION_FILE_MODE)) {
            return fail(self, name, message);
        }
        struct frame_sink file = {
            .buffer = self->buffer, .capacity = sizeof self->buffer, .part = part.fd};
        pour_frame(image, &file);
        const int code = finish_part(self, &part, !file.failed, name, message);
        if (code != 0) {
            return code;
        }
    }
    *crc32 = sum;
    return ERROR_OK;
}

static int write_text(struct session_writer *self, enum session_event_kind kind, const char *text,
                      struct message *message) {
    self->event.kind = kind;
    if (strlen(text) > SESSION_TEXT_MAX) {
        return message_set(message, ERROR_RANGE, "%s: text longer than %d bytes", self->path,
                           SESSION_TEXT_MAX);
    }
    copy_text(self->event.text, sizeof self->event.text, text);
    return append_event(self, message);
}

int session_writer_command(struct session_writer *self, const char *text, struct message *message) {
    return write_text(self, SESSION_COMMAND, text, message);
}

int session_writer_setting(struct session_writer *self, const char *key, const char *value,
                           struct message *message) {
    char text[SESSION_TEXT_MAX + 2];
    snprintf(text, sizeof text, "%s = %s", key, value);
    return write_text(self, SESSION_SETTING, text, message);
}

int session_writer_registers(struct session_writer *self, const char *part, uint64_t at_us,
                             uint16_t first, const uint16_t *values, uint16_t count,
                             struct message *message) {
    struct session_event *event = &self->event;
    INVARIANT(count > 0 && count <= SESSION_REGISTERS_MAX);
    event->kind = SESSION_REGISTERS;
    event->at_us = at_us;
    event->first = first;
    event->count = count;
    copy_text(event->part, sizeof event->part, part);
    memcpy(event->values, values, count * sizeof *values);
    return append_event(self, message);
}

int session_writer_pair(struct session_writer *self, const struct pair *pair,
                        struct message *message) {
    struct session_event *event = &self->event;
    for (int side = 0; side < RIG_SIDES; side++) {
        const int code =
            session_writer_frame(self, &pair->frame[side].image, &event->frame_crc[side], message);
        if (code != 0) {
            return code;
        }
    }
    event->kind = SESSION_PAIR;
    event->pair = *pair;
    // The instrument counts from bring-up, of which a session may have several.
    event->pair.number = self->pairs + 1;
    const int code = append_event(self, message);
    self->pairs += code == 0;
    return code;
}

/// Ends a resumed session where it ended before: there is space for that.
static void restore_end(struct session_writer *self) {
    struct message ignored;
    self->crc = self->resumed_crc;
    self->good_bytes = self->resumed_bytes;
    self->event.kind = SESSION_END;
    (void)append_event(self, &ignored);
}

int session_writer_end(struct session_writer *self, struct message *message) {
    if (self->index < 0) {
        return 0;
    }
    self->event.kind = SESSION_END;
    const int code = append_event(self, message);
    if (code != 0 && self->resumed) {
        restore_end(self);
    }
    session_writer_leave(self);
    return code;
}

void session_writer_leave(struct session_writer *self) {
    INVARIANT((self->index < 0) == (self->directory < 0));
    if (self->index >= 0) {
        close(self->index);
        close(self->directory);
        self->directory = self->index = -1;
    }
}

void session_writer_discard(struct session_writer *self, int parent) {
    if (self->index < 0) {
        return;
    }
    if (self->resumed) {
        // Frames without an event stay: their names show that they are ours.
        restore_end(self);
        session_writer_leave(self);
        return;
    }
    struct session_files files;
    // Of a directory that existed only the index is known to be this session's.
    if (self->made && session_files_read(&files, self->directory)) {
        session_files_remove(&files);
        session_files_free(&files);
    }
    own_remove(self->directory, SESSION_INDEX_NAME,
               &(struct own_proof){.kind = OWN_OPEN, .fd = self->index});
    if (self->made) {
        own_remove(parent, self->path, &(struct own_proof){.kind = OWN_EMPTY});
    }
    session_writer_leave(self);
}

int session_add_note(int parent, const char *path, const char *text, struct message *message) {
    INVARIANT(text[0] == '#');
    struct session_writer *self = malloc(sizeof *self);
    if (self == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", path);
    }
    int code = session_writer_resume(self, parent, path, message);
    if (code == ERROR_OK) {
        code = session_writer_command(self, text, message);
        if (code == ERROR_OK) {
            code = session_writer_end(self, message);
        } else {
            session_writer_discard(self, parent);
        }
    }
    free(self);
    return code;
}
