// SPDX-License-Identifier: Apache-2.0
/// GPIO lines of the processor, named by purpose. Levels are logical: 1 is active, whatever the
/// polarity of the wire.
///
/// Backends return 0 or these of core/error.h: ERROR_UNSUPPORTED: no such line;
/// ERROR_DEVICE: the chip is gone; ERROR_IO: any other error of the system.
#ifndef VERGENCE_HAL_GPIO_H
#define VERGENCE_HAL_GPIO_H

#include <stdbool.h>

enum hal_gpio_line {
    HAL_GPIO_BRIDGE_RESET,  ///< output
    HAL_GPIO_BRIDGE_IRQ,    ///< input
    HAL_GPIO_LENS_POWER,    ///< output
    HAL_GPIO_TRIGGER,       ///< output: cameras begin to expose when it goes active
    HAL_GPIO_LINES
};

/// What a backend implements; `self` is that of `struct hal_gpio`.
struct hal_gpio_operations {
    int (*set)(void *self, enum hal_gpio_line line, bool active);
    int (*get)(void *self, enum hal_gpio_line line, bool *active);
};

/// The lines. The backend owns what `self` points to, which must outlive all users.
struct hal_gpio {
    const struct hal_gpio_operations *operations;
    void *self;
};

#endif
