// SPDX-License-Identifier: Apache-2.0
/// hal_uart on a Linux terminal: raw, 8 data bits, no parity, one stop bit, no handshake. Nobody
/// else can have the line meanwhile: the kernel refuses all but root (TIOCEXCL), and who locks it
/// as we do (flock) is refused in any case.
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
    bool exclusive;  ///< by our own TIOCEXCL
};

/// Makes it one that is not open: its calls say ERROR_DEVICE.
void termios_uart_init(struct termios_uart *self);
/// Opens a line, for example "/dev/ttyUSB0", at 1200 .. 921600 bit/s; what had come before is
/// forgotten. ERROR_DEVICE, ERROR_REFUSED, ERROR_IO, or ERROR_UNSUPPORTED: no terminal, or not at
/// this speed. `message` says more; nothing is open then.
int termios_uart_open(struct termios_uart *self, const char *path, uint32_t bits_per_s,
                      struct message *message);
void termios_uart_close(struct termios_uart *self);
/// Whether it is open, still the line of this path, and nothing has hung it up.
bool termios_uart_is_current(const struct termios_uart *self, const char *path);

#ifdef __cplusplus
}
#endif

#endif
