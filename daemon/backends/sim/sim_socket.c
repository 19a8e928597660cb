// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/sim/sim_socket.h"

#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdbool.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/monotonic.h"

// Waits until the socket is ready for `events`; 0 when it is.
static int wait_for(int socket, short events, int64_t deadline_ms) {
    for (;;) {
        const int64_t left_ms = deadline_ms - monotonic_now_ms();
        if (left_ms <= 0) {
            return ERROR_TIMEOUT;
        }
        struct pollfd polled = {.fd = socket, .events = events};
        const int ready = poll(&polled, 1, left_ms > 1000 ? 1000 : (int)left_ms);
        if (ready > 0) {
            return ERROR_OK;
        }
        if (ready < 0 && errno != EINTR) {
            return ERROR_IO;
        }
    }
}

static int connect_to(const struct sockaddr *address, socklen_t bytes, int64_t deadline_ms) {
    const int made = socket(address->sa_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (made < 0) {
        return ERROR_IO;
    }
    int error = ERROR_OK;
    if (connect(made, address, bytes) != 0) {
        error = ERROR_IO;
        if (errno == EINPROGRESS) {
            error = wait_for(made, POLLOUT, deadline_ms);
            int why = 0;
            socklen_t size = sizeof why;
            if (error == ERROR_OK && getsockopt(made, SOL_SOCKET, SO_ERROR, &why, &size) == 0 &&
                why != 0) {
                errno = why;
                error = ERROR_IO;
            }
        }
    }
    if (error != ERROR_OK) {
        const int why = errno;
        close(made);
        errno = why;
        return error;
    }
    return made;
}

static int connect_unix(const char *path, int64_t deadline_ms) {
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    const size_t length = strlen(path);
    if (length == 0 || length >= sizeof address.sun_path) {
        return ERROR_ARGUMENT;
    }
    memcpy(address.sun_path, path, length);
    return connect_to((const struct sockaddr *)&address, sizeof address, deadline_ms);
}

static int connect_tcp(const char *endpoint, int64_t deadline_ms) {
    char host[256];
    const char *colon = strrchr(endpoint, ':');
    if (colon == NULL || colon == endpoint || colon[1] == '\0' ||
        (size_t)(colon - endpoint) >= sizeof host) {
        return ERROR_ARGUMENT;
    }
    memcpy(host, endpoint, (size_t)(colon - endpoint));
    host[colon - endpoint] = '\0';
    const struct addrinfo hints = {.ai_socktype = SOCK_STREAM};
    struct addrinfo *found = NULL;
    if (getaddrinfo(host, colon + 1, &hints, &found) != 0) {
        errno = 0;
        return ERROR_IO;
    }
    int made = ERROR_IO;
    for (const struct addrinfo *next = found; next != NULL && made < 0; next = next->ai_next) {
        made = connect_to(next->ai_addr, next->ai_addrlen, deadline_ms);
    }
    const int why = errno;
    freeaddrinfo(found);
    errno = why;
    if (made >= 0) {
        const int on = 1;
        setsockopt(made, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    }
    return made;
}

int sim_socket_connect(const char *where, int64_t deadline_ms) {
    INVARIANT(where != NULL);
    if (strncmp(where, "unix:", 5) == 0) {
        return connect_unix(where + 5, deadline_ms);
    }
    return strncmp(where, "tcp:", 4) == 0 ? connect_tcp(where + 4, deadline_ms) : ERROR_ARGUMENT;
}

bool sim_socket_has_ended(int socket) {
    INVARIANT(socket >= 0);
    uint8_t byte = 0;
    const ssize_t came = recv(socket, &byte, sizeof byte, MSG_PEEK | MSG_DONTWAIT);
    return came == 0 || (came < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR);
}

int sim_socket_send(int socket, const void *data, size_t bytes, int64_t deadline_ms) {
    INVARIANT(socket >= 0 && (data != NULL || bytes == 0));
    const uint8_t *next = data;
    while (bytes > 0) {
        // A disconnected rig is an error, not a signal.
        const ssize_t sent = send(socket, next, bytes, MSG_NOSIGNAL);
        if (sent > 0) {
            next += sent;
            bytes -= (size_t)sent;
        } else if (sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
            const int error = wait_for(socket, POLLOUT, deadline_ms);
            if (error != ERROR_OK) {
                return error;
            }
        } else if (sent == 0 || errno != EINTR) {
            return ERROR_IO;
        }
    }
    return ERROR_OK;
}

int sim_socket_receive(int socket, void *data, size_t bytes, int64_t deadline_ms) {
    INVARIANT(socket >= 0 && (data != NULL || bytes == 0));
    uint8_t *next = data;
    while (bytes > 0) {
        const ssize_t came = recv(socket, next, bytes, 0);
        if (came > 0) {
            next += came;
            bytes -= (size_t)came;
        } else if (came < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
            const int error = wait_for(socket, POLLIN, deadline_ms);
            if (error != ERROR_OK) {
                return error;
            }
        } else if (came == 0 || errno != EINTR) {
            return ERROR_IO;
        }
    }
    return ERROR_OK;
}
