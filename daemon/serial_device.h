// SPDX-License-Identifier: Apache-2.0
/// Serial lines for terminals and programs.
#ifndef VERGENCE_DAEMON_SERIAL_DEVICE_H
#define VERGENCE_DAEMON_SERIAL_DEVICE_H

#include <stdbool.h>
#include <stdint.h>

#include "daemon/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The speeds that there are, in baud, for people.
#define SERIAL_DEVICE_SPEEDS "9600, 19200, 38400, 57600, 115200, 230400, 460800 and 921600 baud"
/// Whether a speed is one of them.
bool serial_device_has_speed(uint32_t baud);

/// Opens a serial line: raw, 8N1, without flow control, not blocking, and not the process's
/// controlling terminal. The descriptor (>= 0), or ERROR_ARGUMENT (no such speed), ERROR_DEVICE (it
/// is no serial line, and nothing was written to it), ERROR_IO, with a message.
int serial_device_open(const char *device, uint32_t baud, struct message *message);

#ifdef __cplusplus
}
#endif

#endif
