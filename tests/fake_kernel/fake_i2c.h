// SPDX-License-Identifier: Apache-2.0
/// A fake /dev/i2c-*: devices with 256 registers of 8 bits behind an index that counts on.
#ifndef VERGENCE_TESTS_FAKE_I2C_H
#define VERGENCE_TESTS_FAKE_I2C_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct i2c_rdwr_ioctl_data;

/// What the adapter says and has. Changed by the test at any time.
struct fake_i2c {
    unsigned long functions;  ///< I2C_FUNC_*
    uint8_t address;          ///< of the one device; others are not acknowledged (ENXIO)
    uint8_t registers[256];
    unsigned long timeout_10ms;  ///< as it was set
    unsigned long retries;
    unsigned transfers;
    int only_messages;  ///< a transfer claims to have run so many messages; -1: all
    /// What carries out I2C_RDWR in place of the one device, with its result. NULL: nothing else.
    int (*transfer)(struct fake_i2c *self, const struct i2c_rdwr_ioctl_data *data);
};

/// Adds the device. The struct belongs to the fake kernel and lives until the next call.
struct fake_i2c *fake_i2c_add(const char *path, uint8_t address);

#ifdef __cplusplus
}
#endif

#endif
