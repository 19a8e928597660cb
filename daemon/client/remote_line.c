// SPDX-License-Identifier: Apache-2.0
#include "daemon/client/remote_line.h"

#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

#include "console/line/framing.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/monotonic.h"
#include "daemon/base/serial_device.h"
#include "daemon/client/remote.h"
#include "daemon/files/standard_paths.h"

enum {
    PORT_MAX = 65535,
    SERIAL_BAUD = 115200,
    HELLO_MS = 1000,
    HELLO_TRIES = 4,
    QUIET_MS = 100,
    SEND_MS = 10000
};

int remote_line_left_ms(const struct remote_line *self) {
    const uint64_t gone_ms = (monotonic_now_us() - self->opened_us) / MONOTONIC_US_IN_MS;
    return gone_ms < REMOTE_LINE_OPEN_MS ? REMOTE_LINE_OPEN_MS - (int)gone_ms : 0;
}

/// Connects within the time left. False with errno.
static bool connect_in_time(const struct remote_line *self, int fd, const struct sockaddr *address,
                            socklen_t bytes) {
    const int left_ms = remote_line_left_ms(self);
    const struct timeval limit = {.tv_sec = left_ms / 1000, .tv_usec = left_ms % 1000 * 1000 + 1};
    // SO_SNDTIMEO also limits connect, which then fails with EAGAIN, over TCP with EINPROGRESS.
    setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    const bool connected = connect(fd, address, bytes) == 0;
    errno = !connected && (errno == EAGAIN || errno == EINPROGRESS) ? ETIMEDOUT : errno;
    return connected;
}

static int open_unix(const struct remote_line *self, const char *path, struct message *message) {
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (path[0] == '\0') {
        return message_set(message, ERROR_ARGUMENT,
                           "invalid address \"unix:\" (expected unix:PATH)");
    }
    if (strlen(path) >= sizeof address.sun_path) {
        return message_set(message, ERROR_ARGUMENT, "unix:%s: path too long", path);
    }
    strcpy(address.sun_path, path);
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd >= 0 && connect_in_time(self, fd, (const struct sockaddr *)&address, sizeof address)) {
        return fd;
    }
    const int number = errno;
    if (fd >= 0) {
        close(fd);
    }
    message_set(message, ERROR_IO, "unix:%s: %s (is vergenced running there?)", path,
                strerror(number));
    errno = number;
    return ERROR_IO;
}

/// Parses an integer of decimal digits only, up to `max`; -1: invalid.
static int64_t parse_number(const char *text, int64_t max) {
    int64_t number = text[0] == '\0' ? -1 : 0;
    for (; *text != '\0'; text++) {
        if (*text < '0' || *text > '9' || number > max / 10) {
            return -1;
        }
        number = 10 * number + (*text - '0');
    }
    return number <= max ? number : -1;
}

static int open_tcp(const struct remote_line *self, const char *endpoint, struct message *message) {
    char host[256];
    const char *colon = strrchr(endpoint, ':');
    if (colon == NULL || (size_t)(colon - endpoint) >= sizeof host) {
        return message_set(message, ERROR_ARGUMENT,
                           "invalid address \"tcp:%s\" (expected tcp:HOST:PORT)", endpoint);
    }
    if (parse_number(colon + 1, PORT_MAX) < 1) {
        return message_set(message, ERROR_ARGUMENT,
                           "tcp:%s: invalid port \"%s\" (expected 1 to %d)", endpoint, colon + 1,
                           PORT_MAX);
    }
    memcpy(host, endpoint, (size_t)(colon - endpoint));
    host[colon - endpoint] = '\0';
    const struct addrinfo hints = {.ai_socktype = SOCK_STREAM};
    struct addrinfo *list = NULL;
    const int failed = getaddrinfo(host, colon + 1, &hints, &list);
    if (failed != 0) {
        return message_set(message, ERROR_IO, "tcp:%s: %s", endpoint, gai_strerror(failed));
    }
    int fd = -1;
    for (const struct addrinfo *at = list; at != NULL && fd < 0; at = at->ai_next) {
        fd = socket(at->ai_family, at->ai_socktype | SOCK_CLOEXEC, at->ai_protocol);
        if (fd >= 0 && !connect_in_time(self, fd, at->ai_addr, at->ai_addrlen)) {
            const int number = errno;
            close(fd);
            errno = number;
            fd = -1;
        }
    }
    freeaddrinfo(list);
    if (fd < 0) {
        return message_set(message, ERROR_IO, "tcp:%s: %s (is vergenced running there?)", endpoint,
                           strerror(errno));
    }
    const int one = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
    return fd;
}

