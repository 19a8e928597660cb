// SPDX-License-Identifier: Apache-2.0
/// Replaces a file whole or not at all: it is written under a temporary name, synced and renamed,
/// and the name is synced. Whatever happens (a kill at any moment, a full disk), its name has the
/// old contents or all of the new ones. atomic_dir does the same for a directory.
///
/// Names are relative to the descriptor `directory` as in openat(2), which may be open as O_PATH.
/// The temporary one lies in the same directory as the final one.
#ifndef VERGENCE_DAEMON_FILES_ATOMIC_FILE_H
#define VERGENCE_DAEMON_FILES_ATOMIC_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Opens the temporary file, empty, for writing. -1 with errno.
int atomic_file_begin(int directory, const char *temporary, mode_t mode);

/// Ends it: gives the file its final name, and closes `fd`. `written`: nothing failed before; else
/// errno says why. False with errno; unless only the name could not be synced, the temporary file
/// is removed and the final one is unchanged.
bool atomic_file_end(int directory, int fd, const char *temporary, const char *name, bool written);

/// The same for a file that was written to over some time: `fd` and, on failure, the temporary file
/// stay.
bool atomic_file_rename(int directory, int fd, const char *temporary, const char *name);

/// All steps for contents in memory. False with errno, as above.
bool atomic_file_write(int directory, const char *temporary, const char *name, mode_t mode,
                       const void *data, size_t bytes);

#ifdef __cplusplus
}
#endif

#endif
