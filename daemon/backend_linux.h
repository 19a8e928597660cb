// SPDX-License-Identifier: Apache-2.0
/// The Linux devices of an instrument, as the settings name them. A missing or unplugged device
/// does not keep the daemon from serving: every bring-up looks for it again.
#ifndef VERGENCE_DAEMON_BACKEND_LINUX_H
#define VERGENCE_DAEMON_BACKEND_LINUX_H

#include <stdbool.h>

#include "daemon/backends/linux/gpiod_lines.h"
#include "daemon/backends/linux/i2c_dev.h"
#include "daemon/backends/linux/termios_uart.h"
#include "daemon/backends/linux/v4l2_camera.h"
#include "daemon/settings/config.h"
#include "rig/rig.h"

enum backend_linux_device {
    BACKEND_LINUX_I2C,
    BACKEND_LINUX_LEFT_CAMERA,
    BACKEND_LINUX_RIGHT_CAMERA,
    BACKEND_LINUX_LENS_UART,
    BACKEND_LINUX_GPIO,
    BACKEND_LINUX_DEVICES
};

/// Use static storage; it must not move.
struct backend_linux {
    const struct config *config;
    struct i2c_dev i2c;
    struct v4l2_camera camera[RIG_SIDES];
    struct termios_uart uart;
    struct gpiod_lines lines;
    struct gpiod_line_location locations[HAL_GPIO_LINES];
    struct rig_devices devices;
    bool needed[BACKEND_LINUX_DEVICES];
    struct message missing[BACKEND_LINUX_DEVICES];  ///< why it is not open; "": it is
    struct message identity;  ///< name and bus of the camera that was queried last
    struct message refused;   ///< why an open camera does not start
};

/// Opens the devices that the profile needs and that exist; the others are reported in the log, and
/// by each bring-up. `config` and `log` must outlive it. `*ports` are the rig's.
void backend_linux_open(struct backend_linux *self, const struct config *config,
                        const struct hal_log *log, struct rig_ports *ports);

/// The camera device of a side; NULL: the instrument has none.
const struct v4l2_camera *backend_linux_camera(const struct backend_linux *self, int side);
/// Closes everything; harmless if nothing was opened.
void backend_linux_close(struct backend_linux *self);

#endif
