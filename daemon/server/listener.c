// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/listener.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "core/error.h"
#include "daemon/files/own_remove.h"

enum {
    BACKLOG = 16,
    TURNED_AWAY_BYTES = 4096,
    SOCKET_FLAGS = SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK
};

_Static_assert(sizeof LISTENER_BESIDE - 1 + CONFIG_SOCKET_BYTES <=
                   sizeof(((struct sockaddr_un *)0)->sun_path),
               "the name of a socket that does not listen yet fits");

/// Closes a descriptor and returns the text of the preceding error.
static const char *give_up(int fd) {
    const int number = errno;
    if (fd >= 0) {
        close(fd);
    }
    return strerror(number);
}

static bool is_served(const struct sockaddr_un *address) {
    const int fd = socket(AF_UNIX, SOCKET_FLAGS, 0);
    const bool served =
        fd >= 0 &&
        (connect(fd, (const struct sockaddr *)address, sizeof *address) == 0 || errno == EAGAIN);
    if (fd >= 0) {
        close(fd);
    }
    return served;
}

/// Checks for an existing file that is not a socket: it is kept, and an error.
static bool is_no_socket(const char *path, struct message *message) {
    struct stat there;
    if (lstat(path, &there) != 0 || S_ISSOCK(there.st_mode)) {
        return false;
    }
    (void)message_set(message, ERROR_ARGUMENT,
                      "%s: exists and is not a socket (use another path, or remove it)", path);
    return true;
}

static void remove_socket(const char *path) {
    own_remove(AT_FDCWD, path, &(struct own_proof){.kind = OWN_SOCKET});
}

int listener_unix(const char *path, int *listener, struct message *message) {
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (strlen(path) >= CONFIG_SOCKET_BYTES) {
        return message_set(message, ERROR_ARGUMENT,
                           "%s: path too long (at most %d characters for a socket)", path,
                           CONFIG_SOCKET_BYTES - 1);
    }
    memcpy(address.sun_path, path, strlen(path) + 1);
    if (is_no_socket(path, message)) {
        return ERROR_ARGUMENT;
    }
    if (is_served(&address)) {
        return message_set(message, ERROR_BUSY, "%s: in use by another vergenced", path);
    }
    // Renamed once it listens: a client that sees the name can connect.
    memcpy(address.sun_path + strlen(path), LISTENER_BESIDE, sizeof LISTENER_BESIDE);
    if (is_no_socket(address.sun_path, message)) {
        return ERROR_ARGUMENT;
    }
    remove_socket(address.sun_path);
    const int fd = socket(AF_UNIX, SOCKET_FLAGS, 0);
    // No other user may connect between bind and chmod.
    const mode_t mask = umask(0177);
    const int bound = fd >= 0 ? bind(fd, (const struct sockaddr *)&address, sizeof address) : -1;
    umask(mask);
    if (bound != 0 || chmod(address.sun_path, 0660) != 0 || listen(fd, BACKLOG) != 0 ||
        rename(address.sun_path, path) != 0) {
        const int failed = message_set(message, ERROR_IO, "%s: %s", path, give_up(fd));
        remove_socket(address.sun_path);
        return failed;
    }
    *listener = fd;
    return ERROR_OK;
}

int listener_tcp(uint16_t port, bool network, int *listener, struct message *message) {
    const struct sockaddr_in address = {
        .sin_family = AF_INET,
        .sin_port = htons(port),
        .sin_addr.s_addr = htonl(network ? INADDR_ANY : INADDR_LOOPBACK)};
    const int fd = socket(AF_INET, SOCKET_FLAGS, 0);
    const int one = 1;
    if (fd < 0 || setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one) != 0 ||
        bind(fd, (const struct sockaddr *)&address, sizeof address) != 0 ||
        listen(fd, BACKLOG) != 0) {
        return message_set(message, ERROR_IO, "%s", give_up(fd));
    }
    *listener = fd;
    return ERROR_OK;
}

int listener_open(const struct config *config, int fds[LISTENERS], char token[TOKEN_BYTES],
                  struct message *message) {
    const uint16_t port = config->tcp_port;
    struct message inner;
    int error =
        port == 0 ? 0
                  : listener_tcp(port, config->tcp_network[0] != '\0', &fds[LISTENER_TCP], &inner);
    if (error != ERROR_OK) {
        return message_set(message, error, "tcp_port = %u: %.900s", (unsigned)port, inner.text);
    }
    error = port == 0 ? 0 : token_open(config->tcp_token, token, &inner);
    if (error != ERROR_OK) {
        return message_set(message, error, "tcp_token = %.900s", inner.text);
    }
    // Last: programs that wait for the daemon wait for this file to appear.
    error =
        config->socket[0] == '\0' ? 0 : listener_unix(config->socket, &fds[LISTENER_UNIX], &inner);
    return error == ERROR_OK ? ERROR_OK
                             : message_set(message, error, "socket = %.900s", inner.text);
}

int listener_accept(int fd) {
    return accept4(fd, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
}

bool listener_admits(const struct config *config, int fd, char host[LISTENER_HOST_BYTES]) {
    struct sockaddr_in peer = {0};
    socklen_t bytes = sizeof peer;
    uint32_t network = 0, mask = 0;
    if (getpeername(fd, (struct sockaddr *)&peer, &bytes) != 0) {
        strcpy(host, "unknown");  // it has gone
        return false;
    }
    inet_ntop(AF_INET, &peer.sin_addr, host, LISTENER_HOST_BYTES);
    const uint32_t address = ntohl(peer.sin_addr.s_addr);
    return address >> IN_CLASSA_NSHIFT == IN_LOOPBACKNET ||
           (config_parse_network(config->tcp_network, &network, &mask) &&
            (address & mask) == network);
}

void listener_turn_away(int fd, const char *line) {
    char asked[TURNED_AWAY_BYTES];
    const ssize_t reported = write(fd, line, strlen(line));
    (void)reported;  // a client without this line still sees the end of the connection
    // Closing with unread input would reset the connection and lose the line.
    shutdown(fd, SHUT_WR);
    const ssize_t unread = read(fd, asked, sizeof asked);
    (void)unread;
    close(fd);
}

bool listener_is_http(const char *line, size_t length) {
    static const char *const methods[] = {"GET ",     "HEAD ",    "POST ",  "PUT ",   "DELETE ",
                                          "CONNECT ", "OPTIONS ", "TRACE ", "PATCH ", "PRI "};
    bool http = false;
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; i++) {
        const size_t bytes = strlen(methods[i]);
        http = http || (length >= bytes && memcmp(line, methods[i], bytes) == 0);
    }
    return http;
}
