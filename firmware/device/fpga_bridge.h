// SPDX-License-Identifier: Apache-2.0
/// Registers of the FPGA bridge over I2C. Registers, bits and accepted values come from
/// fpga/generated/bridge_registers.h only, which is generated from fpga/registers.rdl.
///
/// Each write is read back in the same transfer wherever the register map allows that. A read takes
/// one extra word, which shows whether the bridge was still in the transfer. Neither detects a
/// wrong bit in data that is read, or in an index, as I2C has no checksum. If the error counters of
/// the bus grow (`verify` above all), words may have gone to other registers. For the meaning of
/// values see fpga_bridge_servo.h, _camera.h, _sensor.h, _event.h.
///
/// Errors of all functions that use the bus (outputs are then unchanged): those of
/// fpga_bridge_bus_run; ERROR_ARGUMENT: no such register, or the access is not supported;
/// ERROR_RANGE: the value is outside the register's range or has bits that it does not store
/// (nothing was sent). Each takes at most FPGA_BRIDGE_CALL_US per documented transfer.
#ifndef VERGENCE_DEVICE_FPGA_BRIDGE_H
#define VERGENCE_DEVICE_FPGA_BRIDGE_H

#include <stdbool.h>

#include "bridge_registers.h"
#include "device/fpga_bridge_bus.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { FPGA_BRIDGE_BLOCK_WORDS = 8 };

/// A bridge. Owned by the caller, and used by one thread at a time.
struct fpga_bridge {
    struct fpga_bridge_bus bus;
    uint16_t version;  ///< major.minor, as read by fpga_bridge_open, as are the next two
    uint16_t build;
    uint16_t caps;   ///< BRIDGE_CAPS_*
    bool marked;     ///< SCRATCH holds a mark: see fpga_bridge_watchdog_feed
    bool restarted;  ///< detected by it, and not yet reported
};

/// A field of a register.
struct fpga_bridge_field {
    uint8_t index;
    uint8_t shift;
    uint16_t mask;
};

/// A field of a register, by its names in the map: FPGA_BRIDGE_FIELD(CAM_STATE, ACTIVE).
#define FPGA_BRIDGE_FIELD(REGISTER, FIELD)                                    \
    ((struct fpga_bridge_field){(uint8_t)BRIDGE_##REGISTER,                   \
                                (uint8_t)BRIDGE_##REGISTER##_##FIELD##_SHIFT, \
                                (uint16_t)BRIDGE_##REGISTER##_##FIELD##_MASK})

/// Finds the bridge and reads its identity (one transfer, no writes). ERROR_I2C_NACK: no answer.
/// ERROR_DEVICE: another device, or a bridge whose register map has another major version or is
/// older than that of this program. The pointers must outlive the bridge.
int fpga_bridge_open(struct fpga_bridge *self, const struct hal_i2c *bus,
                     const struct hal_clock *clock);

/// ERROR_UNSUPPORTED unless this bitstream has all of `caps` (BRIDGE_CAPS_*_MASK).
int fpga_bridge_need(const struct fpga_bridge *self, uint16_t caps);

/// The map's entry of an index; NULL: no such register.
const struct bridge_register *fpga_bridge_register(uint8_t index);

/// Reads a word.
int fpga_bridge_read(struct fpga_bridge *self, uint8_t index, uint16_t *value);

/// Reads `count` (1 .. FPGA_BRIDGE_BLOCK_WORDS) words at consecutive indices in one transfer; the
/// words of a block that the bridge latches (BRIDGE_HOLDS_BLOCK) are from the same moment. Gaps
/// read 0.
int fpga_bridge_read_block(struct fpga_bridge *self, uint8_t index, size_t count, uint16_t *values);

/// Writes the stored bits of a register; bits that clear or start something are not set.
/// ERROR_REFUSED: rejected by the bridge, because it is locked or the code is not defined.
int fpga_bridge_write(struct fpga_bridge *self, uint8_t index, uint16_t value);

/// Writes `value` to the bits of `mask` only (two transfers).
int fpga_bridge_update(struct fpga_bridge *self, uint8_t index, uint16_t mask, uint16_t value);

/// Reads or writes a field; its value is shifted down to bit 0.
int fpga_bridge_read_field(struct fpga_bridge *self, struct fpga_bridge_field field,
                           uint16_t *value);
int fpga_bridge_write_field(struct fpga_bridge *self, struct fpga_bridge_field field,
                            uint16_t value);

/// Clears the bits set in `bits` (write 1 to clear), and no others; stored bits of the register do
/// not change. Not repeated if the bridge may have accepted it, as a new event would be lost: after
/// an error the bits may or may not be cleared.
int fpga_bridge_clear(struct fpga_bridge *self, uint8_t index, uint16_t bits);

/// Writes ones that start an action. Never sent twice: after an error it may or may not have
/// started.
int fpga_bridge_start(struct fpga_bridge *self, uint8_t index, uint16_t bits);

/// Reads a word after a write that changes nothing, but feeds the bridge's watchdog.
int fpga_bridge_touch(struct fpga_bridge *self, uint8_t index, uint16_t *value);

/// Writes a locked register, or a value that is only allowed when unlocked (three transfers). The
/// map is always locked again; if that fails, its error is returned.
int fpga_bridge_write_unlocked(struct fpga_bridge *self, uint8_t index, uint16_t value);

/// Resets all registers and locks the limits (two transfers). As fpga_bridge_start: after an error
/// the bridge may or may not have been reset. ERROR_VERIFY: CTRL does not show it.
int fpga_bridge_soft_reset(struct fpga_bridge *self);

#ifdef __cplusplus
}
#endif

#endif
