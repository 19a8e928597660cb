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

// A pipe takes so many bytes whole or not at all.
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

/// All of it at once, or nothing. A longer file than a pipe's (a terminal) may take a part; that
/// line is cut then.
static bool put(const struct stderr_log *self, const char *line, size_t bytes) {
    struct pollfd polled = {.fd = self->fd, .events = POLLOUT};
    // A pipe without a reader is ready, too: its write would be a signal.
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

/// One line with its head and its end; control characters in it would make two.
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
    return put(self, line, (size_t)length + 1);
}

static void write_line(void *opaque, enum hal_log_level level, const char *text) {
    struct stderr_log *self = opaque;
    INVARIANT(text != NULL);
    if (level > self->most) {
        return;
    }
    if (self->lost > 0) {
        char what[HEAD_BYTES];
        snprintf(what, sizeof what, "%u lines of the log were lost", (unsigned)self->lost);
        if (!put_text(self, HAL_LOG_WARNING, what)) {
            self->lost++;
            return;
        }
        self->lost = 0;
    }
    self->lost += !put_text(self, level, text);
}

void stderr_log_open(struct stderr_log *self, enum hal_log_level most) {
    static const struct hal_log_operations operations = {write_line};
    *self = (struct stderr_log){.hal = {&operations, self}, .most = most, .fd = -1};
    struct stat status;
    if (fstat(STDERR_FILENO, &status) != 0) {
        return;
    }
    self->is_socket = S_ISSOCK(status.st_mode);
    self->is_terminal = isatty(STDERR_FILENO) == 1;
    // Whether it blocks belongs to the open file, which other programs may share: so we open our
    // own. A socket cannot be opened; there each call says it.
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
