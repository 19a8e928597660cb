// SPDX-License-Identifier: Apache-2.0
/// hal_i2c on Linux's i2c-dev: a transfer is one I2C_RDWR, with repeated STARTs and one STOP.
///
/// The adapter is set to not retry (I2C_RETRIES 0) and to give up at the deadline (I2C_TIMEOUT,
/// rounded down to 10 ms but never 0; the kernel's minimum is 10 ms, so on a hanging bus a transfer
/// with less time left may end up to 10 ms late). Both settings belong to the adapter, not the
/// descriptor: two programs on a bus share them.
/// The kernel reports neither the progress of a failed transfer nor the state of the lines. EINTR
/// (a driver that gives up on a signal) is returned as ERROR_TIMEOUT: the transfer may have been
/// cut anywhere.
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
    unsigned long timeout_10ms;  ///< timeout that the adapter has now; 0: not set yet
};

/// Initialises a closed bus: its transfers return ERROR_DEVICE.
void i2c_dev_init(struct i2c_dev *self);
/// Opens a bus, for example "/dev/i2c-1". ERROR_DEVICE, ERROR_REFUSED, ERROR_IO, or
/// ERROR_UNSUPPORTED (the adapter supports SMBus only), with a message, and nothing is open.
int i2c_dev_open(struct i2c_dev *self, const char *path, struct message *message);
void i2c_dev_close(struct i2c_dev *self);
/// Whether it is open and still the bus at this path.
bool i2c_dev_is_current(const struct i2c_dev *self, const char *path);

#ifdef __cplusplus
}
#endif

#endif
