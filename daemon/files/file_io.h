// SPDX-License-Identifier: Apache-2.0
/// Steps of writing files: errors, whole writes, and waiting for the disk. Names that were created,
/// changed or removed are stored in their directory; after a power loss the old state may return
/// unless that was synced too.
#ifndef VERGENCE_DAEMON_FILES_FILE_IO_H
#define VERGENCE_DAEMON_FILES_FILE_IO_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/// The error of core/error.h for an errno: ERROR_MISSING (does not exist), ERROR_FULL (see below),
/// ERROR_REFUSED (no permission, a read-only disk, or a link that is not followed), or ERROR_IO.
int file_error(int number);

/// Whether the error means no space: disk, quota or size limit.
bool file_error_is_full(int number);

/// Writes all `bytes` of `data` to a blocking descriptor, in as many calls as needed, also across
/// signals. False with errno (EIO if nothing was accepted); a part may have been written.
bool write_all(int fd, const void *data, size_t bytes);

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
