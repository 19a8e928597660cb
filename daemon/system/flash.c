// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/flash.h"

#include <errno.h>
#include <fcntl.h>
#include <mtd/mtd-user.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/types.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/device_request.h"

#define TABLE "/proc/mtd"

enum { TABLE_BYTES = 4096, CALL_BYTES = 16384 };

/// Reads the kernel's table of partitions. False: there is none.
static bool read_table(char text[TABLE_BYTES]) {
    const int fd = open(TABLE, O_RDONLY | O_CLOEXEC);
    size_t used = 0;
    ssize_t bytes = fd >= 0 ? 1 : -1;
    while (bytes > 0 && used < TABLE_BYTES - 1) {
        bytes = read(fd, text + used, TABLE_BYTES - 1 - used);
        used += bytes > 0 ? (size_t)bytes : 0;
    }
    text[used] = '\0';
    if (fd >= 0) {
        close(fd);
    }
    return bytes >= 0;
}

bool flash_find(const char *name, char device[FLASH_DEVICE_BYTES], char *names) {
    char text[TABLE_BYTES], *rest = NULL;
    names[0] = '\0';
    if (!read_table(text)) {
        return false;
    }
    for (char *line = strtok_r(text, "\n", &rest); line != NULL;
         line = strtok_r(NULL, "\n", &rest)) {
        unsigned number = 0;
        char called[FLASH_NAME_BYTES] = "";
        // mtd0: 00040000 00010000 "u-boot"
        if (sscanf(line, "mtd%u: %*x %*x \"%63[^\"]\"", &number, called) != 2) {
            continue;
        }
        if (strcmp(called, name) == 0) {
            snprintf(device, FLASH_DEVICE_BYTES, "/dev/mtd%u", number);
            return true;
        }
        const size_t used = strlen(names);
        snprintf(names + used, MESSAGE_BYTES / 2 - used, "%s%s", used > 0 ? " " : "", called);
    }
    return false;
}

/// Checks that the partition is of a kind that is written as here.
static int inspect(struct flash *self, struct message *message) {
    struct mtd_info_user about;
    if (ioctl(self->fd, (device_request)MEMGETINFO, &about) != 0) {
        return message_set(message, ERROR_UNSUPPORTED, "%s (%s): not flash: %s", self->name,
                           self->device, strerror(errno));
    }
    if (about.type != MTD_NORFLASH || about.erasesize == 0 || about.size < about.erasesize ||
        about.size % about.erasesize != 0) {
        return message_set(message, ERROR_UNSUPPORTED,
                           "%s (%s): flash of another kind (expected NOR flash)", self->name,
                           self->device);
    }
    if ((about.flags & MTD_WRITEABLE) == 0) {
        return message_set(message, ERROR_REFUSED, "%s (%s): write-protected", self->name,
                           self->device);
    }
    self->bytes = about.size;
    self->block_bytes = about.erasesize;
    return ERROR_OK;
}

int flash_open(struct flash *self, const char *name, struct message *message) {
    char names[MESSAGE_BYTES / 2];
    *self = (struct flash){.fd = -1};
    snprintf(self->name, sizeof self->name, "%s", name);
    if (!flash_find(name, self->device, names)) {
        return message_set(message, ERROR_MISSING, "no flash partition \"%s\" in " TABLE " (%s%s)",
                           name, names[0] != '\0' ? "there are: " : "there is none", names);
    }
    self->fd = open(self->device, O_RDWR | O_CLOEXEC);
    if (self->fd < 0) {
        const int error =
            errno == EACCES || errno == EPERM || errno == EROFS ? ERROR_REFUSED : ERROR_MISSING;
        return message_set(message, error, "%s (%s): %s", name, self->device, strerror(errno));
    }
    const int error = inspect(self, message);
    if (error != ERROR_OK) {
        flash_close(self);
    }
    return error;
}

void flash_close(struct flash *self) {
    if (self->fd >= 0) {
        close(self->fd);
    }
    self->fd = -1;
}

static int fail(const struct flash *self, const char *what, size_t offset,
                struct message *message) {
    return message_set(message, ERROR_IO, "%s (%s): cannot %s at 0x%zx: %s", self->name,
                       self->device, what, offset, strerror(errno));
}

static size_t part_of(size_t bytes) {
    return bytes < CALL_BYTES ? bytes : CALL_BYTES;
}

int flash_read(const struct flash *self, size_t offset, void *data, size_t bytes,
               struct message *message) {
    INVARIANT(offset <= self->bytes && bytes <= self->bytes - offset);
    for (size_t done = 0; done < bytes;) {
        const ssize_t count =
            pread(self->fd, (char *)data + done, part_of(bytes - done), (off_t)(offset + done));
        if (count <= 0) {
            errno = count == 0 ? EIO : errno;
            return fail(self, "read", offset + done, message);
        }
        done += (size_t)count;
    }
    return ERROR_OK;
}

int flash_erase(const struct flash *self, size_t offset, size_t bytes, struct message *message) {
    struct erase_info_user range = {.start = (uint32_t)offset, .length = (uint32_t)bytes};
    INVARIANT(offset <= self->bytes && bytes <= self->bytes - offset);
    INVARIANT(offset % self->block_bytes == 0 && bytes % self->block_bytes == 0);
    return ioctl(self->fd, (device_request)MEMERASE, &range) == 0
               ? 0
               : fail(self, "erase", offset, message);
}

int flash_write(const struct flash *self, size_t offset, const void *data, size_t bytes,
                struct message *message) {
    INVARIANT(offset <= self->bytes && bytes <= self->bytes - offset);
    for (size_t done = 0; done < bytes;) {
        const ssize_t count = pwrite(self->fd, (const char *)data + done, part_of(bytes - done),
                                     (off_t)(offset + done));
        if (count <= 0) {
            errno = count == 0 ? EIO : errno;
            return fail(self, "write", offset + done, message);
        }
        done += (size_t)count;
    }
    return ERROR_OK;
}
