// SPDX-License-Identifier: Apache-2.0
/// The registers of the bridge and of the two sensors behind it: by name, and all at once, as they
/// go into a session beside each pair.
#ifndef VERGENCE_RIG_REGISTERS_H
#define VERGENCE_RIG_REGISTERS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

enum registers_place { REGISTERS_BRIDGE, REGISTERS_LEFT, REGISTERS_RIGHT, REGISTERS_PLACES };

/// The places as the console calls them, separated by blanks, in the order above.
#define REGISTERS_PLACE_NAMES "bridge left right"

struct registers_entry {
    const char *name;
    uint8_t index;
};

/// Those of a place that have a name, by ascending index. Static storage.
const struct registers_entry *registers_entries(enum registers_place place, size_t *count);

/// Whether reading tells something: not of registers that only take writes.
bool registers_readable(enum registers_place place, uint8_t index);

/// Reads one. Needs a bridge. Errors of its driver or the sensor's; `trouble` is not touched.
int registers_read(struct rig *rig, enum registers_place place, uint8_t index, uint16_t *value);

enum { REGISTERS_RUN_WORDS = 16, REGISTERS_RUNS_MAX = 24 };

/// Registers at consecutive indices.
struct registers_run {
    enum rig_part part;
    uint64_t at_us;  ///< when they were read, of the rig's clock
    uint16_t first, count, values[REGISTERS_RUN_WORDS];
};

struct registers_all {
    size_t count;
    struct registers_run run[REGISTERS_RUNS_MAX];
};

/// Reads all that has a name and can be read, the bridge's first; none where the profile has no
/// bridge. Takes some 15 ms of the bus. ERROR_NOT_READY; else an error of the bus, which `trouble`
/// names, and the rig is safe then.
int registers_read_all(struct rig *rig, struct registers_all *all);

#ifdef __cplusplus
}
#endif

#endif
