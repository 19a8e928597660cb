// SPDX-License-Identifier: Apache-2.0
/// Serial lines for terminals and programs.
#ifndef VERGENCE_DAEMON_BASE_SERIAL_DEVICE_H
#define VERGENCE_DAEMON_BASE_SERIAL_DEVICE_H

#include <stdbool.h>
#include <stdint.h>
#include <termios.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What termios calls a speed in bit/s (baud), 1200 to 921600. False: no line has it.
bool serial_device_speed(uint32_t bits_per_s, speed_t *speed);

/// The speeds of a console or its client, in baud, for people: slower ones are of no use there.
#define SERIAL_DEVICE_SPEEDS "9600, 19200, 38400, 57600, 115200, 230400, 460800 and 921600 baud"
/// Whether a speed is one of them.
bool serial_device_has_speed(uint32_t baud);

/// Makes an open line ours alone: against programs that were there before and lock as well (flock),
/// and against those that come later (TIOCEXCL; the kernel refuses them, but not root's). False,
/// and errno says why not: EWOULDBLOCK, another program has it.
bool serial_device_claim(int fd);
/// Gives it back, before it is closed: where something else keeps the line open (the other end of a
/// pseudo terminal) it would stay refused.
void serial_device_release(int fd);

/// Opens a serial line: raw, 8N1, without flow control, not blocking, and not the process's
/// controlling terminal; nobody else has it meanwhile. The descriptor (>= 0), for the caller to
/// close with serial_device_close, or ERROR_ARGUMENT (no such speed), ERROR_DEVICE (it is no serial
/// line, and nothing was written to it), ERROR_REFUSED (another program has it), ERROR_IO, with a
/// message.
int serial_device_open(const char *device, uint32_t baud, struct message *message);
void serial_device_close(int fd);

#ifdef __cplusplus
}
#endif

#endif
