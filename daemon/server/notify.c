// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/notify.h"

#include <errno.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

static int notify_fd = -1;
static struct sockaddr_un notify_address = {.sun_family = AF_UNIX};
static socklen_t notify_bytes;

enum { PERIOD_MAX_US = 1000000, PERIOD_MIN_US = 10000 };

/// An environment variable as a number; 0 if it is not a number.
static uint64_t number_in(const char *name) {
    const char *text = getenv(name);
    if (text == NULL || text[0] < '0' || text[0] > '9') {
        return 0;
    }
    char *end = NULL;
    errno = 0;
    const unsigned long long number = strtoull(text, &end, 10);
    return *end == '\0' && errno == 0 ? number : 0;
}

uint64_t notify_period_us(void) {
    const uint64_t limit_us = number_in("WATCHDOG_USEC");
    const bool ours =
        getenv("WATCHDOG_PID") == NULL || number_in("WATCHDOG_PID") == (uint64_t)getpid();
    if (limit_us == 0 || !ours || limit_us / 2 > PERIOD_MAX_US) {
        return PERIOD_MAX_US;
    }
    return limit_us / 2 > PERIOD_MIN_US ? limit_us / 2 : PERIOD_MIN_US;
}

void notify_open(void) {
    const char *path = getenv("NOTIFY_SOCKET");
    if (path == NULL || (path[0] != '/' && path[0] != '@') ||
        strlen(path) >= sizeof notify_address.sun_path) {
        return;
    }
    const size_t length = strlen(path);
    memcpy(notify_address.sun_path, path, length + 1);
    if (path[0] == '@') {
        notify_address.sun_path[0] = '\0';  // an abstract name, which is not a file
    }
    notify_bytes = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length);
    notify_fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
}

void notify_send(const char *state) {
    if (notify_fd >= 0) {
        sendto(notify_fd, state, strlen(state), MSG_NOSIGNAL,
               (const struct sockaddr *)&notify_address, notify_bytes);
    }
}
