// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/notify.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>

static int notify_fd = -1;
static struct sockaddr_un notify_address = {.sun_family = AF_UNIX};
static socklen_t notify_bytes;

void notify_open(void) {
    const char *path = getenv("NOTIFY_SOCKET");
    if (path == NULL || (path[0] != '/' && path[0] != '@') ||
        strlen(path) >= sizeof notify_address.sun_path) {
        return;
    }
    const size_t length = strlen(path);
    memcpy(notify_address.sun_path, path, length + 1);
    if (path[0] == '@') {
        notify_address.sun_path[0] = '\0';  // a name that is no file
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
