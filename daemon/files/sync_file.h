// SPDX-License-Identifier: Apache-2.0
/// Until the disk has a file, and its name: a name that was made, changed or taken away is in its
/// directory, and after a power loss the old one may be there again unless that was synced, too.
#ifndef VERGENCE_DAEMON_FILES_SYNC_FILE_H
#define VERGENCE_DAEMON_FILES_SYNC_FILE_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Waits until the disk has what a file holds, or the names in a directory that is open for
/// reading. False: errno says why not. File systems that have no sync are no failure.
bool sync_file(int fd);

/// The same for the directory at `path` as seen from `directory`, which may be open for nothing
/// (O_PATH): "." is that itself, ".." the one that has its name.
bool sync_directory_at(int directory, const char *path);

#ifdef __cplusplus
}
#endif

#endif
