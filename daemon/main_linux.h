// SPDX-License-Identifier: Apache-2.0
/// The devices of Linux that an instrument hangs on, as the settings name them. One that is not
/// there, or that has been pulled out, keeps nobody from serving: every bring-up looks again.
#ifndef VERGENCE_DAEMON_MAIN_LINUX_H
#define VERGENCE_DAEMON_MAIN_LINUX_H

#include <stdbool.h>

#include "console/command.h"
#include "daemon/backends/linux/gpiod_lines.h"
#include "daemon/backends/linux/i2c_dev.h"
#include "daemon/backends/linux/termios_uart.h"
#include "daemon/backends/linux/v4l2_camera.h"
#include "daemon/settings/config.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

enum main_linux_device {
    MAIN_LINUX_I2C,
    MAIN_LINUX_LEFT_CAMERA,
    MAIN_LINUX_RIGHT_CAMERA,
    MAIN_LINUX_LENS_UART,
    MAIN_LINUX_GPIO,
    MAIN_LINUX_DEVICES
};

/// Static storage; it must not move.
struct main_linux {
    const struct config *config;
    struct i2c_dev i2c;
    struct v4l2_camera camera[RIG_SIDES];
    struct termios_uart uart;
    struct gpiod_lines lines;
    struct gpiod_lines_place places[HAL_GPIO_LINES];
    struct rig_opener opener;
    bool needed[MAIN_LINUX_DEVICES];
    struct message missing[MAIN_LINUX_DEVICES];  ///< why it is not open; "": it is
    struct message identity;                     ///< of the camera that was asked about last
    struct message refused;                      ///< why a camera that is open does not start
};

/// Opens what the profile needs and is there; the others are told to the log, and by the bring-up.
/// `config` and `log` must outlive it. `*ports` are the rig's.
void main_linux_open(struct main_linux *self, const struct config *config,
                     const struct hal_log *log, struct rig_ports *ports);

/// Tells of the cameras that are open: what their drivers say of them, and what they stream. From
/// the thread that has the rig.
void main_linux_put(const struct main_linux *self, const struct command_call *call);
/// Closes everything; harmless when nothing was opened.
void main_linux_close(struct main_linux *self);

#ifdef __cplusplus
}
#endif

#endif
