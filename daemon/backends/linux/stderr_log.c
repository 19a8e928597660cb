// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/linux/stderr_log.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/invariant.h"
#include "daemon/backends/linux/device_file.h"

// A pipe takes up to this many bytes atomically.
enum { LINE_BYTES = 1024, HEAD_BYTES = 64 };

static const char *word_of(enum hal_log_level level) {
    switch (level) {
        case HAL_LOG_ERROR:
            return "error: ";
        case HAL_LOG_WARNING:
            return "warning: ";
        default:
            return "";
    }
}

/// Writes the line completely or not at all. Only a terminal may take a part; the line is then cut.
static bool write_whole(const struct stderr_log *self, const char *line, size_t bytes) {
    struct pollfd polled = {.fd = self->fd, .events = POLLOUT};
    // A pipe without a reader is also ready, but writing to it raises a signal.
    if (self->fd < 0 || poll(&polled, 1, 0) != 1 || polled.revents != POLLOUT) {
        return false;
    }
    ssize_t written = 0;
    do {
        written = self->is_socket ? send(self->fd, line, bytes, MSG_DONTWAIT | MSG_NOSIGNAL)
                                  : write(self->fd, line, bytes);
    } while (written < 0 && errno == EINTR);
    return written > 0;
}

/// Writes one line with prefix and end; control characters are replaced, as they could split it.
static bool put_text(const struct stderr_log *self, enum hal_log_level level, const char *text) {
    char line[LINE_BYTES + HEAD_BYTES];
    int length = self->is_terminal ? snprintf(line, LINE_BYTES, "%s%s", word_of(level), text)
                                   : snprintf(line, LINE_BYTES, "<%d>%s", (int)level, text);
    if (length < 0) {
        return false;
    }
    length = length < LINE_BYTES ? length : LINE_BYTES - 1;
    for (int i = 0; i < length; i++) {
        if ((unsigned char)line[i] < ' ' || line[i] == 0x7f) {
            line[i] = '?';
        }
    }
    line[length] = '\n';
    return write_whole(self, line, (size_t)length + 1);
}

static void write_line(void *opaque, enum hal_log_level level, const char *text) {
    struct stderr_log *self = opaque;
    INVARIANT(text != NULL);
    if (level > self->max) {
        return;
    }
    if (self->lost > 0) {
        char what[HEAD_BYTES];
        snprintf(what, sizeof what, "%u log lines were lost", (unsigned)self->lost);
        if (!put_text(self, HAL_LOG_WARNING, what)) {
            self->lost++;
            return;
        }
        self->lost = 0;
    }
    self->lost += !put_text(self, level, text);
}

void stderr_log_open(struct stderr_log *self, enum hal_log_level max) {
    static const struct hal_log_operations operations = {write_line};
    *self = (struct stderr_log){.hal = {&operations, self}, .max = max, .fd = -1};
    struct stat status;
    if (fstat(STDERR_FILENO, &status) != 0) {
        return;
    }
    self->is_socket = S_ISSOCK(status.st_mode);
    self->is_terminal = isatty(STDERR_FILENO) == 1;
    // O_NONBLOCK belongs to the open file, which other programs may share, so open a private one. A
    // socket cannot be reopened; there each call requests it.
    if (!self->is_socket) {
        self->fd = open("/proc/self/fd/2", O_WRONLY | O_APPEND | O_NONBLOCK | O_CLOEXEC | O_NOCTTY);
    }
    if (self->fd < 0) {
        self->fd = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
    }
}

void stderr_log_close(struct stderr_log *self) {
    device_file_close(&self->fd);
}
