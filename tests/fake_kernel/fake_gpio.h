// SPDX-License-Identifier: Apache-2.0
/// A fake /dev/gpiochip* for libgpiod 1.6 (the kernel's first interface) and 2 (its second),
/// including what they read in /sys.
#ifndef VERGENCE_TESTS_FAKE_GPIO_H
#define VERGENCE_TESTS_FAKE_GPIO_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { FAKE_GPIO_LINES = 8 };

/// A chip. Levels are those on the wire.
struct fake_gpio {
    bool wire[FAKE_GPIO_LINES];
    bool requested[FAKE_GPIO_LINES];  ///< a second request gets EBUSY
    bool is_output[FAKE_GPIO_LINES];
    bool active_low[FAKE_GPIO_LINES];
    char consumer[FAKE_GPIO_LINES][32];
    /// Called when an output is set. NULL: not connected.
    void (*drive)(struct fake_gpio *self, unsigned line);
};

/// Adds the chip, "/dev/gpiochipN". Lives until the next call.
struct fake_gpio *fake_gpio_add(const char *path);

#ifdef __cplusplus
}
#endif

#endif
