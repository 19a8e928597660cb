// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/input_file.h"

#include <errno.h>
#include <string.h>
#include <sys/stat.h>

#include "core/error.h"

bool input_file_is_directory(const char *path) {
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

FILE *input_file_open(const char *path, struct message *message) {
    struct stat status;
    // Checked before opening, as opening a pipe would already block.
    if (stat(path, &status) == 0 && !S_ISREG(status.st_mode)) {
        message_set(message, ERROR_ARGUMENT, "%s: not a regular file (%s)", path,
                    S_ISDIR(status.st_mode) ? "directory" : "device or pipe");
        return NULL;
    }
    FILE *stream = fopen(path, "rb");
    if (stream == NULL) {
        message_set(message, ERROR_ARGUMENT, "%s: %s", path, strerror(errno));
    }
    return stream;
}

int input_file_read(const char *path, void *data, size_t capacity, size_t *length,
                    struct message *message) {
    FILE *stream = input_file_open(path, message);
    if (stream == NULL) {
        return ERROR_ARGUMENT;
    }
    *length = fread(data, 1, capacity, stream);
    const bool failed = ferror(stream) != 0;
    fclose(stream);
    if (failed) {
        return message_set(message, ERROR_ARGUMENT, "%s: cannot be read", path);
    }
    return *length > 0 ? ERROR_OK
                       : message_set(message, ERROR_SYNTAX, "%s: the file is empty", path);
}
