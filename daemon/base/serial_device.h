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

/// The termios constant for a speed in bit/s (baud), 1200 to 921600. False: not supported.
bool serial_device_speed(uint32_t bits_per_s, speed_t *speed);

/// Speeds of a console or its client, in baud, for messages: slower ones are of no use there.
#define SERIAL_DEVICE_SPEEDS "9600, 19200, 38400, 57600, 115200, 230400, 460800 and 921600 baud"
/// Whether a speed is one of them.
bool serial_device_has_speed(uint32_t baud);

/// Locks an open line for this process: against programs that opened it before and lock as well
/// (flock), and against later opens (TIOCEXCL; does not stop root). False with errno: EWOULDBLOCK
/// if another program has it.
bool serial_device_claim(int fd);
/// Releases the lock, before closing: if something else keeps the line open (the other end of a
/// pseudo terminal), it would stay locked.
void serial_device_release(int fd);

/// Opens a serial line: raw, 8N1, no flow control, non-blocking, locked, and not the process's
/// controlling terminal. Returns the descriptor (>= 0), for the caller to close with
/// serial_device_close, or with a message ERROR_ARGUMENT (unsupported speed), ERROR_DEVICE (not a
/// serial line; nothing was written to it), ERROR_REFUSED (another program has it), ERROR_IO.
int serial_device_open(const char *device, uint32_t baud, struct message *message);
void serial_device_close(int fd);

#ifdef __cplusplus
}
#endif

#endif
