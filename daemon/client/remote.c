// SPDX-License-Identifier: Apache-2.0
#include "daemon/client/remote.h"

#include <errno.h>
#include <inttypes.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "console/line/framing.h"
#include "console/line/reply.h"
#include "core/crc.h"
#include "core/error.h"
#include "daemon/base/message.h"
#include "daemon/base/monotonic.h"
#include "daemon/cli/progress.h"
#include "daemon/files/token.h"

enum { HELLO_BYTES = sizeof TOKEN_PREFIX + TOKEN_BYTES + 1 };

bool remote_quote(const char *word, char *text) {
    size_t length = 0;
    text[length++] = '"';
    for (const char *at = word; *at != '\0'; at++) {
        // Two for the character, two for the end.
        if (length + 4 > REMOTE_REQUEST_BYTES) {
            return false;
        }
        if (*at == '"' || *at == '\\') {
            text[length++] = '\\';
        }
        text[length++] = *at;
    }
    memcpy(text + length, "\"", 2);
    return true;
}

int remote_call_about(struct remote *remote, const char *verb, const char *name,
                      const struct cJSON **result, struct message *message, const char *rest, ...) {
    char command[REMOTE_REQUEST_BYTES], quoted[REMOTE_REQUEST_BYTES];
    size_t length = sizeof command;
    if (remote_quote(name, quoted)) {
        length = (size_t)snprintf(command, sizeof command, "%s %s", verb, quoted);
    }
    if (length < sizeof command) {
        va_list arguments;
        va_start(arguments, rest);
        length += (size_t)vsnprintf(command + length, sizeof command - length, rest, arguments);
        va_end(arguments);
    }
    return length < sizeof command
               ? remote_call(remote, command, result, message)
               : message_set(message, ERROR_ARGUMENT, "%s: name too long", name);
}

bool remote_sum_file(int fd, uint64_t *size, uint32_t *crc) {
    unsigned char data[16384];
    *size = 0;
    *crc = 0;
    for (;;) {
        const ssize_t bytes = pread(fd, data, sizeof data, (off_t)*size);
        if (bytes <= 0) {
            return bytes == 0;
        }
        *crc = crc_update(*crc, data, (size_t)bytes);
        *size += (uint64_t)bytes;
    }
}

void remote_progress(struct remote *self, const char *what, uint64_t done, uint64_t total) {
    if (isatty(STDERR_FILENO) == 0) {
        return;
    }
    if (total == 0) {
        progress_erase(self->bar_columns);
        self->bar_columns = 0;
        return;
    }
    self->bar_columns = progress_draw(PROGRESS_BAR_TEXT_MAX, what, done, total);
}

bool remote_interrupted(struct remote *self) {
    struct pollfd extra = {.fd = self->extra_fd, .events = POLLIN};
    while (!self->interrupted && self->extra_fd >= 0 && poll(&extra, 1, 0) > 0) {
        self->service(self);
        extra.fd = self->extra_fd;
    }
    return self->interrupted;
}

void remote_interrupt(struct remote *self) {
    if (!self->interrupted) {
        self->interrupted = true;
        remote_line_send(&self->line, "\003", 1);
    }
}

static int give_up(struct message *message) {
    return message_set(message, ERROR_CANCELLED, "interrupted");
}

void remote_keep_step(struct remote *self, const char *what) {
    const bool waits = strncmp(what, REPLY_WAITING, sizeof REPLY_WAITING - 1) == 0;
    const bool kept = waits || (self->shows_steps && strstr(what, ": ") != NULL);
    if (kept && strcmp(what, self->step) != 0) {
        remote_progress(self, "", 0, 0);
        fputs(waits ? "vergence: the instrument is busy: " : "", stderr);
        printable_print(stderr, what);
        fputs(waits ? " (Ctrl-C gives up)\n" : "\n", stderr);
        snprintf(self->step, sizeof self->step, "%s", what);
    }
}

bool remote_show_progress(struct remote *self, const char *text) {
    if (strncmp(text, "... ", 4) != 0) {
        return false;
    }
    char what[REMOTE_STEP_BYTES];
    const char *blank = strrchr(text, ' ');
    const char *slash = strrchr(text, '/');
    if (blank > text + 3 && slash != NULL && slash > blank) {
        snprintf(what, sizeof what, "%.*s", (int)(blank - text - 4), text + 4);
        remote_keep_step(self, what);
        remote_progress(self, what, strtoull(blank + 1, NULL, 10), strtoull(slash + 1, NULL, 10));
    }
    return true;
}

/// How long it may still be silent; 0: it is gone. On a serial line any data or keepalive restarts
/// the wait.
static int left_ms(const struct remote_line *line, int silence_ms, uint64_t *since_us) {
    const int limit_ms = line->busy ? FRAMING_BUSY_MS : silence_ms;
    *since_us = line->serial && line->last_rx_us > *since_us ? line->last_rx_us : *since_us;
    const int64_t left =
        limit_ms - (int64_t)((monotonic_now_us() - *since_us) / MONOTONIC_US_IN_MS);
    // Whether it is busy is seen when something comes.
    if (left <= 0) {
        return 0;
    }
    return left < silence_ms ? (int)left : silence_ms;
}

