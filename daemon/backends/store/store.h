// SPDX-License-Identifier: Apache-2.0
/// hal_store as files in a directory: one file a record, with the record's name.
///
/// A file is one line of text (format, length, checksum of name and contents) followed by the
/// contents unchanged, so that `tail -n +2` shows them. A save writes a hidden file in the same
/// directory, syncs it, renames it and syncs the directory: a reader finds the old record or the
/// new one, whole. If a save fails after the rename (the directory's sync failed), the new record
/// exists, but a power loss may bring the old one back.
///
/// Only one process uses a directory: it is locked while the store is open.
#ifndef VERGENCE_DAEMON_BACKENDS_STORE_STORE_H
#define VERGENCE_DAEMON_BACKENDS_STORE_STORE_H

#include <stdint.h>

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

/// Opens the directory, creates it (mode 0700) if only its last part is missing, and removes
/// leftovers of interrupted saves. ERROR_MISSING, ERROR_REFUSED (no permission, or another process
/// has it), ERROR_FULL, ERROR_IO, with `message` set; nothing is open then.
int store_open(struct store *self, const char *path, struct message *message);
void store_close(struct store *self);

/// When a record was saved, in seconds since 1970 by the clock of the system; 0: no such record.
int64_t store_saved_s(const struct store *self, const char *name);

#ifdef __cplusplus
}
#endif

#endif
