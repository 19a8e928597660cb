// SPDX-License-Identifier: Apache-2.0
/// A directory of results that appears as a whole or not at all. Files are first written into a
/// hidden directory on the same file system. If the final one did not exist the hidden one is
/// renamed; if it did, each file replaces its predecessor by a rename, and the file that closes the
/// set goes first and comes last, so that without it the set is known to be unfinished.
/// A process that is killed leaves the hidden directory; the next one here removes it.
#ifndef VERGENCE_DAEMON_FILES_OUTDIR_H
#define VERGENCE_DAEMON_FILES_OUTDIR_H

#include <stdbool.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { OUTDIR_PATH_BYTES = 4096 };

struct outdir {
    char final_path[OUTDIR_PATH_BYTES];
    char work_path[OUTDIR_PATH_BYTES];  // "" when there is nothing to finish
    bool exists;                        // the final directory was there already
    int parents_created;                // missing directories above it that were created
    int lock_fd;                        // held while the process lives
};

/// Makes the hidden directory (and missing parents). Returns 0, or ERROR_ARGUMENT (ERROR_FULL: as
/// below) with `message` saying why nothing can be written there; then nothing is left behind.
int outdir_begin(struct outdir *directory, const char *path, struct message *message);

/// Whether writing `name` into the directory `path` would replace the very file `input` (by
/// whatever name or link it is given). False when either is missing.
bool outdir_replaces(const char *path, const char *name, const char *input);

/// Path of a file in the hidden directory, in `path` (OUTDIR_PATH_BYTES). `name` has no slash.
void outdir_file_path(const struct outdir *directory, const char *name, char *path);

/// Puts the files written so far in place. `names` (count of them) are all that a set may hold:
/// those of an earlier set that this one lacks are removed; `closing_name` is one of them.
/// Returns 0, or ERROR_BUFFER (ERROR_FULL: there is no room) with `message` set; then the hidden
/// directory is removed.
int outdir_commit(struct outdir *directory, const char *const *names, int count,
                  const char *closing_name, struct message *message);

/// Where `message` names the hidden directory, lets it name the final one: what users know.
void outdir_name_final(const struct outdir *directory, struct message *message);

/// Removes all that `outdir_begin` and the writers made. Harmless after commit.
void outdir_abort(struct outdir *directory);

#ifdef __cplusplus
}
#endif

#endif
