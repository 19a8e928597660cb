// SPDX-License-Identifier: Apache-2.0
/// Registers of the bridge and of the two sensors behind it: by name, or all at once, as recorded
/// in a session with each pair.
#ifndef VERGENCE_RIG_REGISTERS_H
#define VERGENCE_RIG_REGISTERS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

enum registers_device { REGISTERS_BRIDGE, REGISTERS_LEFT, REGISTERS_RIGHT, REGISTERS_DEVICES };

/// Names of the devices at the console, separated by blanks, in the order above.
#define REGISTERS_DEVICE_NAMES "bridge left right"

struct registers_entry {
    const char *name;
    uint8_t index;
};

/// Named registers of a device, by ascending index. Static storage.
const struct registers_entry *registers_entries(enum registers_device device, size_t *count);

/// Whether a register can be read usefully: false for write-only registers.
bool registers_readable(enum registers_device device, uint8_t index);

/// Reads one register. Needs a bridge. Returns an error of the bridge's or the sensor's driver;
/// `last_error` is not changed.
int registers_read(struct rig *rig, enum registers_device device, uint8_t index, uint16_t *value);

enum { REGISTERS_RUN_WORDS = 16, REGISTERS_RUNS_MAX = 24 };

/// Values of registers at consecutive indices.
struct registers_run {
    enum rig_part part;
    uint64_t at_us;  ///< time of reading, on the rig's clock
    uint16_t first, count, values[REGISTERS_RUN_WORDS];
};

struct registers_all {
    size_t count;
    struct registers_run run[REGISTERS_RUNS_MAX];
};

/// Reads all named readable registers, the bridge's first; none if the profile has no bridge. Takes
/// about 15 ms of bus time. Returns ERROR_NOT_READY, or an error of the bus with `last_error` set
/// and the rig made safe.
int registers_read_all(struct rig *rig, struct registers_all *all);

#ifdef __cplusplus
}
#endif

#endif
