// SPDX-License-Identifier: Apache-2.0
/// Waits until a file, or its name, is on disk. A name that was created, changed or removed is
/// stored in its directory; after a power loss the old state may return unless that was synced too.
#ifndef VERGENCE_DAEMON_FILES_SYNC_FILE_H
#define VERGENCE_DAEMON_FILES_SYNC_FILE_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Syncs a file's contents, or the names in a directory that is open for reading. False with errno.
/// File systems without sync do not count as a failure.
bool sync_file(int fd);

/// The same for the directory at `path` relative to `directory`, which may be open as O_PATH: "."
/// is `directory` itself, ".." its parent.
bool sync_directory_at(int directory, const char *path);

#ifdef __cplusplus
}
#endif

#endif
