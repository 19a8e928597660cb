// SPDX-License-Identifier: Apache-2.0
#include "daemon/client/remote_script.h"

#include <errno.h>
#include <poll.h>
#include <unistd.h>

#include "core/invariant.h"

/// Reads more. False: end of input, read error, or interrupted by the user.
static bool read_more(struct remote_script *self, struct remote *remote) {
    INVARIANT(self->begin == self->end);
    for (;;) {
        struct pollfd fds[2] = {{.fd = STDIN_FILENO, .events = POLLIN},
                                {.fd = remote->extra_fd, .events = POLLIN}};
        if (remote_interrupted(remote)) {
            return false;
        }
        if (poll(fds, 2, -1) < 0 || fds[0].revents == 0) {
            continue;  // user input, or a signal
        }
        const ssize_t bytes = read(STDIN_FILENO, self->data, sizeof self->data);
        if (bytes < 0 && (errno == EINTR || errno == EAGAIN)) {
            continue;
        }
        self->errno_of_read = bytes < 0 ? errno : 0;
        self->begin = 0;
        self->end = bytes > 0 ? (size_t)bytes : 0;
        return bytes > 0;
    }
}

/// Adds a character other than the line end; `kind` becomes what the line is with it.
static void add(struct remote_script *self, char next, size_t *length,
                enum remote_script_line *kind) {
    if (next == '\0') {
        *kind = REMOTE_SCRIPT_CONTROL;
    } else if (*length + 1 < sizeof self->line) {
        self->line[(*length)++] = next;
    } else if (*kind == REMOTE_SCRIPT_LINE && next != '\r') {
        *kind = REMOTE_SCRIPT_TOO_LONG;
    }
}

/// What follows once no more can be read. A partial line is dropped if the user interrupted it or a
/// read error cut it off.
static enum remote_script_line kind_at_end(const struct remote_script *self,
                                           const struct remote *remote, bool begun,
                                           enum remote_script_line kind) {
    if (self->errno_of_read != 0) {
        return REMOTE_SCRIPT_BROKEN;
    }
    return begun && !remote->interrupted ? kind : REMOTE_SCRIPT_END;
}

enum remote_script_line remote_script_next(struct remote_script *self, struct remote *remote) {
    enum remote_script_line kind = REMOTE_SCRIPT_LINE;
    size_t length = 0;
    bool begun = false;
    if (remote_interrupted(remote)) {
        return REMOTE_SCRIPT_END;
    }
    for (;;) {
        if (self->begin == self->end && !read_more(self, remote)) {
            kind = kind_at_end(self, remote, begun, kind);
            break;
        }
        const char next = self->data[self->begin++];
        begun = true;
        if (next == '\n') {
            break;
        }
        add(self, next, &length, &kind);
    }
    if (length > 0 && self->line[length - 1] == '\r') {
        length--;
    }
    self->line[kind == REMOTE_SCRIPT_LINE ? length : 0] = '\0';
    return kind;
}
