// SPDX-License-Identifier: Apache-2.0
/// Small named records that survive a restart: settings, the calibration.
///
/// A record is always completely the old or the new one, even after a power failure, a kill or a
/// full disk. Backends return 0 or these of core/error.h: ERROR_MISSING: no such record;
/// ERROR_BUFFER: it is longer than the buffer; ERROR_CRC: it differs from what was saved;
/// ERROR_FULL: no space; ERROR_REFUSED: no permission to read or write; ERROR_IO: any other error.
#ifndef VERGENCE_HAL_STORE_H
#define VERGENCE_HAL_STORE_H

#include <stddef.h>

/// Longest name, without terminator: letters, digits, '-', '_' and '.', the first a letter.
enum { HAL_STORE_NAME_MAX = 40 };

/// What a backend implements; `self` is that of `struct hal_store`.
struct hal_store_operations {
    /// Reads a record. The buffer is undefined after an error.
    int (*load)(void *self, const char *name, void *data, size_t capacity, size_t *bytes);
    /// Returns when the record is safely stored.
    int (*save)(void *self, const char *name, const void *data, size_t bytes);
    /// ERROR_MISSING: no such record.
    int (*remove)(void *self, const char *name);
};

/// A store. The backend owns what `self` points to, which must outlive all users.
struct hal_store {
    const struct hal_store_operations *operations;
    void *self;
};

#endif
