// SPDX-License-Identifier: Apache-2.0
/// The variables that U-Boot has saved in a partition of flash: CRC-32, a flag if there are two
/// copies, then NAME=VALUE texts up to an empty one.
#ifndef VERGENCE_DAEMON_SYSTEM_UBOOT_VARIABLES_H
#define VERGENCE_DAEMON_SYSTEM_UBOOT_VARIABLES_H

#include <stddef.h>
#include <stdint.h>

#include "daemon/base/message.h"
#include "daemon/system/flash.h"

#ifdef __cplusplus
extern "C" {
#endif

struct uboot_variables {
    char device[FLASH_DEVICE_BYTES];
    char *data;  ///< ends with two zeros
    const char *first;
};

/// Reads them, to be freed by uboot_variables_free. 0; ERROR_MISSING: no such partition, ERROR_CRC,
/// or an error of flash_open, with a message.
int uboot_variables_read(struct uboot_variables *self, struct message *message);
void uboot_variables_free(struct uboot_variables *self);

/// The value of a variable, or NULL.
const char *uboot_variables_find(const struct uboot_variables *self, const char *name);

#ifdef __cplusplus
}
#endif

#endif
