// SPDX-License-Identifier: Apache-2.0
/// The two-wire interface as an I2C master.
#ifndef VERGENCE_BF537_TWI_H
#define VERGENCE_BF537_TWI_H

#include "hal/i2c.h"

/// Starts the interface at 100 kHz (or 400 kHz) and returns its I2C bus. Static storage.
const struct hal_i2c *bf537_twi_open(uint32_t speed_hz);

#endif
