// SPDX-License-Identifier: Apache-2.0
/// An I2C bus as its one master sees it.
///
/// A transfer is a list of messages: START, address, bytes, repeated START, address, ... and one
/// STOP. All of it is plain data, so that a transfer can be recorded, replayed, or sent to another
/// process.
///
/// Backends return 0 or these of core/error.h, and let both lines go before they return an error
/// (in parentheses: where it comes from with Linux i2c-dev; with the TWI of a BF537):
///
/// - ERROR_I2C_NACK: an address or a byte was not acknowledged; STOP was sent
///   (ENXIO, EREMOTEIO; ANAK, DNAK)
/// - ERROR_I2C_ARBITRATION: SDA was low where the master let it go (EAGAIN; LOSTARB)
/// - ERROR_TIMEOUT: `deadline_us` passed, for example because SCL was held (ETIMEDOUT; a timer)
/// - ERROR_I2C_STUCK: a line was low before START, or did not come up at STOP (EBUSY; BUSBUSY)
/// - ERROR_IO: the transfer failed, and the system says no more (EIO, EPROTO and all others): with
///   some adapters that is a transfer lost or corrupted once, so it is worth another try
/// - ERROR_DEVICE: the adapter has gone (ENODEV, ESHUTDOWN)
///
/// After lost arbitration a backend sends no more clocks, although the standard (UM10204, 3.1.8)
/// allows them up to the end of the byte: they could complete a word that the device takes.
/// A backend never repeats a transfer by itself (Linux: I2C_RETRIES 0): its user does.
#ifndef VERGENCE_HAL_I2C_H
#define VERGENCE_HAL_I2C_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/// What every backend can do in one transfer: 254 bytes are the most that a BF537 counts.
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
    /// Runs `count` (1 .. HAL_I2C_MESSAGES_MAX) messages as one transfer, which is over by
    /// `deadline_us` of the system's hal_clock. A read's data is undefined after an error.
    /// `*begun` receives the number of bytes, addresses included, of which the bus may have seen a
    /// clock: of all messages when the backend cannot tell. Not acknowledged was the last of them.
    int (*transfer)(void *self, const struct hal_i2c_message *messages, size_t count,
                    uint64_t deadline_us, size_t *begun);
    /// Pulls the lines in `pulled` low, lets the others go, and says at once in `*high` which wires
    /// are high. A TWI does it by its override bits. NULL where the lines cannot be reached
    /// (Linux i2c-dev). Returns 0 or an error of the backend.
    int (*lines)(void *self, unsigned pulled, unsigned *high);
};

/// A bus. The backend owns what `self` points to, which must outlive all users.
struct hal_i2c {
    const struct hal_i2c_operations *operations;
    void *self;
};

#endif
