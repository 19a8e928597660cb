// SPDX-License-Identifier: Apache-2.0
/// Transfers to the FPGA bridge, with retries and recovery of the bus. This is the only place that
/// does either.
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
    /// Maximum number of attempts per transfer.
    FPGA_BRIDGE_ATTEMPTS = 4,
    /// Longest transfer. The bridge leaves a transfer after 30 ms without a change (TIMEOUT_MS of
    /// fpga/rtl/i2c_target.v), and a master would go on reading ones. A shorter transfer without an
    /// error was therefore received to its end.
    FPGA_BRIDGE_TRANSFER_US = 25000,
    /// Silence after which the bridge has left every transfer (it does so after 31 ms).
    FPGA_BRIDGE_QUIET_US = 32000,
    /// Upper bound of the duration of fpga_bridge_bus_run.
    FPGA_BRIDGE_CALL_US =
        FPGA_BRIDGE_ATTEMPTS * (FPGA_BRIDGE_TRANSFER_US + 2 * FPGA_BRIDGE_QUIET_US + 10000)
};

/// Bus statistics since fpga_bridge_bus_init; all wrap.
struct fpga_bridge_counts {
    uint32_t transfers;    ///< successful transfers
    uint32_t nacks;        ///< these five: attempts that failed
    uint32_t arbitration;  ///< SDA was pulled low by another device
    uint32_t timeouts;
    uint32_t stuck;
    uint32_t verify;        ///< a word did not read back as written
    uint32_t doubts;        ///< reads that the bridge may have left; repeated
    uint32_t repeats;       ///< attempts after the first
    uint32_t recoveries;    ///< attempts to recover the bus
    uint32_t unrecovered;   ///< recoveries that failed
    uint32_t refused;       ///< words that the bridge rejected
    uint32_t other_errors;  ///< errors of the backend
};

/// Bus and address of the bridge. The caller owns bus and clock, which must outlive this.
struct fpga_bridge_bus {
    const struct hal_i2c *bus;
    const struct hal_clock *clock;
    struct fpga_bridge_counts counts;
};

/// One transfer.
struct fpga_bridge_job {
    const struct hal_i2c_message *messages;
    size_t count;
    /// The transfer may be repeated only if at most this many bytes (addresses included) have
    /// begun; SIZE_MAX: always. For words that must not be accepted twice.
    size_t repeatable_bytes;
    /// Index of the byte that the bridge may reject: the low byte of a word, which completes it; 0:
    /// none.
    size_t refusable_byte;
    /// Two bytes within a message that must equal `expected` in the bits of `mask` after the
    /// transfer; NULL: none.
    const uint8_t *read_back;
    uint16_t mask;
    uint16_t expected;
    /// Data of the last message read, 4 bytes or more; NULL: none. Its last word is extra: all ones
    /// there are sent by a bridge that was reset or removed during the transfer. A first word equal
    /// to `lost_index` is sent by a bridge that was reset between index and data. Either may be
    /// real data, so a value that is read twice in succession is accepted.
    const uint8_t *guarded;
    size_t guarded_bytes;
    uint16_t lost_index;
};

/// Stores the pointers and clears the counters. No transfer.
void fpga_bridge_bus_init(struct fpga_bridge_bus *self, const struct hal_i2c *bus,
                          const struct hal_clock *clock);

/// Runs a transfer, with up to FPGA_BRIDGE_ATTEMPTS attempts. Returns 0; ERROR_I2C_NACK,
/// ERROR_I2C_ARBITRATION, ERROR_TIMEOUT, ERROR_I2C_STUCK or ERROR_IO of the last attempt;
/// ERROR_REFUSED: the bridge did not acknowledge the byte that it may reject; ERROR_VERIFY: the
/// word did not read back, or the bridge may have left the transfer; or another error of the
/// backend, at once. After an error the bus is free if that is possible.
int fpga_bridge_bus_run(struct fpga_bridge_bus *self, const struct fpga_bridge_job *job);

#ifdef __cplusplus
}
#endif

#endif
