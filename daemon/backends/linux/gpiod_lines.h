// SPDX-License-Identifier: Apache-2.0
/// hal_gpio on the lines of Linux GPIO chips, through libgpiod 1.6 or 2.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_GPIOD_LINES_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_GPIOD_LINES_H

#include <stdbool.h>

#include "daemon/backends/linux/device_file.h"
#include "daemon/backends/linux/gpiod_shim.h"
#include "daemon/base/message.h"
#include "hal/gpio.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Where a line of the interface is.
struct gpiod_lines_place {
    const char *chip;  ///< "/dev/gpiochip0"; NULL: there is no such line here
    unsigned offset;   ///< on the chip
    bool active_low;
    bool active_at_start;  ///< of an output
};

/// The caller owns it; `hal` points to it, so it must not move.
struct gpiod_lines {
    struct hal_gpio hal;
    struct gpiod_shim *lines[HAL_GPIO_LINES];
    struct device_file_identity chips[HAL_GPIO_LINES];  ///< of those lines
    bool closed;                                        ///< nothing is requested that was to be
    bool gone;                                          ///< the chip has been pulled out
};

/// Makes them lines that are not open: all calls say ERROR_DEVICE.
void gpiod_lines_init(struct gpiod_lines *self);
/// Requests all lines that have a place; outputs get their first level then, and keep their last
/// one when the program ends, as far as the chip does. ERROR_DEVICE, ERROR_REFUSED,
/// ERROR_UNSUPPORTED, ERROR_IO; `message` says more and nothing is requested then.
int gpiod_lines_open(struct gpiod_lines *self, const struct gpiod_lines_place *places,
                     struct message *message);
void gpiod_lines_close(struct gpiod_lines *self);
/// Whether they are requested, their chips are still those of these places, and none has gone as
/// far as their last use tells.
bool gpiod_lines_are_current(const struct gpiod_lines *self,
                             const struct gpiod_lines_place *places);

#ifdef __cplusplus
}
#endif

#endif
