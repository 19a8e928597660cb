// SPDX-License-Identifier: Apache-2.0
/// hal_store as files in a directory: one file a record, named as the record.
///
/// A file is one line of text (format, length, checksum of name and contents) and then the contents
/// as they are, so that `tail -n +2` shows them. A save writes a hidden file beside it, makes sure
/// that the disk has it, renames it, and makes sure of the directory: a reader finds the old record
/// or the new one, whole. When a save fails after the rename (the directory's sync failed) the new
/// record is there, but may be gone after a loss of power; the old one is then.
///
/// One process at a time has a directory: it is locked while the store is open.
#ifndef VERGENCE_DAEMON_BACKENDS_STORE_STORE_H
#define VERGENCE_DAEMON_BACKENDS_STORE_STORE_H

#include "daemon/base/message.h"
#include "hal/store.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The caller owns it; `hal` points to it, so it must not move.
struct store {
    struct hal_store hal;
    int directory_fd;
};

/// Opens the directory, makes it (mode 0700) if only its last part is missing, and removes what
/// interrupted saves have left. ERROR_MISSING, ERROR_REFUSED (not allowed, or another process has
/// it), ERROR_FULL, ERROR_IO; `message` says more and nothing is open then.
int store_open(struct store *self, const char *path, struct message *message);
void store_close(struct store *self);

#ifdef __cplusplus
}
#endif

#endif
