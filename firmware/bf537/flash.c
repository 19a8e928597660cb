// SPDX-License-Identifier: Apache-2.0
// The EZ-KIT's M29W320EB (STMicroelectronics, data sheet: command interface), 16 bits wide, in the
// processor's asynchronous banks. The boot loader is at its beginning. Two copies of the record are
// at its end, where sectors have 64 KiB: the older one is replaced, its head is programmed last.
#include "bf537/flash.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "bf537/clock.h"
#include "bf537/mmr.h"
#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"

enum {
    FLASH_BASE = 0x20000000,
    FLASH_BYTES = 4 << 20,
    SECTOR_BYTES = 64 << 10,
    COPIES = 2,
    COPY_BYTES = 7 * SECTOR_BYTES,  // a calibration of all zooms has up to 384 KiB
    MAGIC = 0x31474356,
    NAME_BYTES = HAL_STORE_NAME_MAX + 4,
    ERASE_US = 6000000,  // at most, as the data sheet says, and a word
    PROGRAM_US = 1000,
    ERASE_POLL_US = 1000,
};

struct head {
    uint32_t magic, crc;  // of all that follows, and the data
    uint32_t sequence, bytes;
    char name[NAME_BYTES];  // "": none is kept
};

static struct rig_observer observer;

static volatile uint16_t *words_at(uint32_t offset) {
    return (volatile uint16_t *)(uintptr_t)(FLASH_BASE + offset);
}

static const uint8_t *bytes_at(uint32_t offset) {
    return (const uint8_t *)(uintptr_t)(FLASH_BASE + offset);
}

static uint32_t offset_of(int copy) {
    return (uint32_t)(FLASH_BYTES - (COPIES - copy) * COPY_BYTES);
}

// ---- commands

static void write_word(uint32_t word, uint16_t value) {
    words_at(0)[word] = value;
    ssync();
}

static void begin_command(uint16_t value) {
    write_word(0x555, 0xAA);
    write_word(0x2AA, 0x55);
    write_word(0x555, value);
}

/// Waits until a word reads as it is to be: before, its bit 7 is the inverse.
static int wait_for(uint32_t offset, uint16_t value, uint32_t most_us, uint32_t poll_us) {
    const uint64_t end_us = bf537_now_us() + most_us;
    while (*words_at(offset) != value) {
        const uint64_t now_us = bf537_now_us();
        if (now_us > end_us) {
            write_word(0, 0xF0);
            return ERROR_IO;
        }
        (void)observer.should_stop(observer.self);
        if (poll_us > 0) {
            bf537_sleep_until_us(now_us + poll_us);
        }
    }
    return ERROR_OK;
}

static int erase(uint32_t offset) {
    begin_command(0x80);
    write_word(0x555, 0xAA);
    write_word(0x2AA, 0x55);
    write_word(offset / sizeof(uint16_t), 0x30);
    return wait_for(offset, 0xFFFF, ERASE_US, ERASE_POLL_US);
}

static int program(uint32_t offset, const void *data, size_t bytes) {
    const uint8_t *from = data;
    INVARIANT(offset % sizeof(uint16_t) == 0);
    for (size_t i = 0; i < bytes; i += sizeof(uint16_t)) {
        const uint8_t high = i + 1 < bytes ? from[i + 1] : 0xFF;
        const uint16_t value = (uint16_t)(from[i] | high << 8);
        const uint32_t at = offset + (uint32_t)i;
        begin_command(0xA0);
        write_word(at / sizeof(uint16_t), value);
        const int error = wait_for(at, value, PROGRAM_US, 0);
        if (error != ERROR_OK) {
            return error;
        }
    }
    return ERROR_OK;
}

// ---- the record

static uint32_t crc_of(const struct head *head, const void *data) {
    const size_t covered = offsetof(struct head, sequence);
    const uint32_t crc =
        crc_update(0, (const uint8_t *)head + covered, sizeof(struct head) - covered);
    return crc_update(crc, data, head->bytes);
}

/// The copy that counts; -1: none.
static int newest_copy(struct head *head) {
    int newest = -1;
    for (int copy = 0; copy < COPIES; copy++) {
        struct head found;
        const uint8_t *at = bytes_at(offset_of(copy));
        memcpy(&found, at, sizeof found);
        if (found.magic == MAGIC && found.bytes <= COPY_BYTES - sizeof found &&
            found.crc == crc_of(&found, at + sizeof found) &&
            (newest < 0 || (int32_t)(found.sequence - head->sequence) > 0)) {
            newest = copy;
            *head = found;
        }
    }
    return newest;
}

static int replace(const char *name, const void *data, size_t bytes) {
    struct head old = {.sequence = 0};
    const int copy = newest_copy(&old) == 0 ? 1 : 0;
    struct head head = {.magic = MAGIC, .sequence = old.sequence + 1, .bytes = (uint32_t)bytes};
    const uint32_t offset = offset_of(copy);
    strcpy(head.name, name);
    head.crc = crc_of(&head, data);
    int error = ERROR_OK;
    for (uint32_t at = 0; at < sizeof head + bytes && error == ERROR_OK; at += SECTOR_BYTES) {
        error = erase(offset + at);
    }
    error = error == ERROR_OK ? program(offset + sizeof head, data, bytes) : error;
    return error == ERROR_OK ? program(offset, &head, sizeof head) : error;
}

static bool holds(const struct head *head, const char *name) {
    return strncmp(head->name, name, sizeof head->name) == 0;
}

static int load(void *self, const char *name, void *data, size_t capacity, size_t *bytes) {
    struct head head;
    (void)self;
    const int copy = newest_copy(&head);
    if (copy < 0 || !holds(&head, name)) {
        return ERROR_MISSING;
    }
    if (head.bytes > capacity) {
        return ERROR_BUFFER;
    }
    *bytes = head.bytes;
    memcpy(data, bytes_at(offset_of(copy) + sizeof head), head.bytes);
    return ERROR_OK;
}

static int save(void *self, const char *name, const void *data, size_t bytes) {
    struct head head;
    (void)self;
    INVARIANT(name[0] != '\0' && strlen(name) <= HAL_STORE_NAME_MAX);
    if (newest_copy(&head) >= 0 && head.name[0] != '\0' && !holds(&head, name)) {
        return ERROR_FULL;
    }
    return bytes <= COPY_BYTES - sizeof head ? replace(name, data, bytes) : ERROR_FULL;
}

static int remove_record(void *self, const char *name) {
    struct head head;
    (void)self;
    return newest_copy(&head) >= 0 && holds(&head, name) ? replace("", NULL, 0) : ERROR_MISSING;
}

const struct hal_store *bf537_flash_open(const struct rig_observer *waiting) {
    static const struct hal_store_operations operations = {load, save, remove_record};
    static const struct hal_store store = {&operations, NULL};
    observer = *waiting;
    EBIU_AMGCTL |= AMGCTL_ALL_BANKS;
    ssync();
    return &store;
}
