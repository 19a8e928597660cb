// SPDX-License-Identifier: Apache-2.0
#include "bf537/serial.h"

#include <string.h>

#include "bf537/clock.h"
#include "bf537/mmr.h"
#include "core/error.h"

/// Reading the status clears that a byte was lost.
static uint16_t read_status(struct bf537_serial *self) {
    const uint16_t status = UART_LSR(self->uart);
    self->lost += (status & UART_LSR_OE) != 0;
    return status;
}

void bf537_serial_receive(struct bf537_serial *self) {
    while (self->received - self->taken < sizeof self->ring) {
        if ((read_status(self) & UART_LSR_DR) == 0) {
            return;
        }
        self->ring[self->received % sizeof self->ring] = (uint8_t)UART_RBR(self->uart);
        self->received++;
    }
    UART_IER(self->uart) = 0;  // until the ring has room again
}

size_t bf537_serial_take(struct bf537_serial *self, void *data, size_t capacity) {
    uint8_t *to = data;
    size_t bytes = 0;
    while (bytes < capacity && self->taken != self->received) {
        to[bytes++] = self->ring[self->taken % sizeof self->ring];
        self->taken++;
    }
    UART_IER(self->uart) = UART_IER_ERBFI;
    return bytes;
}

/// The ring has room again.
static void drop_until(struct bf537_serial *self, uint32_t at) {
    self->taken = at;
    UART_IER(self->uart) = UART_IER_ERBFI;
}

bool bf537_serial_drop_through(struct bf537_serial *self, uint8_t byte) {
    for (uint32_t at = self->received; at != self->taken; at--) {
        if (self->ring[(at - 1) % sizeof self->ring] == byte) {
            drop_until(self, at);
            return true;
        }
    }
    return false;
}

bool bf537_serial_waits(const struct bf537_serial *self) {
    return self->taken != self->received;
}

void bf537_serial_send(struct bf537_serial *self, const void *data, size_t bytes) {
    const uint8_t *from = data;
    for (size_t i = 0; i < bytes; i++) {
        while ((read_status(self) & UART_LSR_THRE) == 0) {
        }
        UART_THR(self->uart) = from[i];
    }
    ssync();
}

static int write_bytes(void *self, const void *data, size_t bytes, uint64_t deadline_us) {
    (void)deadline_us;  // a transmitter without flow control always ends
    bf537_serial_send(self, data, bytes);
    return ERROR_OK;
}

static int read_bytes(void *context, void *data, size_t capacity, uint64_t deadline_us,
                      size_t *bytes) {
    struct bf537_serial *self = context;
    while (!bf537_serial_waits(self) && bf537_now_us() < deadline_us) {
        bf537_sleep_until_us(deadline_us);
    }
    *bytes = bf537_serial_take(self, data, capacity);
    return *bytes > 0 ? ERROR_OK : ERROR_TIMEOUT;
}

static int discard_bytes(void *context) {
    struct bf537_serial *self = context;
    drop_until(self, self->received);
    return ERROR_OK;
}

void bf537_serial_open(struct bf537_serial *self, uint32_t uart, uint32_t baud) {
    static const struct hal_uart_operations operations = {write_bytes, read_bytes, discard_bytes};
    const uint32_t divisor = (bf537_system_hz() + 8 * baud) / (16 * baud);
    memset(self, 0, sizeof *self);
    self->uart = uart;
    self->port = (struct hal_uart){&operations, self};
    UART_GCTL(uart) = UART_GCTL_UCEN;
    UART_LCR(uart) = UART_LCR_DLAB | UART_LCR_8N1;
    UART_DLL(uart) = (uint16_t)(divisor & 0xFF);
    UART_DLH(uart) = (uint16_t)(divisor >> 8);
    UART_LCR(uart) = UART_LCR_8N1;
    UART_IER(uart) = UART_IER_ERBFI;
    ssync();
}
