// SPDX-License-Identifier: Apache-2.0
/// An I2C bus, seen from its only master.
///
/// A transfer is a list of messages: START, address, bytes, repeated START, address, ... and one
/// STOP. All of it is plain data, so that a transfer can be recorded, replayed, or sent to another
/// process.
///
/// Backends return 0 or these of core/error.h, and release both lines before they return an error
/// (sources in parentheses: Linux i2c-dev; TWI of a BF537):
///
/// - ERROR_I2C_NACK: an address or a byte was not acknowledged; STOP was sent (ENXIO, EREMOTEIO;
///   ANAK, DNAK)
/// - ERROR_I2C_ARBITRATION: SDA was low while the master released it (EAGAIN; LOSTARB)
/// - ERROR_TIMEOUT: `deadline_us` passed, for example because SCL was held (ETIMEDOUT; a timer)
/// - ERROR_I2C_STUCK: a line was low before START, or did not rise at STOP (EBUSY; BUSBUSY)
/// - ERROR_IO: the transfer failed for another reason (EIO, EPROTO and all others); some adapters
///   return it for a transfer that was lost or corrupted once, so a retry makes sense
/// - ERROR_DEVICE: the adapter is gone (ENODEV, ESHUTDOWN)
///
/// After lost arbitration a backend sends no more clocks, although the standard (UM10204, 3.1.8)
/// allows them up to the end of the byte: they could complete a word that the device then stores. A
/// backend never repeats a transfer (Linux: I2C_RETRIES 0); the caller does.
#ifndef VERGENCE_HAL_I2C_H
#define VERGENCE_HAL_I2C_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/// Limits of one transfer on every backend: a BF537 counts at most 254 bytes.
enum { HAL_I2C_MESSAGES_MAX = 8, HAL_I2C_BYTES_MAX = 254 };

/// One message. `data` belongs to the caller: it is sent, or filled when `read` is set.
struct hal_i2c_message {
    uint8_t *data;
    uint16_t bytes;   ///< 1 .. HAL_I2C_BYTES_MAX
    uint8_t address;  ///< 7 bits
    bool read;
};

/// Lines, as bits.
enum { HAL_I2C_SCL = 1, HAL_I2C_SDA = 2 };

/// What a backend implements; `self` is that of `struct hal_i2c`.
struct hal_i2c_operations {
    /// Runs `count` (1 .. HAL_I2C_MESSAGES_MAX) messages as one transfer, which ends by
    /// `deadline_us` of the system's hal_clock. Data read is undefined after an error. `*begun`
    /// receives the number of bytes, addresses included, of which the bus may have seen a clock:
    /// all bytes if the backend cannot know. A byte that was not acknowledged is the last of them.
    int (*transfer)(void *self, const struct hal_i2c_message *messages, size_t count,
                    uint64_t deadline_us, size_t *begun);
    /// Pulls the lines in `pulled` low, releases the others, and returns at once in `*high` which
    /// lines are high. A TWI does it with its override bits. NULL if the lines are not accessible
    /// (Linux i2c-dev). Returns 0 or an error of the backend.
    int (*lines)(void *self, unsigned pulled, unsigned *high);
};

/// A bus. The backend owns what `self` points to, which must outlive all users.
struct hal_i2c {
    const struct hal_i2c_operations *operations;
    void *self;
};

#endif
