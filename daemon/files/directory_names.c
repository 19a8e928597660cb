// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/directory_names.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static int by_name(const void *a, const void *b) {
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/// Appends a copy of the name. False: out of memory.
static bool add_name(char ***names, size_t count, const char *name) {
    enum { STEP = 64 };
    if (count % STEP == 0) {
        char **more = realloc(*names, (count + STEP) * sizeof **names);
        if (more == NULL) {
            return false;
        }
        *names = more;
    }
    (*names)[count] = strdup(name);
    return (*names)[count] != NULL;
}

static bool is_dots(const char *name) {
    return strcmp(name, ".") == 0 || strcmp(name, "..") == 0;
}

DIR *directory_stream(int fd) {
    DIR *stream = fd >= 0 ? fdopendir(fd) : NULL;
    if (stream == NULL && fd >= 0) {
        const int number = errno;
        close(fd);
        errno = number;
    }
    return stream;
}

int directory_names(int directory, char ***names) {
    // From its begin, whatever was read of `directory` before.
    DIR *list = directory_stream(openat(directory, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (list == NULL) {
        return -1;
    }
    size_t count = 0;
    const struct dirent *entry = NULL;
    *names = NULL;
    errno = 0;
    while ((entry = readdir(list)) != NULL &&
           (is_dots(entry->d_name) || add_name(names, count, entry->d_name))) {
        count += !is_dots(entry->d_name);
        errno = 0;
    }
    const int number = errno;
    closedir(list);
    if (number != 0) {
        for (size_t i = 0; i < count; i++) {
            free((*names)[i]);
        }
        free(*names);
        *names = NULL;
        errno = number;
        return -1;
    }
    if (count > 0) {
        qsort(*names, count, sizeof **names, by_name);
    }
    return (int)count;
}