static int open_serial(const char *endpoint, struct message *message) {
    char device[256];
    uint32_t baud = SERIAL_BAUD;
    const char *colon = strrchr(endpoint, ':');
    const size_t length = colon != NULL ? (size_t)(colon - endpoint) : strlen(endpoint);
    if (length == 0) {
        return message_set(message, ERROR_ARGUMENT,
                           "invalid address \"serial:%s\" (expected serial:DEVICE)", endpoint);
    }
    if (length >= sizeof device) {
        return message_set(message, ERROR_ARGUMENT, "serial:%s: name too long", endpoint);
    }
    memcpy(device, endpoint, length);
    device[length] = '\0';
    if (colon != NULL) {
        const int64_t given = parse_number(colon + 1, INT32_MAX);
        if (given < 0) {
            return message_set(message, ERROR_ARGUMENT,
                               "invalid address \"serial:%s\" (expected serial:DEVICE:BAUD)",
                               endpoint);
        }
        baud = (uint32_t)given;
    }
    return serial_device_open(device, baud, message);
}

static bool await_ok(struct remote_line *self) {
    const uint64_t end_us = monotonic_now_us() + HELLO_MS * MONOTONIC_US_IN_MS;
    bool ok = false, extra = false;
    char *text = NULL;
    while (!ok && monotonic_now_us() < end_us &&
           remote_line_receive(self, HELLO_MS, -1, &extra, &text) == 0) {
        ok = strcmp(text, "OK") == 0;
    }
    return ok;
}

/// Ctrl-C discards anything typed there before; then the console is switched to program mode.
static bool greet(struct remote_line *self) {
    for (int i = 0; i < HELLO_TRIES && remote_line_left_ms(self) > HELLO_MS && !self->framed; i++) {
        remote_line_quiet(self, QUIET_MS);
        self->framed = remote_line_send(self, "\003\r@framed\r", 10) && await_ok(self);
    }
    if (self->framed) {
        remote_line_quiet(self, QUIET_MS);
    }
    return self->framed;
}

int remote_line_open(struct remote_line *self, const char *where, struct message *message) {
    *self = (struct remote_line){.fd = -1, .opened_us = monotonic_now_us()};
    if (strncmp(where, "unix:", 5) == 0) {
        self->fd = open_unix(self, where + 5, message);
    } else if (strncmp(where, "tcp:", 4) == 0) {
        self->fd = open_tcp(self, where + 4, message);
        self->tcp = true;
    } else if (strncmp(where, "serial:", 7) == 0) {
        self->fd = open_serial(where + 7, message);
        self->serial = true;
    } else {
        return message_set(
            message, ERROR_ARGUMENT,
            "invalid address \"%s\" (expected unix:PATH, tcp:HOST:PORT or serial:DEVICE)", where);
    }
    if (self->fd < 0) {
        return self->fd;
    }
    fcntl(self->fd, F_SETFL, fcntl(self->fd, F_GETFL) | O_NONBLOCK);
    self->data = malloc(REMOTE_LINE_BYTES);
    if (self->data == NULL) {
        return message_set(message, ERROR_MEMORY, "out of memory");
    }
    if (self->serial && !greet(self)) {
        return message_set(message, ERROR_TIMEOUT,
                           "%s: no answer from vergenced (check device and speed)", where);
    }
    return 0;
}

