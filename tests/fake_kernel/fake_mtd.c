// SPDX-License-Identifier: Apache-2.0
#include "fake_mtd.h"

#include <errno.h>
#include <fcntl.h>
#include <mtd/mtd-user.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "fake_file.h"

static struct fake_mtd partitions[FAKE_MTDS];
static unsigned count;
static size_t table_read;  // bytes of /proc/mtd since it was opened

static int open_table(struct fake_file *file) {
    (void)file;
    table_read = 0;
    return 0;
}

static int read_table(struct fake_file *file, void *data, size_t bytes) {
    (void)file;
    char text[1024] = "dev:    size   erasesize  name\n";
    for (unsigned i = 0; i < count; i++) {
        const size_t used = strlen(text);
        snprintf(text + used, sizeof text - used, "mtd%u: %08x %08x \"%s\"\n", i,
                 partitions[i].bytes, partitions[i].block_bytes, partitions[i].name);
    }
    const size_t left = strlen(text) - table_read;
    const size_t part = bytes < left ? bytes : left;
    memcpy(data, text + table_read, part);
    table_read += part;
    return (int)part;
}

static void describe(struct fake_file *file, unsigned long request, const void *argument,
                     char *line, size_t bytes) {
    (void)file;
    const struct erase_info_user *range = argument;
    if (request == MEMERASE) {
        snprintf(line, bytes, "MEMERASE 0x%x %u", range->start, range->length);
    } else if (request == MEMGETINFO) {
        snprintf(line, bytes, "MEMGETINFO");
    }
}

static int control(struct fake_file *file, unsigned long request, void *argument) {
    struct fake_mtd *self = file->state;
    if (request == MEMGETINFO) {
        *(struct mtd_info_user *)argument = (struct mtd_info_user){.type = self->type,
                                                                   .flags = self->flags,
                                                                   .size = self->bytes,
                                                                   .erasesize = self->block_bytes,
                                                                   .writesize = 1};
        return 0;
    }
    const struct erase_info_user *range = argument;
    if (request != MEMERASE) {
        return -ENOTTY;
    }
    if (range->start % self->block_bytes != 0 || range->length % self->block_bytes != 0 ||
        range->start > self->bytes || range->length > self->bytes - range->start) {
        return -EINVAL;
    }
    memset(self->data + range->start, 0xFF, range->length);
    return 0;
}

static int transfer(const struct fake_mtd *self, size_t bytes, off_t offset) {
    const off_t left = (off_t)self->bytes - offset;
    return left < (off_t)bytes ? (int)left : (int)bytes;
}

static int read_at(struct fake_file *file, void *data, size_t bytes, off_t offset) {
    const struct fake_mtd *self = file->state;
    const int part = transfer(self, bytes, offset);
    memcpy(data, self->data + offset, (size_t)part);
    return part;
}

static int write_at(struct fake_file *file, const void *data, size_t bytes, off_t offset) {
    struct fake_mtd *self = file->state;
    const int part = transfer(self, bytes, offset);
    for (int i = 0; i < part; i++) {
        self->data[offset + i] &= ((const uint8_t *)data)[i];
    }
    if (self->worn) {
        self->data[self->block_bytes + 5] |= 1;
    }
    return part;
}

struct fake_mtd *fake_mtd_add(const char *name, const char *file, uint32_t block_bytes) {
    static const struct fake_operations table = {.open = open_table, .read = read_table};
    static const struct fake_operations flash = {
        .describe = describe, .ioctl = control, .pread = read_at, .pwrite = write_at};
    struct fake_mtd *self = &partitions[count];
    struct stat about;
    char path[32];
    const int fd = open(file, O_RDWR | O_CLOEXEC);
    if (count == FAKE_MTDS || fd < 0 || fstat(fd, &about) != 0 || block_bytes == 0 ||
        about.st_size % block_bytes != 0) {
        return NULL;
    }
    void *data = mmap(NULL, (size_t)about.st_size, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    close(fd);
    if (data == MAP_FAILED) {
        return NULL;
    }
    *self = (struct fake_mtd){.data = data,
                              .bytes = (uint32_t)about.st_size,
                              .block_bytes = block_bytes,
                              .type = MTD_NORFLASH,
                              .flags = MTD_CAP_NORFLASH};
    snprintf(self->name, sizeof self->name, "%s", name);
    if (count == 0) {
        fake_file_device("/proc/mtd", 0, 0, &table, NULL);
    }
    snprintf(path, sizeof path, "/dev/mtd%u", count++);
    fake_file_device(path, 90, 2 * (count - 1), &flash, self);
    return self;
}

void fake_mtd_forget(void) {
    for (unsigned i = 0; i < count; i++) {
        munmap(partitions[i].data, partitions[i].bytes);
    }
    count = 0;
}
