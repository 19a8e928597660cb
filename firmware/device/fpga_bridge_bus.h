// SPDX-License-Identifier: Apache-2.0
/// Transfers to the FPGA bridge that either succeed or say why not: the one place where they are
/// repeated, and where the bus is recovered.
#ifndef VERGENCE_DEVICE_FPGA_BRIDGE_BUS_H
#define VERGENCE_DEVICE_FPGA_BRIDGE_BUS_H

#include <stddef.h>
#include <stdint.h>

#include "hal/clock.h"
#include "hal/i2c.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    /// How often a transfer is tried.
    FPGA_BRIDGE_ATTEMPTS = 4,
    /// Longest transfer. The bridge leaves a transfer after 30 ms without a move (TIMEOUT_MS of
    /// fpga/rtl/i2c_target.v) and a master would go on reading ones: below that, a transfer without
    /// an error was heard to its end.
    FPGA_BRIDGE_TRANSFER_US = 25000,
    /// Silence after which the bridge has left every transfer, which it does after 31 ms.
    FPGA_BRIDGE_QUIET_US = 32000,
    /// No call of fpga_bridge_bus_run takes longer.
    FPGA_BRIDGE_CALL_US =
        FPGA_BRIDGE_ATTEMPTS * (FPGA_BRIDGE_TRANSFER_US + 2 * FPGA_BRIDGE_QUIET_US + 10000)
};

/// What happened on the bus since fpga_bridge_bus_init; all wrap.
struct fpga_bridge_counts {
    uint32_t transfers;    ///< that succeeded
    uint32_t nacks;        ///< these five: attempts that failed
    uint32_t arbitration;  ///< SDA was pulled by something else
    uint32_t timeouts;
    uint32_t stuck;
    uint32_t verify;        ///< a word did not read back as written
    uint32_t doubts;        ///< reads that look as if the bridge had left them; read again
    uint32_t repeats;       ///< attempts after the first
    uint32_t recoveries;    ///< of the bus
    uint32_t unrecovered;   ///< recoveries that failed
    uint32_t refused;       ///< words that the bridge did not take
    uint32_t other_errors;  ///< of the backend
};

/// Where the bridge is. The caller owns bus and clock, which must outlive this.
struct fpga_bridge_bus {
    const struct hal_i2c *bus;
    const struct hal_clock *clock;
    struct fpga_bridge_counts counts;
};

/// One transfer.
struct fpga_bridge_job {
    const struct hal_i2c_message *messages;
    size_t count;
    /// It may be tried again while at most so many bytes (addresses included) have begun; SIZE_MAX:
    /// always. For words whose taking has a second effect when it comes twice.
    size_t repeatable_bytes;
    /// Number of the byte that may be refused: the low byte of a word, which completes it; 0: none.
    size_t refusable_byte;
    /// Two bytes, within a message, that must show `expected` in the bits of `mask` when the
    /// transfer is over; NULL: none.
    const uint8_t *read_back;
    uint16_t mask;
    uint16_t expected;
    /// What the last message reads, 4 bytes or more; NULL: nothing. Its last word is not wanted:
    /// all ones there are what a bridge leaves that was reset or has gone in the middle. A first
    /// word that is `lost_index` is what a bridge sends that was reset between index and data.
    /// Either may be true all the same, so what is so twice in succession is taken.
    const uint8_t *guarded;
    size_t guarded_bytes;
    uint16_t lost_index;
};

/// Stores the pointers, clears the counts. No transfer.
void fpga_bridge_bus_init(struct fpga_bridge_bus *self, const struct hal_i2c *bus,
                          const struct hal_clock *clock);

/// Runs a transfer, up to FPGA_BRIDGE_ATTEMPTS times. 0; ERROR_I2C_NACK, ERROR_I2C_ARBITRATION,
/// ERROR_TIMEOUT, ERROR_I2C_STUCK or ERROR_IO of the last attempt; ERROR_REFUSED: the bridge did
/// not acknowledge the refusable byte; ERROR_VERIFY: the word did not read back, or the bridge may
/// have left the transfer; or another error of the backend, at once. After an error the bus is free
/// as far as that is possible.
int fpga_bridge_bus_run(struct fpga_bridge_bus *self, const struct fpga_bridge_job *job);

#ifdef __cplusplus
}
#endif

#endif
