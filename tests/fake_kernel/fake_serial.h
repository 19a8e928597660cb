// SPDX-License-Identifier: Apache-2.0
/// A fake serial line: the calls for terminal settings, and bytes both ways. Only raw mode is
/// emulated.
#ifndef VERGENCE_TESTS_FAKE_SERIAL_H
#define VERGENCE_TESTS_FAKE_SERIAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <termios.h>

enum { FAKE_SERIAL_BYTES = 4096 };

/// A line. The user sets the fields above the bar.
struct fake_serial {
    speed_t speed;  ///< of the other end
    /// Sends bytes to the other end.
    void (*send)(const uint8_t *bytes, size_t count);
    /// Passes newly arrived bytes to fake_serial_receive.
    void (*look)(struct fake_serial *self);
    // ---
    struct termios settings;
    uint8_t received[FAKE_SERIAL_BYTES];
    size_t count;
};

/// Adds the line in a system's initial state: 38400 bit/s, not raw. The caller owns the struct.
void fake_serial_add(const char *path, struct fake_serial *self);
/// Adds bytes from the other end; bytes that do not fit are lost.
void fake_serial_receive(struct fake_serial *self, const uint8_t *bytes, size_t count);

#endif
