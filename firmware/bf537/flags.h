// SPDX-License-Identifier: Apache-2.0
/// The pins: the bridge's interrupt (PG10, high: active) and reset (PG11, low: active) as flags,
/// and those of the UARTs and the PPI, which get theirs.
#ifndef VERGENCE_BF537_FLAGS_H
#define VERGENCE_BF537_FLAGS_H

#include "hal/gpio.h"

/// Sets up the pins, the reset inactive. Static storage.
const struct hal_gpio *bf537_flags_open(void);

#endif
