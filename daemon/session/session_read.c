// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/session_read.h"

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
#include "daemon/base/raw_memory.h"

enum { VALUE_ROOM = 4096 };

FILE *session_reader_file(const struct session_reader *self, const char *name,
                          struct message *message) {
    // Neither follow a link out of the session nor block on a pipe without a writer.
    INVARIANT(self->directory >= 0);
    const int file = openat(self->directory, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    struct stat about;
    const bool known = file >= 0 && fstat(file, &about) == 0;
    const bool regular = known && S_ISREG(about.st_mode);
    FILE *stream = regular ? fdopen(file, "rb") : NULL;
    if (stream == NULL) {
        message_set(message, ERROR_MISSING, "%s/%s: cannot be read: %s", self->path, name,
                    known && !regular ? "not a regular file" : strerror(errno));
        if (file >= 0) {
            close(file);
        }
    }
    return stream;
}

/// Reads a whole stream of at most `limit` bytes into memory that the caller frees.
static int slurp(FILE *stream, const char *path, size_t limit, char **text, size_t *length,
                 struct message *message) {
    size_t capacity = 1 << 16, count;
    *length = 0;
    *text = malloc(capacity);
    while (*text != NULL && (count = fread(*text + *length, 1, capacity - *length, stream)) > 0) {
        *length += count;
        if (*length > limit) {
            free(*text);
            return message_set(message, ERROR_TOO_LARGE, "%s: larger than %zu bytes", path, limit);
        }
        if (*length == capacity) {
            capacity *= 2;
            char *more = realloc(*text, capacity);
            if (more == NULL) {
                free(*text);
            }
            *text = more;
        }
    }
    if (*text == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", path);
    }
    if (ferror(stream) != 0) {
        free(*text);
        return message_set(message, ERROR_IO, "%s: cannot be read: %s", path, strerror(errno));
    }
    return ERROR_OK;
}

static int load_index(struct session_reader *self, struct message *message) {
    FILE *stream = session_reader_file(self, SESSION_INDEX_NAME, message);
    if (stream == NULL) {
        return message_set(message, ERROR_ARGUMENT, "%s: not a session (it has no %s)", self->path,
                           SESSION_INDEX_NAME);
    }
    const int code = slurp(stream, self->path, SESSION_READ_INDEX_MAX_BYTES, &self->text,
                           &self->length, message);
    fclose(stream);
    if (code != 0) {
        self->text = NULL;
    }
    return code;
}

/// Whether this is a complete line: its last word is the CRC of everything before it.
static bool crc_fits(const struct session_reader *self, const char *line, size_t length) {
    char word[1 + SESSION_CRC_DIGITS + 1];
    if (length < sizeof word) {
        return false;
    }
    const size_t body = length - (sizeof word - 1);
    snprintf(word, sizeof word, " %08" PRIx32, crc_update(self->crc, line, body));
    return memcmp(line + body, word, sizeof word - 1) == 0;
}

/// Why the present line is not an event.
static int refuse_line(const struct session_reader *self, const char *line,
                       struct message *message) {
    unsigned version = 0;
    if (self->line == 1 && sscanf(line, "begin version=%3u ", &version) == 1 &&
        version > SESSION_VERSION) {
        return message_set(message, ERROR_SYNTAX,
                           "%s: a session of version %u (this program reads up to %d: use a newer "
                           "one)",
                           self->path, version, SESSION_VERSION);
    }
    return message_set(
        message, ERROR_SYNTAX,
        "%s/%s: line %d is not a valid event (if a newer version wrote it, use that one)",
        self->path, SESSION_INDEX_NAME, self->line);
}

int session_reader_next(struct session_reader *self, struct session_event *event,
                        struct message *message) {
    INVARIANT(self->at <= self->length);
    if (self->at == self->length) {
        self->cut = !self->ended;
        return 0;
    }
    const char *const line = self->text + self->at;
    const char *const end = memchr(line, '\n', self->length - self->at);
    const bool last = end == NULL || end + 1 == self->text + self->length;
    const size_t length = end != NULL ? (size_t)(end - line) : self->length - self->at;
    if (end == NULL || !crc_fits(self, line, length)) {
        if (last) {
            self->at = self->length;
            self->cut = true;
            return 0;
        }
        return message_set(message, ERROR_CRC, "%s/%s: line %d is damaged (CRC mismatch)",
                           self->path, SESSION_INDEX_NAME, self->line + 1);
    }
    self->line++;
    const int code = session_event_parse(line, length - (1 + SESSION_CRC_DIGITS), event);
    if (code != 0 || self->ended || (event->kind == SESSION_BEGIN) != (self->line == 1)) {
        return refuse_line(self, line, message);
    }
    self->crc = crc_update(self->crc, line, length + 1);
    self->at += length + 1;
    self->ended = event->kind == SESSION_END;
    return 1;
}

void session_reader_rewind(struct session_reader *self) {
    const char *const end = memchr(self->text, '\n', self->length);
    INVARIANT(end != NULL);  // the first event was read
    self->at = (size_t)(end + 1 - self->text);
    self->crc = crc_update(0, self->text, self->at);
    self->line = 1;
    self->ended = false;
    self->cut = false;
}

int session_reader_open(struct session_reader *self, int parent, const char *path,
                        struct session_event *begin, struct message *message) {
    memset(self, 0, sizeof *self);
    self->directory = -1;
    if (strlen(path) >= sizeof self->path) {
        return message_set(message, ERROR_ARGUMENT, "%s: name too long", path);
    }
    snprintf(self->path, sizeof self->path, "%s", path);
    // On a PC a session may be given by a link; for clients no link may lead out of "files".
    const int links = parent == AT_FDCWD ? 0 : O_NOFOLLOW;
    self->directory = openat(parent, path, O_RDONLY | O_DIRECTORY | O_CLOEXEC | links);
    if (self->directory < 0) {
        const int code = errno == ENOENT ? ERROR_MISSING : ERROR_ARGUMENT;
        return message_set(message, code, "%s: %s", path, strerror(errno));
    }
    int code = load_index(self, message);
    if (code != 0) {
        session_reader_close(self);
        return code;
    }
    struct session_event event;
    const int got = session_reader_next(self, &event, message);
    if (got == 1 && begin != NULL) {
        *begin = event;
    }
    code = got < 0 ? got : 0;
    if (got == 0) {
        code = message_set(message, ERROR_ARGUMENT, "%s: not a session (nothing was recorded)",
                           self->path);
    }
    if (code != 0) {
        session_reader_close(self);
    }
    return code;
}

static int damaged(const struct session_reader *self, const char *name, struct message *message) {
    return message_set(message, ERROR_CRC, "%s/%s: damaged (not what was recorded)", self->path,
                       name);
}

static size_t values_of(const struct raw_image *image) {
    return raw_image_row_values(image) * (size_t)image->height_px;
}

/// Reads the rows after the header; adds all bytes to `crc`, which includes the header's. `data`
/// NULL: the values are not wanted.
static bool read_rows(FILE *stream, const struct raw_image *image, uint16_t *data, uint32_t *crc) {
    const unsigned value_bytes = session_frame_value_bytes(image);
    size_t left = values_of(image);
    unsigned char bytes[2 * VALUE_ROOM];
    while (left > 0) {
        const size_t count = left < VALUE_ROOM ? left : VALUE_ROOM;
        if (fread(bytes, value_bytes, count, stream) != count) {
            return false;
        }
        *crc = crc_update(*crc, bytes, count * value_bytes);
        left -= count;
        if (data == NULL) {
            continue;
        }
        for (size_t i = 0; i < count; i++) {
            const int value = value_bytes == 1 ? bytes[i] : bytes[2 * i] << 8 | bytes[2 * i + 1];
            data[i] = (uint16_t)value;
        }
        data += count;
    }
    return fgetc(stream) == EOF;
}

/// Opens an image's file after its header, whose CRC goes to `crc`. 0, ERROR_MISSING or ERROR_CRC.
static int open_frame(const struct session_reader *self, const struct raw_image *image,
                      const char *name, FILE **stream, uint32_t *crc, struct message *message) {
    char head[SESSION_NAME_MAX + 1], found[SESSION_NAME_MAX + 1];
    const size_t head_bytes = (size_t)session_frame_head(image, head);
    const uint64_t bytes =
        head_bytes + (uint64_t)values_of(image) * session_frame_value_bytes(image);
    struct stat about;
    *stream = session_reader_file(self, name, message);
    if (*stream == NULL) {
        return ERROR_MISSING;
    }
    *crc = crc_update(0, head, head_bytes);
    if (fstat(fileno(*stream), &about) == 0 && (uint64_t)about.st_size == bytes &&
        fread(found, 1, head_bytes, *stream) == head_bytes &&
        memcmp(found, head, head_bytes) == 0) {
        return ERROR_OK;
    }
    fclose(*stream);
    return damaged(self, name, message);
}

/// Reads an image's file. `allocate` NULL: only checks it.
static int read_frame(const struct session_reader *self, const struct raw_image *image,
                      uint32_t crc32, struct raw_image *allocate, struct message *message) {
    char name[SESSION_NAME_MAX + 1];
    FILE *stream = NULL;
    uint32_t crc = 0;
    session_frame_name(crc32, name);
    const int error = open_frame(self, image, name, &stream, &crc, message);
    if (error != ERROR_OK) {
        return error;
    }
    uint16_t *data = allocate != NULL ? raw_memory_allocate(allocate) : NULL;
    const bool room = data != NULL || allocate == NULL;
    const bool good = room && read_rows(stream, image, data, &crc) && crc == crc32;
    fclose(stream);
    if (!room) {
        return message_set(message, ERROR_MEMORY, "%s/%s: out of memory", self->path, name);
    }
    return good ? 0 : damaged(self, name, message);
}

int session_reader_check(const struct session_reader *self, const struct raw_image *image,
                         uint32_t crc32, struct message *message) {
    return read_frame(self, image, crc32, NULL, message);
}

int session_reader_load(const struct session_reader *self, struct raw_image *image, uint32_t crc32,
                        struct message *message) {
    const int error = read_frame(self, image, crc32, image, message);
    if (error != ERROR_OK) {
        raw_image_release(image);
    }
    return error;
}

static int read_text(const struct session_reader *self, const char *name, uint32_t crc32,
                     char *text, size_t capacity, struct message *message) {
    FILE *stream = session_reader_file(self, name, message);
    if (stream == NULL) {
        return ERROR_MISSING;
    }
    const size_t length = fread(text, 1, capacity, stream);
    const bool whole = fgetc(stream) == EOF && crc_update(0, text, length) == crc32;
    fclose(stream);
    return whole ? (int)length : damaged(self, name, message);
}

int session_reader_calibration(const struct session_reader *self, uint32_t crc32, char *text,
                               size_t capacity, struct message *message) {
    char name[SESSION_NAME_MAX + 1];
    session_calibration_name(crc32, name);
    return read_text(self, name, crc32, text, capacity, message);
}

int session_reader_zoom_calibration(const struct session_reader *self, uint32_t crc32, char *text,
                                    size_t capacity, struct message *message) {
    char name[SESSION_NAME_MAX + 1];
    session_zoom_calibration_name(crc32, name);
    return read_text(self, name, crc32, text, capacity, message);
}

void session_reader_close(struct session_reader *self) {
    free(self->text);
    self->text = NULL;
    if (self->directory >= 0) {
        close(self->directory);
    }
    self->directory = -1;
    self->length = self->at = 0;
}
