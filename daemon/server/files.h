// SPDX-License-Identifier: Apache-2.0
/// The instrument's files: what clients may read. Names are relative to one directory and cannot
/// leave it, by dots or by links.
#ifndef VERGENCE_DAEMON_SERVER_FILES_H
#define VERGENCE_DAEMON_SERVER_FILES_H

#include <stddef.h>

#include "rig/command.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { FILES_NAME_MAX = 200, FILES_BLOCK_MOST = 49152, FILES_BLOCK_USUAL = 3072 };

/// Opens a regular file for reading. The descriptor, or an error with the call's message.
int files_open(const struct command_call *call, const char *name);

/// Opens a directory, "" for all files.
int files_open_directory(const struct command_call *call, const char *name);

/// Writes a whole new file in one step: nobody ever sees half of it. 0 or an error with the call's
/// message; then there is none.
int files_write(const struct command_call *call, const char *name, const void *data, size_t bytes);

/// Base64 (RFC 4648) of `bytes` bytes, terminated, in `text` (4 characters for each 3 bytes begun,
/// and one).
void files_base64(const void *data, size_t bytes, char *text);

#ifdef __cplusplus
}
#endif

#endif
