// SPDX-License-Identifier: Apache-2.0
/// hal_uart on a Linux terminal: raw, 8 data bits, no parity, one stop bit, no handshake. The line
/// is exclusive: the kernel refuses other users except root (TIOCEXCL), and flock refuses every
/// other program that locks it.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_TERMIOS_UART_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_TERMIOS_UART_H

#include <stdbool.h>

#include "daemon/base/message.h"
#include "hal/uart.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The caller owns it; `hal` points to it, so it must not move.
struct termios_uart {
    struct hal_uart hal;
    int fd;
    bool exclusive;  ///< this object set TIOCEXCL
};

/// Initialises a closed line: its calls return ERROR_DEVICE.
void termios_uart_init(struct termios_uart *self);
/// Opens a line, for example "/dev/ttyUSB0", at 1200 .. 921600 bit/s, and discards pending input.
/// ERROR_DEVICE, ERROR_REFUSED, ERROR_IO, or ERROR_UNSUPPORTED (not a terminal, or not this speed),
/// with a message, and nothing is open.
int termios_uart_open(struct termios_uart *self, const char *path, uint32_t bits_per_s,
                      struct message *message);
void termios_uart_close(struct termios_uart *self);
/// Whether it is open, still the line at this path, and not hung up.
bool termios_uart_is_current(const struct termios_uart *self, const char *path);

#ifdef __cplusplus
}
#endif

#endif
