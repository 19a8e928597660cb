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

/// Location of a line of the interface.
struct gpiod_line_location {
    const char *chip;  ///< "/dev/gpiochip0"; NULL: the line does not exist
    unsigned offset;   ///< number of the line on the chip
    bool active_low;
    bool active_at_start;  ///< initial level of an output
};

/// The caller owns it; `hal` points to it, so it must not move.
struct gpiod_lines {
    struct hal_gpio hal;
    struct gpiod_shim *lines[HAL_GPIO_LINES];
    struct device_file_identity chips[HAL_GPIO_LINES];  ///< identity of each requested line's chip
    bool closed;  ///< the lines were to be requested but are not
    bool gone;    ///< the chip was unplugged
};

/// Initialises closed lines: all calls return ERROR_DEVICE.
void gpiod_lines_init(struct gpiod_lines *self);
/// Requests all lines that have a location. Outputs are set to their initial level, and keep their
/// last level after the program ends if the chip does. Errors: ERROR_DEVICE, ERROR_REFUSED,
/// ERROR_UNSUPPORTED, ERROR_IO, with a message, and nothing is requested.
int gpiod_lines_open(struct gpiod_lines *self, const struct gpiod_line_location *locations,
                     struct message *message);
void gpiod_lines_close(struct gpiod_lines *self);
/// Whether the lines are requested, their chips are still those at these locations, and the last
/// use reported none as gone.
bool gpiod_lines_are_current(const struct gpiod_lines *self,
                             const struct gpiod_line_location *locations);

#ifdef __cplusplus
}
#endif

#endif
