// SPDX-License-Identifier: Apache-2.0
#include "rig/failure.h"

#include "core/error.h"
#include "core/invariant.h"
#include "rig/watch.h"

enum rig_part failure_part(enum rig_part left, unsigned side) {
    INVARIANT(side < RIG_SIDES && (unsigned)left + side < RIG_PARTS);
    return (enum rig_part)((unsigned)left + side);
}

static const char *words_of(int error) {
    switch (error) {
        case ERROR_I2C_NACK:
            return "it does not answer on I2C; look at its supply and its SCL and SDA";
        case ERROR_I2C_STUCK:
        case ERROR_TIMEOUT:
            return "a line of I2C is held low; find by unplugging who holds it, then bring up "
                   "again";
        case ERROR_I2C_ARBITRATION:
            return "something else pulls at I2C; there may be no other master on it";
        case ERROR_VERIFY:
            return "what is written does not read back; look at the I2C cable and its grounds";
        case ERROR_DEVICE:
            return "something else answers in its place, or it has gone; look at what is connected";
        case ERROR_RESTARTED:
            return "it has restarted and lost its settings; look at its supply, then bring up "
                   "again";
        case ERROR_REFUSED:
            return "it refuses a setting; its bitstream and this program do not belong together";
        case ERROR_UNSUPPORTED:
            return "this build of it lacks what a rig needs; load the bitstream for two cameras";
        default:
            return "the system cannot reach its I2C bus; look into the system's log";
    }
}

int failure_of_bus(struct rig *self, enum rig_part part, int error) {
    return watch_failed(self, part, error, words_of(error));
}

int failure_of_bridge(struct rig *self, int error) {
    watch_used(self, RIG_PART_BRIDGE, error);
    return error == ERROR_OK ? ERROR_OK : failure_of_bus(self, RIG_PART_BRIDGE, error);
}

int failure_end(struct rig *self, int error) {
    return self->lost && error != ERROR_OK ? failure_make_safe(self, error) : error;
}

int failure_make_safe(struct rig *self, int error) {
    INVARIANT(error != ERROR_OK);
    const struct rig_trouble first = self->trouble;
    rig_safe(self);
    self->trouble = first;
    return error;
}
