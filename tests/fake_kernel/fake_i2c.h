// SPDX-License-Identifier: Apache-2.0
/// A fake /dev/i2c-*: devices with 256 registers of 8 bits behind an auto-incremented index.
#ifndef VERGENCE_TESTS_FAKE_I2C_H
#define VERGENCE_TESTS_FAKE_I2C_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// State of the adapter; the test may change it at any time.
struct fake_i2c {
    unsigned long functions;  ///< I2C_FUNC_*
    uint8_t address;          ///< address of the single device; others are not acknowledged (ENXIO)
    uint8_t registers[256];
    unsigned long timeout_10ms;  ///< last value set
    unsigned long retries;
    unsigned transfers;
    int only_messages;  ///< number of messages a transfer claims to have run; -1: all
};

/// Adds the device. The struct belongs to the fake kernel and lives until the next call.
struct fake_i2c *fake_i2c_add(const char *path, uint8_t address);

#ifdef __cplusplus
}
#endif

#endif
