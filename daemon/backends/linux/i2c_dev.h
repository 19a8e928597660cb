// SPDX-License-Identifier: Apache-2.0
/// hal_i2c on Linux's i2c-dev: a transfer is one I2C_RDWR, with repeated STARTs and one STOP.
///
/// The adapter is told to repeat nothing (I2C_RETRIES 0) and to give up at the deadline
/// (I2C_TIMEOUT, in steps of 10 ms rounded down, never 0: no kernel can do less, so a transfer with
/// less than 10 ms left may end up to 10 ms late on a bus that hangs). Both belong to the adapter,
/// not to the descriptor: two programs on a bus see each other's.
/// The kernel tells neither how far a failed transfer came nor the state of the lines.
/// EINTR (a driver that gives up for a signal) is told as ERROR_TIMEOUT: it was cut short anywhere.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_I2C_DEV_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_I2C_DEV_H

#include <stdbool.h>
#include <stdint.h>

#include "daemon/base/message.h"
#include "hal/i2c.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The caller owns it; `hal` points to it, so it must not move.
struct i2c_dev {
    struct hal_i2c hal;
    int fd;
    unsigned long timeout_10ms;  ///< the adapter's, 0: not set yet
};

/// Makes it one that is not open: its transfers say ERROR_DEVICE.
void i2c_dev_init(struct i2c_dev *self);
/// Opens a bus, for example "/dev/i2c-1". ERROR_DEVICE, ERROR_REFUSED, ERROR_IO, or
/// ERROR_UNSUPPORTED: the adapter knows SMBus only. `message` says more; nothing is open then.
int i2c_dev_open(struct i2c_dev *self, const char *path, struct message *message);
void i2c_dev_close(struct i2c_dev *self);
/// Whether it is open, and still the bus of this path.
bool i2c_dev_is_current(const struct i2c_dev *self, const char *path);

#ifdef __cplusplus
}
#endif

#endif
