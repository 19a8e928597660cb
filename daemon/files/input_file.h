// SPDX-License-Identifier: Apache-2.0
/// Opening what the user names: only plain files, for a pipe would make the process wait for its
/// other end, and a device may never end.
#ifndef VERGENCE_DAEMON_FILES_INPUT_FILE_H
#define VERGENCE_DAEMON_FILES_INPUT_FILE_H

#include <stdbool.h>
#include <stdio.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Opens a plain file (or a link to one) for reading; the caller closes it. NULL with one line in
/// `message` that names it when it is missing, unreadable, or no plain file.
FILE *input_file_open(const char *path, struct message *message);

/// Whether the path names a directory (or a link to one).
bool input_file_is_directory(const char *path);

#ifdef __cplusplus
}
#endif

#endif
