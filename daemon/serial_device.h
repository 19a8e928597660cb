// SPDX-License-Identifier: Apache-2.0
/// Serial lines for terminals and programs.
#ifndef VERGENCE_DAEMON_SERIAL_DEVICE_H
#define VERGENCE_DAEMON_SERIAL_DEVICE_H

#include <stdint.h>

#include "daemon/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Opens a serial line: raw, 8N1, without flow control, not blocking, and not the process's
/// controlling terminal. The descriptor (>= 0), or ERROR_ARGUMENT (no such speed), ERROR_DEVICE (it
/// is no serial line, and nothing was written to it), ERROR_IO, with a message.
int serial_device_open(const char *device, uint32_t baud, struct message *message);

#ifdef __cplusplus
}
#endif

#endif
