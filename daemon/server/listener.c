// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/listener.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"

enum { BACKLOG = 16, SOCKET_FLAGS = SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK };

/// Closes a descriptor that is not good enough.
static int fail(int fd, struct message *message, const char *what) {
    const int number = errno;
    if (fd >= 0) {
        close(fd);
    }
    return message_set(message, ERROR_IO, "%s: %s", what, strerror(number));
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

int listener_unix(const char *path, struct message *message) {
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (strlen(path) >= sizeof address.sun_path) {
        return message_set(message, ERROR_ARGUMENT,
                           "%s: a socket's path has at most %zu characters", path,
                           sizeof address.sun_path - 1);
    }
    memcpy(address.sun_path, path, strlen(path) + 1);
    struct stat there;
    if (lstat(path, &there) == 0) {
        if (!S_ISSOCK(there.st_mode)) {
            return message_set(message, ERROR_ARGUMENT, "%s: is there and is no socket", path);
        }
        if (is_served(&address)) {
            return message_set(message, ERROR_BUSY, "%s: another vergenced listens there", path);
        }
        unlink(path);
    }
    const int fd = socket(AF_UNIX, SOCKET_FLAGS, 0);
    // Nobody else may come in between bind and chmod.
    const mode_t mask = umask(0177);
    const int bound = fd >= 0 ? bind(fd, (const struct sockaddr *)&address, sizeof address) : -1;
    umask(mask);
    if (bound != 0 || chmod(path, 0660) != 0 || listen(fd, BACKLOG) != 0) {
        return fail(fd, message, path);
    }
    return fd;
}

int listener_tcp(uint16_t port, struct message *message) {
    const struct sockaddr_in address = {
        .sin_family = AF_INET, .sin_port = htons(port), .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    const int fd = socket(AF_INET, SOCKET_FLAGS, 0);
    const int one = 1;
    if (fd < 0 || setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one) != 0 ||
        bind(fd, (const struct sockaddr *)&address, sizeof address) != 0 ||
        listen(fd, BACKLOG) != 0) {
        return fail(fd, message, "TCP on the loopback");
    }
    return fd;
}

int listener_accept(int fd) {
    return accept4(fd, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
}

static speed_t speed_of(uint32_t baud) {
    static const struct {
        uint32_t baud;
        speed_t speed;
    } speeds[] = {{9600, B9600},     {19200, B19200},   {38400, B38400},   {57600, B57600},
                  {115200, B115200}, {230400, B230400}, {460800, B460800}, {921600, B921600}};
    for (size_t i = 0; i < sizeof speeds / sizeof speeds[0]; i++) {
        if (speeds[i].baud == baud) {
            return speeds[i].speed;
        }
    }
    return B0;
}

int listener_serial(const char *device, uint32_t baud, struct message *message) {
    const speed_t speed = speed_of(baud);
    if (speed == B0) {
        return message_set(message, ERROR_ARGUMENT, "%s: there is no speed of %u baud", device,
                           (unsigned)baud);
    }
    const int fd = open(device, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    struct termios settings;
    if (fd < 0 || tcgetattr(fd, &settings) != 0) {
        return fail(fd, message, device);
    }
    cfmakeraw(&settings);
    settings.c_cflag |= CLOCAL | CREAD;
    settings.c_cflag &= ~(tcflag_t)(CRTSCTS | CSTOPB);
    if (cfsetspeed(&settings, speed) != 0 || tcsetattr(fd, TCSANOW, &settings) != 0) {
        return fail(fd, message, device);
    }
    INVARIANT(fd >= 0);
    return fd;
}
