// SPDX-License-Identifier: Apache-2.0
#include "rig/failure.h"

#include "core/error.h"
#include "core/invariant.h"
#include "rig/watch.h"

enum rig_part failure_part(enum rig_part left, unsigned side) {
    INVARIANT(side < RIG_SIDES && (unsigned)left + side < RIG_PARTS);
    return (enum rig_part)((unsigned)left + side);
}

const char *rig_part_text(enum rig_part part) {
    static const char *const texts[RIG_PARTS] = {
#define RIG_PART_TEXT(name, text) text,
        RIG_PART_LIST(RIG_PART_TEXT)
#undef RIG_PART_TEXT
    };
    INVARIANT((unsigned)part < RIG_PARTS);
    return texts[part];
}

static const char *words_of(int error) {
    switch (error) {
        case ERROR_I2C_NACK:
            return "no answer on I2C (check its supply, SCL and SDA)";
        case ERROR_I2C_STUCK:
        case ERROR_TIMEOUT:
            return "I2C bus stuck low (unplug devices one by one to find the culprit, then run "
                   "bringup)";
        case ERROR_I2C_ARBITRATION:
            return "I2C arbitration lost (remove any other master from the bus)";
        case ERROR_VERIFY:
            return "a written value does not read back (check the I2C cable and its grounds)";
        case ERROR_DEVICE:
            return "missing, or another device responds at its address (check what is connected)";
        case ERROR_RESTARTED:
            return "it has restarted and lost its settings (check its supply, then run bringup)";
        case ERROR_REFUSED:
            return "it rejects a setting (bitstream and program versions do not match)";
        case ERROR_UNSUPPORTED:
            return "its bitstream does not support a rig (load the bitstream for two cameras)";
        default:
            return "its I2C bus cannot be reached (see the system log)";
    }
}

int failure_of_bus(struct rig *self, enum rig_part part, int error) {
    return watch_failed(self, part, error, words_of(error));
}

int failure_of_bridge(struct rig *self, int error) {
    watch_used(self, RIG_PART_BRIDGE, error);
    return error == ERROR_OK ? ERROR_OK : failure_of_bus(self, RIG_PART_BRIDGE, error);
}