int remote_receive(struct remote *self, int silence_ms, char **text) {
    struct remote_line *line = &self->line;
    uint64_t since_us = monotonic_now_us();
    for (;;) {
        bool extra = false;
        const int wait_ms = silence_ms < 0 ? silence_ms : left_ms(line, silence_ms, &since_us);
        if (wait_ms == 0) {
            return ERROR_TIMEOUT;
        }
        const int error = remote_line_receive(line, wait_ms, self->extra_fd, &extra, text);
        if (error != ERROR_CANCELLED && error != ERROR_TIMEOUT) {
            return error;
        }
        if (extra && self->service != NULL) {
            self->service(self);
        }
    }
}

bool remote_receive_bytes(struct remote *remote, void *data, size_t bytes) {
    struct remote_line *self = &remote->line;
    INVARIANT(!self->serial && !self->script);
    const size_t buffered = self->filled - self->used;
    const size_t first = bytes < buffered ? bytes : buffered;
    memcpy(data, self->data + self->used, first);
    self->used += first;
    for (size_t have = first; have < bytes;) {
        const ssize_t got = read(self->fd, (char *)data + have, bytes - have);
        struct pollfd fds[] = {{.fd = self->fd, .events = POLLIN},
                               {.fd = remote->extra_fd, .events = POLLIN}};
        if (got > 0) {
            have += (size_t)got;
        } else if (got == 0 || (errno != EAGAIN && errno != EINTR) ||
                   (poll(fds, 2, -1) < 0 && errno != EINTR)) {
            return false;
        } else if (fds[1].revents != 0 && remote->service != NULL) {
            remote->service(remote);
        }
    }
    return true;
}

int remote_receive_part(struct remote *self, void *cookie, const char *line) {
    static char data[REPLY_BYTES_MAX];
    size_t length = 0;
    if (self->take == NULL ||
        (self->json ? sscanf(line, "{\"event\": \"bytes\", \"bytes\": %zu}", &length)
                    : sscanf(line, "... bytes %zu", &length)) != 1) {
        return 0;
    }
    if (length > sizeof data) {
        return ERROR_VERSION;
    }
    if (!remote_receive_bytes(self, data, length)) {
        return ERROR_DEVICE;
    }
    self->take(self, cookie, data, length);
    return 1;
}

/// Whether a line rejects the client; the daemon sends it as text, before it knows the client's
/// format. Without a reason it is garbage.
static bool is_turned_away(const char *text) {
    return strncmp(text, "ERR ", 4) == 0 && text[4] > ' ';
}

/// Waits for the answer to the greeting. 0, ERROR_DEVICE, ERROR_TIMEOUT or ERROR_CANCELLED.
static int await_greeting(struct remote *self, char **text) {
    int limit_ms = remote_line_left_ms(&self->line);
    for (;;) {
        bool extra = false;
        const int error = remote_line_receive(&self->line, limit_ms, self->extra_fd, &extra, text);
        if (extra) {
            self->service(self);
        }
        if (self->interrupted) {
            return ERROR_CANCELLED;
        }
        if (error == ERROR_TIMEOUT && self->interactive) {
            fputs("vergence: vergenced does not answer yet; Ctrl-C gives up\n", stderr);
            limit_ms = REMOTE_FOREVER_MS;
        } else if (error != ERROR_CANCELLED) {
            return error;
        }
    }
}

/// Makes the first line: over TCP the token. If no token file was named and the default one does
/// not exist, the daemon decides whether a token is required: a tunnel may lead to a Unix socket.
static int make_hello(const struct remote *self, char hello[HELLO_BYTES], struct message *message) {
    char token[TOKEN_BYTES];
    int error = ERROR_MISSING;
    if (self->line.tcp) {
        error = token_read(self->token_path, token, message);
    }
    if (error == ERROR_MISSING && self->token_path == NULL) {
        strcpy(hello, "@text\n");  // the default
        return ERROR_OK;
    }
    if (error == ERROR_OK) {
        snprintf(hello, HELLO_BYTES, TOKEN_PREFIX "%s\n", token);
    }
    return error;
}

int remote_greet(struct remote *self, remote_show *show, void *cookie, struct message *message) {
    char hello[HELLO_BYTES];
    char *text = NULL;
    if (self->line.serial) {
        return 0;
    }
    int error = make_hello(self, hello, message);
    if (error != ERROR_OK) {
        return error;
    }
    // A daemon that hung up has sent the reason, which can still be read if sending fails.
    remote_line_send(&self->line, hello, strlen(hello));
    error = await_greeting(self, &text);
    if (error == ERROR_CANCELLED) {
        return give_up(message);
    }
    if (error == ERROR_TIMEOUT) {
        return message_set(message, error, "no answer (is vergenced running there?)");
    }
    if (error != ERROR_OK) {
        return message_set(message, ERROR_DEVICE, "connection lost");
    }
    if (is_turned_away(text)) {
        remote_show_rejection(self, show, cookie, text);
        return 1;
    }
    return strcmp(text, "OK") == 0
               ? 0
               : message_set(message, ERROR_VERSION, "invalid answer from vergenced");
}
