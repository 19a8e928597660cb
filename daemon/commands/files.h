// SPDX-License-Identifier: Apache-2.0
/// The instrument's files: what clients may read. Names are relative to one directory and cannot
/// leave it, by dots or by links.
#ifndef VERGENCE_DAEMON_COMMANDS_FILES_H
#define VERGENCE_DAEMON_COMMANDS_FILES_H

#include <dirent.h>
#include <stddef.h>

#include "console/command.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { FILES_NAME_MAX = 200, FILES_BLOCK_MOST = 49152, FILES_BLOCK_USUAL = 3072 };

/// Opens a regular file for reading. The descriptor, or an error with the call's message.
int files_open(const struct command_call *call, const char *name);

/// Opens a directory below another one, "" for that itself. The descriptor, or -1 and errno.
int files_open_below(int root, const char *name);

/// The same, to read its entries. The caller closes it; NULL and errno.
DIR *files_list_below(int root, const char *name);

/// What a directory holds, in the order of the names. How many; or -1 with errno. The caller frees
/// each of `*entries`, and it.
int files_list_sorted(int directory, struct dirent ***entries);

/// Opens a directory, "" for all files.
int files_open_directory(const struct command_call *call, const char *name);

/// Writes a whole new file in one step: nobody ever sees half of it. 0: the disk has it and its
/// name; or an error with the call's message: then there is none, or one that a power loss may take
/// away.
int files_write(const struct command_call *call, const char *name, const void *data, size_t bytes);

/// A name for a new file or session that tells the time, "KIND-YYYYMMDD-HHMMSSENDING", and which of
/// several in one second it is. `name` has FILES_NAME_MAX + 1 bytes. Only where there is a place
/// for files, and nobody else makes such names meanwhile.
void files_name_now(const struct command_call *call, const char *kind, const char *ending,
                    char *name);

/// What may be typed for a file, with its directories; for a directory; for a recorded session.
void files_candidates_file(const struct command_candidates *to);
void files_candidates_directory(const struct command_candidates *to);
void files_candidates_session(const struct command_candidates *to);

/// ERROR_UNSUPPORTED when there is no place for files, ERROR_DEVICE when somebody has taken it
/// away. Else 0, and `files_fd` of the call's surroundings is one.
int files_need_directory(const struct command_call *call);

/// Refuses what is no plain name of a file or a session: one with / or that begins with a dot.
int files_check_plain(const struct command_call *call, const char *name);

/// Likewise for one that is to be made, which has to be good for every line and every shell: of
/// letters, digits and - _ . + = , @ alone.
int files_check_new(const struct command_call *call, const char *name);

/// The error of a system call that failed for a file, by its errno, with the call's message.
int files_refuse(const struct command_call *call, const char *name, int number);

#ifdef __cplusplus
}
#endif

#endif
