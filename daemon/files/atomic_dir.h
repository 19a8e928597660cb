// SPDX-License-Identifier: Apache-2.0
/// A directory of results that appears whole or not at all. Files are first written into a hidden
/// directory on the same file system. If the final directory does not exist, the hidden one is
/// renamed. If it does, each file replaces its predecessor by a rename; the file that closes the
/// set is removed first and put in place last, so that a set without it is known to be incomplete.
/// Only files that an earlier set has put there are replaced or removed (own_listing.h).
/// A killed process leaves the hidden directory behind; the next run in the same place removes it.
#ifndef VERGENCE_DAEMON_FILES_ATOMIC_DIR_H
#define VERGENCE_DAEMON_FILES_ATOMIC_DIR_H

#include <stdbool.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { ATOMIC_DIR_PATH_BYTES = 4096 };

struct atomic_dir {
    char final_path[ATOMIC_DIR_PATH_BYTES];
    char work_path[ATOMIC_DIR_PATH_BYTES];  // "" if no work is in progress
    bool exists;                            // the final directory already existed
    int parents_created;                    // missing directories above it that were created
    int lock_fd;                            // held while the process runs
};

/// Creates the hidden directory (and missing parents). `names` (`count` of them): the files that
/// will be written, as far as known; one that exists and is not ours is refused now. Returns 0, or
/// ERROR_ARGUMENT (ERROR_FULL: no space) with the reason in `message`; nothing is left behind then.
int atomic_dir_begin(struct atomic_dir *directory, const char *path, const char *const *names,
                     int count, struct message *message);

/// Whether writing `name` into the directory `path` would replace the file `input` (under any name
/// or link). False if either is missing.
bool atomic_dir_replaces(const char *path, const char *name, const char *input);

/// Path of a file in the hidden directory, into `path` (ATOMIC_DIR_PATH_BYTES). `name` has no
/// slash.
void atomic_dir_file_path(const struct atomic_dir *directory, const char *name, char *path);

/// Moves the files written so far to the final directory. `names` (`count` of them) are all names
/// that a set may contain: our files of an earlier set that are missing in this one are removed.
/// `closing_name` is one of them. Returns 0, or ERROR_BUFFER (ERROR_FULL: no space) with `message`
/// set; the hidden directory is removed then.
int atomic_dir_commit(struct atomic_dir *directory, const char *const *names, int count,
                      const char *closing_name, struct message *message);

/// Replaces the hidden directory's path in `message` by the final one, which users know.
void atomic_dir_name_final(const struct atomic_dir *directory, struct message *message);

/// Removes everything that `atomic_dir_begin` and the writers created. Allowed after commit.
void atomic_dir_abort(struct atomic_dir *directory);

#ifdef __cplusplus
}
#endif

#endif
