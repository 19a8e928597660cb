// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/uboot_variables.h"

#include <stdlib.h>
#include <string.h>

#include "core/crc.h"
#include "core/error.h"

enum { CRC_BYTES = 4, BYTES_MAX = 1 << 20, END_BYTES = 2 };

/// Names under which boards have it.
static const char *const names[] = {"environment", "u-boot-env", "env"};

/// Opens the partition.
static int open_partition(struct flash *flash, struct message *message) {
    char device[FLASH_DEVICE_BYTES], others[MESSAGE_BYTES / 2];
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        if (flash_find(names[i], device, others)) {
            return flash_open(flash, names[i], message);
        }
    }
    return message_set(message, ERROR_MISSING, "no such partition in /proc/mtd");
}

/// Where the texts begin: behind the sum, or the sum and a flag. NULL: the sum differs.
static const char *find_texts(const char *data, size_t bytes) {
    const uint8_t *sum = (const uint8_t *)data;
    const uint32_t expected =
        (uint32_t)sum[3] << 24 | (uint32_t)sum[2] << 16 | (uint32_t)sum[1] << 8 | sum[0];
    for (size_t skip = CRC_BYTES; skip <= CRC_BYTES + 1; skip++) {
        if (crc_update(0, data + skip, bytes - skip) == expected) {
            return data + skip;
        }
    }
    return NULL;
}

int uboot_variables_read(struct uboot_variables *self, struct message *message) {
    struct flash flash;
    *self = (struct uboot_variables){.data = NULL};
    int error = open_partition(&flash, message);
    if (error != ERROR_OK) {
        return error;
    }
    memcpy(self->device, flash.device, sizeof self->device);
    const size_t bytes = flash.bytes < BYTES_MAX ? flash.bytes : BYTES_MAX;
    self->data = calloc(1, bytes + END_BYTES);
    error = self->data == NULL ? message_set(message, ERROR_MEMORY, "out of memory")
                               : flash_read(&flash, 0, self->data, bytes, message);
    flash_close(&flash);
    if (error == ERROR_OK) {
        self->first = find_texts(self->data, bytes);
        error = self->first != NULL
                    ? 0
                    : message_set(message, ERROR_CRC,
                                  "%s: not an environment of the partition's size", self->device);
    }
    if (error != ERROR_OK) {
        uboot_variables_free(self);
    }
    return error;
}

void uboot_variables_free(struct uboot_variables *self) {
    free(self->data);
    self->data = NULL;
}

const char *uboot_variables_find(const struct uboot_variables *self, const char *name) {
    const size_t length = strlen(name);
    for (const char *at = self->first; *at != '\0'; at += strlen(at) + 1) {
        if (strncmp(at, name, length) == 0 && at[length] == '=') {
            return at + length + 1;
        }
    }
    return NULL;
}
