// SPDX-License-Identifier: Apache-2.0
/// Replaces a file whole or not at all: it is written under a temporary name, synced and renamed,
/// and the name is synced. Whatever happens (a kill at any moment, a full disk), its name has the
/// old contents or all of the new ones. atomic_dir does the same for a directory.
///
/// Names are relative to the descriptor `directory` as in openat(2), which may be open as O_PATH.
#ifndef VERGENCE_DAEMON_FILES_ATOMIC_FILE_H
#define VERGENCE_DAEMON_FILES_ATOMIC_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

#include "daemon/files/own_remove.h"

#ifdef __cplusplus
extern "C" {
#endif

struct atomic_file {
    int fd;                          // descriptor for writing
    int directory;                   // directory that contains the file
    bool opened;                     // `directory` was opened here and is closed at the end
    const char *name;                // the file's name without its directories
    char temporary[OWN_NAME_BYTES];  // new, see own_remove.h
};

/// Creates a temporary file beside `name`, which must stay valid. False with errno.
bool atomic_file_begin(struct atomic_file *self, int directory, const char *name, mode_t mode);

/// Ends it: gives the file its final name, and closes it. `written`: nothing failed before; else
/// errno says why. False with errno; unless only the name could not be synced, the temporary file
/// is removed and the final one is unchanged.
bool atomic_file_end(struct atomic_file *self, bool written);

/// All steps for contents in memory. False with errno, as above.
bool atomic_file_write(int directory, const char *name, mode_t mode, const void *data,
                       size_t bytes);

/// Syncs a file that was written over some time under another name, gives it its name and syncs
/// that. `fd` and, on failure, the other name stay.
bool atomic_file_rename(int directory, int fd, const char *temporary, const char *name);

#ifdef __cplusplus
}
#endif

#endif
