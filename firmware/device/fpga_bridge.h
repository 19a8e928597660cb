// SPDX-License-Identifier: Apache-2.0
/// The FPGA bridge's registers over I2C. Which there are, what their bits do and which values they
/// take comes from fpga/generated/bridge_registers.h, so from fpga/registers.rdl, alone.
///
/// Each write is read back in the same transfer wherever the map says that it can be. A read takes
/// one word more than asked for, which shows whether the bridge was there to its end. What neither
/// finds is a wrong bit in data that is read, or in an index: I2C has no checksum. When the counts
/// of the bus grow (`verify` above all), words may have gone to other registers.
/// What a value means to the instrument is in fpga_bridge_servo.h, _camera.h, _sensor.h, _event.h.
///
/// Errors of all functions that use the bus, outputs being untouched then: those of
/// fpga_bridge_bus_run; ERROR_ARGUMENT: no such register, or it cannot do that; ERROR_RANGE: the
/// value is outside the register's range or has bits that it does not store (nothing was sent).
/// All take at most FPGA_BRIDGE_CALL_US for each transfer that they mention.
#ifndef VERGENCE_DEVICE_FPGA_BRIDGE_H
#define VERGENCE_DEVICE_FPGA_BRIDGE_H

#include <stdbool.h>

#include "bridge_registers.h"
#include "device/fpga_bridge_bus.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { FPGA_BRIDGE_BLOCK_WORDS = 8 };

/// A bridge. The caller owns it; one thread at a time uses it.
struct fpga_bridge {
    struct fpga_bridge_bus bus;
    uint16_t version;  ///< major.minor, as read by fpga_bridge_open; so are the next two
    uint16_t build;
    uint16_t caps;   ///< BRIDGE_CAPS_*
    bool marked;     ///< SCRATCH was given a mark: see fpga_bridge_watchdog_feed
    bool restarted;  ///< found by it, and not yet told
};

/// A field of a register.
struct fpga_bridge_field {
    uint8_t index;
    uint8_t shift;
    uint16_t mask;
};

/// The field of a register, by their names in the map: FPGA_BRIDGE_FIELD(CAM_STATE, ACTIVE).
#define FPGA_BRIDGE_FIELD(REGISTER, FIELD)                                    \
    ((struct fpga_bridge_field){(uint8_t)BRIDGE_##REGISTER,                   \
                                (uint8_t)BRIDGE_##REGISTER##_##FIELD##_SHIFT, \
                                (uint16_t)BRIDGE_##REGISTER##_##FIELD##_MASK})

/// Finds the bridge and reads what it is (one transfer, writes nothing). ERROR_I2C_NACK: nobody
/// answers. ERROR_DEVICE: something else does, or a bridge whose map differs in its major version
/// or is older than the one that this was built with. The pointers must outlive the bridge.
int fpga_bridge_open(struct fpga_bridge *self, const struct hal_i2c *bus,
                     const struct hal_clock *clock);

/// ERROR_UNSUPPORTED unless this build of the bridge has all of `caps` (BRIDGE_CAPS_*_MASK).
int fpga_bridge_need(const struct fpga_bridge *self, uint16_t caps);

/// The map's row of an index; NULL: no such register.
const struct bridge_register *fpga_bridge_register(uint8_t index);

/// Reads a word.
int fpga_bridge_read(struct fpga_bridge *self, uint8_t index, uint16_t *value);

/// Reads `count` (1 .. FPGA_BRIDGE_BLOCK_WORDS) words at consecutive indices in one transfer; a
/// block that the bridge holds (BRIDGE_HOLDS_BLOCK) then shows one moment. Gaps read 0.
int fpga_bridge_read_block(struct fpga_bridge *self, uint8_t index, size_t count, uint16_t *values);

/// Reads 32 bits of one moment; `index` is that of the high word.
int fpga_bridge_read_pair(struct fpga_bridge *self, uint8_t index, uint32_t *value);

/// Writes the stored bits of a register; bits that clear or start something are left alone.
/// ERROR_REFUSED: the bridge did not take it: locked, or a code without a name.
int fpga_bridge_write(struct fpga_bridge *self, uint8_t index, uint16_t value);

/// Writes `value` to the bits of `mask` only (two transfers).
int fpga_bridge_update(struct fpga_bridge *self, uint8_t index, uint16_t mask, uint16_t value);

/// Reads or writes a field, its value being shifted down to bit 0.
int fpga_bridge_read_field(struct fpga_bridge *self, struct fpga_bridge_field field,
                           uint16_t *value);
int fpga_bridge_write_field(struct fpga_bridge *self, struct fpga_bridge_field field,
                            uint16_t value);

/// Clears the bits that are set in `bits` (write 1 to clear), and no others; stored bits of the
/// register stay as they are. Not repeated once the bridge may have taken it, since an event that
/// came meanwhile would be lost: after an error the bits may or may not be cleared.
int fpga_bridge_clear(struct fpga_bridge *self, uint8_t index, uint16_t bits);

/// Clears a counter that any write clears. As fpga_bridge_clear.
int fpga_bridge_clear_count(struct fpga_bridge *self, uint8_t index);

/// Writes ones that start something. Never sent twice: after an error it may or may not have begun.
int fpga_bridge_start(struct fpga_bridge *self, uint8_t index, uint16_t bits);

/// Reads a word after a write that changes and starts nothing, but shows the bridge's watchdog that
/// the DSP is alive.
int fpga_bridge_touch(struct fpga_bridge *self, uint8_t index, uint16_t *value);

/// Writes a register that is locked, or a value that is only allowed when unlocked (three
/// transfers). The map is locked again in any case; if that fails, that is the error.
int fpga_bridge_write_unlocked(struct fpga_bridge *self, uint8_t index, uint16_t value);

/// All registers back to their reset values, and limits locked (two transfers). As
/// fpga_bridge_start: after an error the bridge may or may not have been reset. ERROR_VERIFY: CTRL
/// does not show it.
int fpga_bridge_soft_reset(struct fpga_bridge *self);

#ifdef __cplusplus
}
#endif

#endif
