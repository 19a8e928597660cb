// SPDX-License-Identifier: Apache-2.0
// Hardware Reference chapter 11. A message is one count of bytes; between two messages the
// interface holds the bus in a repeated start until it has the next address and direction.
#include "bf537/twi.h"

#include "bf537/clock.h"
#include "bf537/mmr.h"
#include "core/error.h"

enum {
    TIME_UNIT_HZ = 10000000,  // of CLKDIV
    FAST_HZ = 400000,
    POLL_US = 40,  // half a byte at 100 kHz; the transmitter holds two
};

static uint16_t speed_bits;

static int error_of(uint16_t status) {
    if ((status & TWI_STAT_LOST) != 0) {
        return ERROR_I2C_ARBITRATION;
    }
    return (status & (TWI_STAT_NACK_ADDRESS | TWI_STAT_NACK_DATA)) != 0 ? ERROR_I2C_NACK : ERROR_IO;
}

/// Fills the transmitter and empties the receiver as far as they allow.
static void move_bytes(const struct hal_i2c_message *message, size_t *moved) {
    while (!message->read && *moved < message->bytes &&
           (TWI_FIFO_STAT & TWI_FIFO_TRANSMIT_FULL) != TWI_FIFO_TRANSMIT_FULL) {
        TWI_XMT_DATA8 = message->data[(*moved)++];
    }
    while (message->read && *moved < message->bytes && (TWI_FIFO_STAT & TWI_FIFO_RECEIVED) != 0) {
        message->data[(*moved)++] = (uint8_t)TWI_RCV_DATA8;
    }
}

/// Runs a message to its end. `restart`: another one follows.
static int run_message(const struct hal_i2c_message *message, bool restart, uint64_t deadline_us,
                       size_t *begun) {
    size_t moved = 0;
    TWI_INT_STAT = TWI_INT_COMPLETE | TWI_INT_ERROR | TWI_INT_TRANSMIT | TWI_INT_RECEIVE;
    TWI_MASTER_STAT = TWI_STAT_ERRORS;
    TWI_MASTER_ADDR = message->address;
    move_bytes(message, &moved);
    TWI_MASTER_CTL =
        (uint16_t)(speed_bits | TWI_MASTER_ENABLE | message->bytes * TWI_MASTER_COUNT |
                   (message->read ? TWI_MASTER_RECEIVE : 0) | (restart ? TWI_MASTER_RESTART : 0));
    ssync();
    for (;;) {
        const uint16_t events = TWI_INT_STAT;
        if ((events & TWI_INT_ERROR) != 0) {
            const uint16_t status = TWI_MASTER_STAT;
            // Up to two of the bytes moved may still be in the transmitter's buffer.
            *begun += (status & TWI_STAT_NACK_ADDRESS) != 0 ? 1 : 1 + moved;
            return error_of(status);
        }
        move_bytes(message, &moved);
        if ((events & TWI_INT_COMPLETE) != 0) {
            *begun += 1u + message->bytes;
            return moved == message->bytes ? ERROR_OK : ERROR_IO;
        }
        if (bf537_now_us() > deadline_us) {
            *begun += 1u + moved;
            return ERROR_TIMEOUT;
        }
        bf537_sleep_until_us(bf537_now_us() + POLL_US);
    }
}

static int transfer(void *self, const struct hal_i2c_message *messages, size_t count,
                    uint64_t deadline_us, size_t *begun) {
    (void)self;
    *begun = 0;
    if ((TWI_MASTER_STAT & (TWI_STAT_SDA_LOW | TWI_STAT_SCL_LOW)) != 0) {
        return ERROR_I2C_STUCK;
    }
    // The stop after an address without an answer may be on its way.
    while ((TWI_MASTER_STAT & (TWI_STAT_RUNS | TWI_STAT_BUS_BUSY)) != 0) {
        if (bf537_now_us() > deadline_us) {
            return ERROR_I2C_STUCK;
        }
        bf537_sleep_until_us(bf537_now_us() + POLL_US);
    }
    TWI_FIFO_CTL = TWI_FIFO_FLUSH;
    TWI_FIFO_CTL = 0;
    int error = ERROR_OK;
    for (size_t i = 0; i < count && error == ERROR_OK; i++) {
        error = run_message(&messages[i], i + 1 < count, deadline_us, begun);
    }
    if (error != ERROR_OK) {
        TWI_MASTER_CTL = (uint16_t)(speed_bits | TWI_MASTER_STOP);
        ssync();
        TWI_MASTER_CTL = speed_bits;
        TWI_FIFO_CTL = TWI_FIFO_FLUSH;
        TWI_FIFO_CTL = 0;
    }
    return error;
}

static int lines(void *self, unsigned pulled, unsigned *high) {
    (void)self;
    TWI_MASTER_CTL =
        (uint16_t)(speed_bits | ((pulled & HAL_I2C_SDA) != 0 ? TWI_MASTER_PULL_SDA : 0) |
                   ((pulled & HAL_I2C_SCL) != 0 ? TWI_MASTER_PULL_SCL : 0));
    ssync();
    const uint16_t status = TWI_MASTER_STAT;
    *high = ((status & TWI_STAT_SDA_LOW) == 0 ? HAL_I2C_SDA : 0u) |
            ((status & TWI_STAT_SCL_LOW) == 0 ? HAL_I2C_SCL : 0u);
    return ERROR_OK;
}

const struct hal_i2c *bf537_twi_open(uint32_t speed_hz) {
    static const struct hal_i2c_operations operations = {transfer, lines};
    static const struct hal_i2c bus = {&operations, NULL};
    const uint32_t half = TIME_UNIT_HZ / speed_hz / 2;
    speed_bits = speed_hz >= FAST_HZ ? TWI_MASTER_FAST : 0;
    TWI_CONTROL = (uint16_t)(TWI_CONTROL_ENABLE | bf537_system_hz() / TIME_UNIT_HZ);
    TWI_CLKDIV = (uint16_t)(half << 8 | half);
    TWI_INT_MASK = 0;
    ssync();
    return &bus;
}
