// SPDX-License-Identifier: Apache-2.0
/// Preloaded before the C library: writes a line to the file BIG_BLOCKS for each allocation above 1
/// MiB: its bytes, and where in the program the call is.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

void *__libc_malloc(size_t bytes);
void *__libc_calloc(size_t count, size_t bytes);
void *__libc_realloc(void *block, size_t bytes);

static void report(size_t bytes, const void *caller) {
    const char *path = bytes > 1 << 20 ? getenv("BIG_BLOCKS") : NULL;
    Dl_info place;
    if (path == NULL || dladdr(caller, &place) == 0) {
        return;
    }
    char line[64];
    const uintptr_t offset = (uintptr_t)caller - (uintptr_t)place.dli_fbase;
    const int length = snprintf(line, sizeof line, "%zu %#jx\n", bytes, (uintmax_t)offset);
    const int fd = open(path, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0600);
    if (fd < 0 || write(fd, line, (size_t)length) != length) {
        abort();
    }
    close(fd);
}

void *malloc(size_t bytes) {
    report(bytes, __builtin_return_address(0));
    return __libc_malloc(bytes);
}

void *calloc(size_t count, size_t bytes) {
    report(count * bytes, __builtin_return_address(0));
    return __libc_calloc(count, bytes);
}

void *realloc(void *block, size_t bytes) {
    report(bytes, __builtin_return_address(0));
    return __libc_realloc(block, bytes);
}
