// SPDX-License-Identifier: Apache-2.0
/// The two UARTs, 8N1. Received bytes wait in a ring that the interrupt fills; sending waits for
/// the transmitter.
#ifndef VERGENCE_BF537_SERIAL_H
#define VERGENCE_BF537_SERIAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal/uart.h"

enum { BF537_SERIAL_BYTES = 1024, BF537_SERIALS = 2 };

/// Use static storage: the interrupt fills it from bf537_serial_open on.
struct bf537_serial {
    uint32_t uart;                      ///< UART0, UART1
    volatile uint32_t received, taken;  ///< bytes since the start
    volatile uint32_t lost;             ///< overruns: bytes came faster than they were taken
    volatile uint8_t ring[BF537_SERIAL_BYTES];
    struct hal_uart port;
};

void bf537_serial_open(struct bf537_serial *self, uint32_t uart, uint32_t baud);

/// Moves what its UART has received into the ring: for the interrupt.
void bf537_serial_receive(struct bf537_serial *self);

/// Takes up to `capacity` received bytes; returns their number.
size_t bf537_serial_take(struct bf537_serial *self, void *data, size_t capacity);
/// Drops what waits up to the last such byte. False: there is none.
bool bf537_serial_drop_through(struct bf537_serial *self, uint8_t byte);
/// Whether a byte waits.
bool bf537_serial_waits(const struct bf537_serial *self);
void bf537_serial_send(struct bf537_serial *self, const void *data, size_t bytes);

#endif
