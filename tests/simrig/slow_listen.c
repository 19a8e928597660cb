// SPDX-License-Identifier: Apache-2.0
// Preloaded: delays listen(), so that a client that connects too early is noticed.
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
