// SPDX-License-Identifier: Apache-2.0
/// A fake serial line: the calls that a terminal's settings are made with, and bytes both ways.
/// What is not pretended are the ways of a terminal that is not raw.
#ifndef VERGENCE_TESTS_FAKE_SERIAL_H
#define VERGENCE_TESTS_FAKE_SERIAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <termios.h>

enum { FAKE_SERIAL_BYTES = 4096 };

/// A line. What is above the bar is for whoever adds it.
struct fake_serial {
    speed_t speed;  ///< that the other end has
    /// Bytes on their way to the other end.
    void (*send)(const uint8_t *bytes, size_t count);
    /// Looks whether bytes have come, and gives them to fake_serial_receive.
    void (*look)(struct fake_serial *self);
    // ---
    struct termios settings;
    uint8_t received[FAKE_SERIAL_BYTES];
    size_t count;
};

/// Adds the line, as a system leaves it at its start: 38400 bit/s, not raw. The struct is the
/// caller's.
void fake_serial_add(const char *path, struct fake_serial *self);
/// Bytes have come from the other end; those that there is no room for are lost.
void fake_serial_receive(struct fake_serial *self, const uint8_t *bytes, size_t count);

#endif
