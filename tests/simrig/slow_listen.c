// SPDX-License-Identifier: Apache-2.0
// Preloaded: listen() takes its time, so that whoever connects too early is seen.
#include <dlfcn.h>
#include <stdint.h>
#include <sys/socket.h>
#include <unistd.h>

enum { SLOW_LISTEN_US = 300000 };

int listen(int fd, int backlog) {
    usleep(SLOW_LISTEN_US);
    int (*next)(int, int) = (int (*)(int, int))(intptr_t)dlsym(RTLD_NEXT, "listen");
    return next(fd, backlog);
}