void remote_line_close(struct remote_line *self) {
    if (self->fd >= 0) {
        if (self->serial) {
            remote_line_send(self, "@terminal\r", 10);
            (void)(self->framed && await_ok(self));  // the next user of the line finds it quiet
            tcdrain(self->fd);
            serial_device_close(self->fd);
        } else {
            close(self->fd);
        }
        self->fd = -1;
    }
    free(self->data);
    self->data = NULL;
}

bool remote_line_send(struct remote_line *self, const char *data, size_t bytes) {
    while (bytes > 0) {
        const ssize_t sent = write(self->fd, data, bytes);
        if (sent > 0) {
            data += sent;
            bytes -= (size_t)sent;
            continue;
        }
        struct pollfd writable = {.fd = self->fd, .events = POLLOUT};
        if (sent < 0 && errno != EAGAIN && errno != EINTR) {
            return false;
        }
        if (poll(&writable, 1, SEND_MS) == 0) {
            return false;
        }
    }
    return true;
}

/// The next complete line in the buffer; NULL: none.
static char *take_line(struct remote_line *self) {
    char *begin = self->data + self->used;
    char *end = memchr(begin, '\n', self->filled - self->used);
    if (end == NULL) {
        return NULL;
    }
    *end = '\0';
    self->used = (size_t)(end - self->data) + 1;
    for (char *at = begin; self->script && at < end; at++) {
        *at = *at == '\0' ? '\001' : *at;  // a control character, which no command contains
    }
    if (end > begin && end[-1] == '\r') {
        end[-1] = '\0';
    }
    return begin;
}

/// Processes bytes that were read to the end of the buffer.
static void take_in(struct remote_line *self, size_t bytes) {
    const size_t end = self->filled + bytes;
    size_t kept = self->filled;
    for (size_t at = self->filled; at < end; at++) {
        self->busy = self->serial && self->data[at] == FRAMING_BUSY;
        if (!self->serial || (self->data[at] != FRAMING_IDLE && !self->busy)) {
            self->data[kept++] = self->data[at];
        }
    }
    self->last_rx_us = monotonic_now_us();
    self->rx_bytes += kept - self->filled;
    self->filled = kept;
}

/// Makes room for more bytes.
static void make_room(struct remote_line *self) {
    if (self->used > 0) {
        memmove(self->data, self->data + self->used, self->filled - self->used);
        self->filled -= self->used;
        self->used = 0;
    }
    if (self->filled == REMOTE_LINE_BYTES && self->script) {
        self->filled = REMOTE_LINE_BYTES / 2;  // still too long for a command
    } else if (self->filled == REMOTE_LINE_BYTES) {
        self->filled = 0;  // no answer is that long: garbage
        self->skipping = true;
    }
    INVARIANT(self->filled < REMOTE_LINE_BYTES);
}

/// Reads available bytes. ERROR_DEVICE at the end.
static int fill(struct remote_line *self) {
    make_room(self);
    const ssize_t bytes =
        read(self->fd, self->data + self->filled, REMOTE_LINE_BYTES - self->filled);
    if (bytes > 0) {
        take_in(self, (size_t)bytes);
        return ERROR_OK;
    }
    if (bytes < 0 && (errno == EAGAIN || errno == EINTR)) {
        return ERROR_OK;
    }
    self->errno_of_read = bytes < 0 ? errno : 0;
    if (self->script && bytes == 0 && self->filled > 0) {
        self->data[self->filled++] = '\n';  // the end of the last line may be missing
        return ERROR_OK;
    }
    return ERROR_DEVICE;
}

