// SPDX-License-Identifier: Apache-2.0
/// The instrument's files, for clients. Names are relative to the directory "files" and cannot
/// leave it, neither by dots nor by links. "The call's message" is that of the struct command_call.
#ifndef VERGENCE_DAEMON_COMMANDS_FILES_H
#define VERGENCE_DAEMON_COMMANDS_FILES_H

#include <dirent.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "console/line/file_blocks.h"

/// Opens a regular file for reading. Returns its descriptor, which the caller closes, or an error
/// with the call's message.
int files_open(const struct command_call *call, const char *name);

/// Reads a whole file: its length and CRC-32. 0; ERROR_CANCELLED; ERROR_IO with the call's message.
int files_sum(const struct command_call *call, const char *name, int fd, uint64_t *size,
              uint32_t *crc);

/// Opens a directory below `root`; "": `root`. Returns its descriptor, which the caller closes, or
/// -1 with errno.
int files_open_below(int root, const char *name);

/// The same, for readdir(). The caller closes it. NULL with errno.
DIR *files_list_below(int root, const char *name);

/// Opens a directory of the instrument's files; "": the top one. Returns its descriptor, which the
/// caller closes, or an error with the call's message.
int files_open_directory(const struct command_call *call, const char *name);

/// Writes a file atomically: no reader sees a part of it. `name` has no /. 0: file and name are on
/// the disk. Else an error with the call's message: there is no room for it (space_check.h), the
/// file was not written, or a power loss may remove it.
int files_write(const struct command_call *call, const char *name, const void *data, size_t bytes);

/// Makes a name for a new file or session from the time (UTC), "KIND-YYYYMMDD-HHMMSSENDING", with a
/// number before ENDING if the name is in use. `name` has FILES_NAME_MAX + 1 bytes. Requires
/// "files" to be set, and that no other thread makes names of this kind at the same time.
void files_name_now(const struct command_call *call, const char *kind, const char *ending,
                    char *name);

/// Completions of an argument: files with their directories; directories; recorded sessions.
void files_candidates_file(const struct command_candidates *to);
void files_candidates_directory(const struct command_candidates *to);
void files_candidates_session(const struct command_candidates *to);

/// 0 if `files_fd` of the call's context is usable. ERROR_UNSUPPORTED if "files" is not set,
/// ERROR_DEVICE if the directory was removed, with the call's message.
int files_need_directory(const struct command_call *call);

/// Check the name of a file or session by file_blocks_name_fault, of a new one by
/// file_blocks_new_name_fault. 0, or ERROR_ARGUMENT with the call's message.
int files_check_plain(const struct command_call *call, const char *name);
int files_check_new(const struct command_call *call, const char *name);

/// Converts `number`, the errno of a system call on the file `name`, into an error with the call's
/// message.
int files_refuse(const struct command_call *call, const char *name, int number);

#endif
