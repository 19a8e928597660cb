// SPDX-License-Identifier: Apache-2.0
/// The files of a session that its index, or their own names, prove to be a session's, and their
/// removal.
#ifndef VERGENCE_DAEMON_SESSION_SESSION_FILES_H
#define VERGENCE_DAEMON_SESSION_SESSION_FILES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct session_files {
    int directory;  // descriptor of the session's directory
    uint32_t *crc;  // CRCs of the frames and calibrations that the index names; allocated
    size_t count;
};

/// Reads the index of the session in the open `directory`, as far as it can be read. False: it
/// contains no session. The caller frees the list.
bool session_files_read(struct session_files *self, int directory);

/// Whether `name` is a file of the session: the index, the calls, a frame or a calibration that the
/// index names, or one whose contents have the CRC-32 that is its name (it was written before a
/// kill, and never listed).
bool session_files_has(const struct session_files *self, const char *name);

/// Removes the session's files, the index last, and abandoned temporary files.
void session_files_remove(const struct session_files *self);

void session_files_free(struct session_files *self);

#ifdef __cplusplus
}
#endif

#endif
