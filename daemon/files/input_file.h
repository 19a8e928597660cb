// SPDX-License-Identifier: Apache-2.0
/// Opens files that the user names. Only plain files: a pipe would block until its other end opens,
/// and a device may never end.
#ifndef VERGENCE_DAEMON_FILES_INPUT_FILE_H
#define VERGENCE_DAEMON_FILES_INPUT_FILE_H

#include <stdbool.h>
#include <stdio.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Opens a plain file (or a link to one) for reading; the caller closes it. NULL if it is missing,
/// unreadable or not a plain file, with one line in `message` that names it.
FILE *input_file_open(const char *path, struct message *message);

/// Reads the first `capacity` bytes of such a file, or all that it has. 0, ERROR_ARGUMENT as above,
/// or ERROR_SYNTAX: it is empty.
int input_file_read(const char *path, void *data, size_t capacity, size_t *length,
                    struct message *message);

/// Whether the path names a directory (or a link to one).
bool input_file_is_directory(const char *path);

#ifdef __cplusplus
}
#endif

#endif