/// Waits for data until `end_us` (if `limit_ms` is not negative) and reads it. 0, or an error of
/// remote_line_receive.
static int await(struct remote_line *self, int limit_ms, uint64_t end_us, int extra_fd,
                 bool *extra_ready) {
    struct pollfd fds[] = {{.fd = self->fd, .events = POLLIN}, {.fd = extra_fd, .events = POLLIN}};
    const uint64_t now_us = monotonic_now_us();
    if (limit_ms >= 0 && now_us >= end_us) {
        return ERROR_TIMEOUT;
    }
    const int wait_ms = limit_ms < 0 ? -1 : (int)((end_us - now_us) / 1000) + 1;
    if (poll(fds, 2, wait_ms) < 0) {
        return ERROR_CANCELLED;
    }
    if (fds[1].revents != 0) {
        *extra_ready = true;
        return ERROR_CANCELLED;
    }
    return fds[0].revents != 0 && fill(self) != 0 ? ERROR_DEVICE : 0;
}

/// In place of a line that is too long.
static char left_out[] = "(a line of more than 256 kB is left out)";

int remote_line_receive(struct remote_line *self, int limit_ms, int extra_fd, bool *extra_ready,
                        char **text) {
    const uint64_t end_us = monotonic_now_us() + (uint64_t)(limit_ms > 0 ? limit_ms : 0) * 1000;
    *extra_ready = false;
    for (;;) {
        *text = take_line(self);
        if (*text != NULL && !self->skipping) {
            return ERROR_OK;
        }
        if (*text != NULL) {
            self->skipping = false;
            if (!self->serial) {
                *text = left_out;
                return ERROR_OK;
            }
            continue;  // garbage, after which the request is sent again
        }
        const int error = await(self, limit_ms, end_us, extra_fd, extra_ready);
        if (error != ERROR_OK) {
            return error;
        }
    }
}

void remote_line_quiet(struct remote_line *self, int quiet_ms) {
    struct pollfd wait = {.fd = self->fd, .events = POLLIN};
    const uint64_t end_us = monotonic_now_us() + (uint64_t)quiet_ms * 10000;
    self->used = 0;
    self->filled = 0;
    self->skipping = false;
    while (monotonic_now_us() < end_us && poll(&wait, 1, quiet_ms) > 0 && fill(self) == 0) {
        self->filled = 0;
    }
}

bool remote_is_address(const char *word) {
    const size_t first = strcspn(word, " \t");
    return strcspn(word, ":/.") < first;
}

int remote_open_default(struct remote_line *line, struct message *message) {
    char sockets[STANDARD_SOCKETS_MAX][STANDARD_PATH_BYTES];
    char tried[MESSAGE_BYTES / 2] = "";
    int number = 0;
    const size_t count = standard_paths_sockets(sockets);
    for (size_t i = 0; i < count; i++) {
        char address[sizeof "unix:" + STANDARD_PATH_BYTES];
        snprintf(address, sizeof address, "unix:%.*s", STANDARD_PATH_BYTES - 1, sockets[i]);
        const int error = remote_line_open(line, address, message);
        if (error == ERROR_OK || error == ERROR_MEMORY) {
            return error;
        }
        number = error == ERROR_IO ? errno : 0;
        const bool is_missing = number == ENOENT;
        const char *cause = number != 0 ? strerror(number) : "path too long";
        const size_t used = strlen(tried);
        snprintf(tried + used, sizeof tried - used, "%s%.*s%s%s%s", i == 0 ? "" : ", ",
                 STANDARD_PATH_BYTES - 1, sockets[i], is_missing ? "" : " (",
                 is_missing ? "" : cause, is_missing ? "" : ")");
    }
    message_set(
        message, ERROR_IO,
        "no vergenced at %s: start \"vergenced\" (simulated instrument: \"vergence simulate\"), or "
        "give its ADDRESS: unix:PATH, tcp:HOST:PORT or serial:DEVICE",
        tried);
    errno = number;
    return ERROR_IO;
}
