// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/log_ring.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "core/invariant.h"

static int open_file(const char *path) {
    return open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOCTTY | O_NONBLOCK, 0640);
}

int log_ring_open(struct log_ring *self, const char *path, int level) {
    memset(self, 0, sizeof *self);
    self->level = level;
    self->path = path;
    self->fd = STDERR_FILENO;
    self->systemd = getenv("JOURNAL_STREAM") != NULL && path[0] == '\0';
    if (pthread_mutex_init(&self->lock, NULL) != 0) {
        return ENOMEM;
    }
    if (path[0] != '\0') {
        self->fd = open_file(path);
    }
    return self->fd < 0 ? errno : 0;
}

void log_ring_close(struct log_ring *self) {
    log_ring_count_repeats(self);
    log_ring_flush(self);
    if (self->path[0] != '\0' && self->fd >= 0) {
        close(self->fd);
    }
    pthread_mutex_destroy(&self->lock);
}

void log_ring_reopen(struct log_ring *self) {
    if (self->path[0] == '\0') {
        return;
    }
    const int fd = open_file(self->path);
    if (fd < 0) {
        log_ring_print(self, HAL_LOG_ERROR, "%s: %s; the log stays in the file that is open",
                       self->path, strerror(errno));
        return;
    }
    if (self->fd >= 0) {
        close(self->fd);
    }
    self->fd = fd;
}

const char *log_ring_level_name(enum hal_log_level level) {
    static const char *const names[] = {[HAL_LOG_ERROR] = "error",
                                        [HAL_LOG_WARNING] = "warning",
                                        [HAL_LOG_NOTICE] = "notice",
                                        [HAL_LOG_INFO] = "info",
                                        [HAL_LOG_DEBUG] = "debug"};
    INVARIANT(level >= HAL_LOG_ERROR && level <= HAL_LOG_DEBUG);
    return names[level];
}

/// Adds a line to the ring. The caller holds the lock.
static void add_line(struct log_ring *self, enum hal_log_level level, const char *text) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    struct log_ring_line *line = &self->lines[self->written % LOG_RING_LINES];
    line->time_us = (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
    line->level = level;
    snprintf(line->text, sizeof line->text, "%s", text);
    for (char *at = line->text; *at != '\0'; at++) {
        *at = (unsigned char)*at < ' ' || *at == 0x7F ? '?' : *at;
    }
    self->written++;
    INVARIANT(self->sent < self->written);
}

/// Adds the number of repetitions of the last line, if any. The caller holds the lock.
static void add_repeats(struct log_ring *self) {
    char text[64];
    if (self->repeats > 0) {
        snprintf(text, sizeof text, "last message repeated %llu times",
                 (unsigned long long)self->repeats);
        add_line(self, self->last_level, text);
        self->repeats = 0;
    }
}

void log_ring_count_repeats(struct log_ring *self) {
    pthread_mutex_lock(&self->lock);
    add_repeats(self);
    pthread_mutex_unlock(&self->lock);
}

static void write_line(void *cookie, enum hal_log_level level, const char *text) {
    struct log_ring *self = cookie;
    INVARIANT(level >= HAL_LOG_ERROR && level <= HAL_LOG_DEBUG);
    if ((int)level > self->level) {
        return;
    }
    pthread_mutex_lock(&self->lock);
    if (level == self->last_level && strncmp(text, self->last, sizeof self->last - 1) == 0) {
        self->repeats++;
    } else {
        add_repeats(self);
        add_line(self, level, text);
        self->last_level = level;
        snprintf(self->last, sizeof self->last, "%s", text);
    }
    pthread_mutex_unlock(&self->lock);
}

struct hal_log log_ring_log(struct log_ring *self) {
    static const struct hal_log_operations operations = {.write = write_line};
    return (struct hal_log){&operations, self};
}

void log_ring_print(struct log_ring *self, enum hal_log_level level, const char *format, ...) {
    char text[LOG_RING_LINE_BYTES];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    write_line(self, level, text);
}

void log_ring_time_text(int64_t time_us, char *text) {
    const time_t seconds = (time_t)(time_us / 1000000);
    struct tm parts;
    gmtime_r(&seconds, &parts);
    const size_t length = strftime(text, 24, "%Y-%m-%d %H:%M:%S", &parts);
    snprintf(text + length, 32 - length, ".%03d", (int)(time_us / 1000 % 1000));
}

enum { SENT_BYTES = LOG_RING_LINE_BYTES + 128 };

/// Writes the line as it is sent. Returns its length.
static int format_line(const struct log_ring *self, const struct log_ring_line *line, uint64_t lost,
                       char text[SENT_BYTES]) {
    char when[32];
    char gap[64] = "";
    if (lost > 0) {
        snprintf(gap, sizeof gap, "(%llu lines lost) ", (unsigned long long)lost);
    }
    log_ring_time_text(line->time_us, when);
    const int length =
        self->systemd ? snprintf(text, SENT_BYTES, "<%d>%s%s\n", (int)line->level, gap, line->text)
                      : snprintf(text, SENT_BYTES, "%s %s: %s%s\n", when,
                                 log_ring_level_name(line->level), gap, line->text);
    INVARIANT(length > 0 && length < SENT_BYTES);
    return length;
}

/// Sends one line. False: try again later.
static bool send_line(struct log_ring *self, const struct log_ring_line *line, uint64_t lost) {
    char text[SENT_BYTES];
    const int length = format_line(self, line, lost, text);
    // A line is shorter than PIPE_BUF: if a pipe is writable, it takes the whole line at once. The
    // daemon's own file does not block; /dev/kmsg, which may be one, never says that it is
    // writable.
    struct pollfd writable = {.fd = self->fd, .events = POLLOUT};
    if (self->path[0] == '\0' && poll(&writable, 1, 0) <= 0) {
        return false;
    }
    const ssize_t sent = write(self->fd, text, (size_t)length);
    if (sent < 0 && errno == EAGAIN) {
        return false;
    }
    if (sent == length) {
        self->failed_number = 0;
    } else {
        self->failed_number = sent < 0 ? errno : ENOSPC;
    }
    // A partly written line is ended here and sent again as a whole.
    if (sent > 0 && sent < length && write(self->fd, "\n", 1) < 0) {
        self->failed_number = errno;
    }
    return sent == length;
}

void log_ring_flush(struct log_ring *self) {
    for (;;) {
        pthread_mutex_lock(&self->lock);
        const uint64_t oldest = self->written > LOG_RING_LINES ? self->written - LOG_RING_LINES : 0;
        if (self->sent < oldest) {
            self->lost += oldest - self->sent;
            self->sent = oldest;
        }
        INVARIANT(self->sent <= self->written);
        const bool more = self->sent < self->written;
        struct log_ring_line line = {0};
        if (more) {
            line = self->lines[self->sent % LOG_RING_LINES];
        }
        pthread_mutex_unlock(&self->lock);
        if (!more || !send_line(self, &line, self->lost)) {
            return;
        }
        self->lost = 0;
        self->sent++;
    }
}

bool log_ring_line(struct log_ring *self, uint64_t back, struct log_ring_line *line) {
    pthread_mutex_lock(&self->lock);
    const bool there = back < LOG_RING_LINES && back < self->written;
    if (there) {
        *line = self->lines[(self->written - 1 - back) % LOG_RING_LINES];
    }
    pthread_mutex_unlock(&self->lock);
    return there;
}
