// SPDX-License-Identifier: Apache-2.0
/// A partition of NOR flash, by the name that /proc/mtd gives it.
#ifndef VERGENCE_DAEMON_SYSTEM_FLASH_H
#define VERGENCE_DAEMON_SYSTEM_FLASH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { FLASH_NAME_BYTES = 64, FLASH_DEVICE_BYTES = 32 };

struct flash {
    int fd;
    char name[FLASH_NAME_BYTES];
    char device[FLASH_DEVICE_BYTES];  ///< "/dev/mtd2"
    uint32_t bytes;
    uint32_t block_bytes;  ///< what is erased at once; `bytes` is a multiple of it
};

/// Finds the device of a partition. False: /proc/mtd cannot be read or does not name it; `names`
/// (MESSAGE_BYTES / 2) then has the names there.
bool flash_find(const char *name, char device[FLASH_DEVICE_BYTES], char *names);

/// Opens a partition, to be closed by flash_close. 0, or with a message ERROR_MISSING: there is
/// none of that name, or its device cannot be opened; ERROR_UNSUPPORTED: another kind of flash;
/// ERROR_REFUSED: not permitted, or write-protected.
int flash_open(struct flash *self, const char *name, struct message *message);
void flash_close(struct flash *self);

/// Read, erase (whole blocks) and write (erased ones) a range inside the partition. 0, or ERROR_IO
/// with a message.
int flash_read(const struct flash *self, size_t offset, void *data, size_t bytes,
               struct message *message);
int flash_erase(const struct flash *self, size_t offset, size_t bytes, struct message *message);
int flash_write(const struct flash *self, size_t offset, const void *data, size_t bytes,
                struct message *message);

#ifdef __cplusplus
}
#endif

#endif
