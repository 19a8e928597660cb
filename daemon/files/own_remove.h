// SPDX-License-Identifier: Apache-2.0
/// Removal. `own_remove` is the one function of the daemon and of the programs of the PC that
/// removes anything, and it demands a proof that this product made what the name denotes. It never
/// follows a link. What cannot be proven stays, with EPERM.
///
/// Temporary names, of files and of directories, are `.vergence-PROCESS-NUMBER`: the process holds
/// a lock (flock) on them, so that those of a killed process are known and removed later.
#ifndef VERGENCE_DAEMON_FILES_OWN_REMOVE_H
#define VERGENCE_DAEMON_FILES_OWN_REMOVE_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

#define OWN_PREFIX ".vergence-"
enum { OWN_NAME_BYTES = 48, OWN_NAMES = 1000 };  // names of one process at a time in one directory

enum own_proof_kind {
    OWN_TEMPORARY,  // a temporary name with the id of this process; a directory with its files
    OWN_ABANDONED,  // such a name of a process that has ended
    OWN_OPEN,       // a file that this process created and has open as `fd`
    OWN_LISTED,     // a file that a listing of ours names: `lists(listing, name)`
    OWN_ASKED,      // a file or a link, in the instrument's directory, that the user asks to remove
    OWN_EMPTY,      // a directory of ours, if it is empty
    OWN_SOCKET,     // a socket under the configured name (`name` may be a path)
};

struct own_proof {
    enum own_proof_kind kind;
    int fd;
    bool (*lists)(const void *listing, const char *name);
    const void *listing;
    bool alone;  // no other process writes into the directory: an abandoned name may be new
};

/// Removes `name` in the open `directory`. False with errno: EPERM if the proof fails (another kind
/// of file, a link), ENOENT, ENOTEMPTY, and those of unlinkat(2).
bool own_remove(int directory, const char *name, const struct own_proof *proof);

/// Whether that would be permitted; a file may also be replaced then. A missing one is not.
bool own_is_proven(int directory, const char *name, const struct own_proof *proof);

/// The temporary name with this number.
void own_temporary_name(int number, char name[OWN_NAME_BYTES]);

/// Creates a temporary directory in `directory`, locked, with the umask's permissions. Returns its
/// descriptor, which the caller keeps open as long as the directory is needed; -1 with errno.
int own_make_directory(int directory, char name[OWN_NAME_BYTES]);

/// Removes what processes that have ended left under temporary names. `alone`: this process has the
/// directory to itself; else new ones stay, which may be about to be locked. Failures do no harm.
void own_remove_abandoned(int directory, bool alone);

#ifdef __cplusplus
}
#endif

#endif
