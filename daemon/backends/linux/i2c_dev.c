// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/linux/i2c_dev.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <string.h>
#include <sys/ioctl.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/linux/device_file.h"
#include "daemon/backends/linux/monotonic_clock.h"
#include "daemon/base/monotonic.h"

enum { TIMEOUT_UNIT_US = 10000, TIMEOUT_MAX_10MS = 6000 };

static int error_of(int error_number) {
    switch (error_number) {
        case ENXIO:
        case EREMOTEIO:
            return ERROR_I2C_NACK;
        case EAGAIN:
            return ERROR_I2C_ARBITRATION;
        case ETIMEDOUT:
        case EINTR:
            return ERROR_TIMEOUT;
        case EBUSY:
            return ERROR_I2C_STUCK;
        case EOPNOTSUPP:
            return ERROR_UNSUPPORTED;
        case ENODEV:
        case ESHUTDOWN:
            return ERROR_DEVICE;
        default:
            return ERROR_IO;
    }
}

/// Sets the adapter's time limit for a transfer with `left_us` remaining.
static int set_timeout(struct i2c_dev *self, uint64_t left_us) {
    unsigned long units = TIMEOUT_MAX_10MS;
    if (left_us < (uint64_t)TIMEOUT_MAX_10MS * TIMEOUT_UNIT_US) {
        units = (unsigned long)(left_us / TIMEOUT_UNIT_US);
    }
    units = units > 0 ? units : 1;
    if (units == self->timeout_10ms) {
        return ERROR_OK;
    }
    if (ioctl(self->fd, I2C_TIMEOUT, units) < 0) {
        return error_of(errno);
    }
    self->timeout_10ms = units;
    return ERROR_OK;
}

static int transfer(void *opaque, const struct hal_i2c_message *messages, size_t count,
                    uint64_t deadline_us, size_t *begun) {
    struct i2c_dev *self = opaque;
    INVARIANT(count >= 1 && count <= HAL_I2C_MESSAGES_MAX);
    struct i2c_msg list[HAL_I2C_MESSAGES_MAX];
    size_t bytes = 0;
    for (size_t i = 0; i < count; i++) {
        INVARIANT(messages[i].bytes >= 1 && messages[i].bytes <= HAL_I2C_BYTES_MAX);
        INVARIANT(messages[i].address < 0x80 && messages[i].data != NULL);
        list[i] = (struct i2c_msg){.addr = messages[i].address,
                                   .flags = messages[i].read ? I2C_M_RD : 0,
                                   .len = messages[i].bytes,
                                   .buf = messages[i].data};
        bytes += 1 + (size_t)messages[i].bytes;
    }
    *begun = 0;
    if (self->fd < 0) {
        return ERROR_DEVICE;
    }
    const uint64_t now_us = monotonic_now_us();
    if (now_us >= deadline_us) {
        return ERROR_TIMEOUT;
    }
    const int error = set_timeout(self, deadline_us - now_us);
    if (error != ERROR_OK) {
        return error;
    }
    struct i2c_rdwr_ioctl_data data = {.msgs = list, .nmsgs = (uint32_t)count};
    *begun = bytes;
    const int done = ioctl(self->fd, I2C_RDWR, &data);
    if (done < 0) {
        return error_of(errno);
    }
    // Fewer messages than requested: the adapter's driver reports no reason, and a missing
    // acknowledgement is the most frequent one (i2c-virtio knows no other).
    return (size_t)done == count ? ERROR_OK : ERROR_I2C_NACK;
}

void i2c_dev_init(struct i2c_dev *self) {
    static const struct hal_i2c_operations operations = {transfer, NULL};
    *self = (struct i2c_dev){.hal = {&operations, self}, .fd = -1};
}

int i2c_dev_open(struct i2c_dev *self, const char *path, struct message *message) {
    i2c_dev_init(self);
    const int fd = device_file_open(path, O_RDWR, "I2C bus", message);
    if (fd < 0) {
        return fd;
    }
    unsigned long functions = 0;
    int error = ERROR_OK;
    if (device_file_control(fd, I2C_FUNCS, &functions) < 0) {
        error = message_set(message, ERROR_IO, "I2C bus %s: %s (expected an i2c-dev device)", path,
                            strerror(errno));
    } else if ((functions & I2C_FUNC_I2C) == 0) {
        error = message_set(message, ERROR_UNSUPPORTED,
                            "I2C bus %s supports SMBus only (the bridge requires an adapter with "
                            "I2C_FUNC_I2C)",
                            path);
    } else if (ioctl(fd, I2C_RETRIES, 0UL) < 0) {
        error =
            message_set(message, ERROR_IO, "I2C bus %s: I2C_RETRIES: %s", path, strerror(errno));
    }
    self->fd = fd;
    if (error != ERROR_OK) {
        i2c_dev_close(self);
    }
    return error;
}

void i2c_dev_close(struct i2c_dev *self) {
    device_file_close(&self->fd);
}

bool i2c_dev_is_current(const struct i2c_dev *self, const char *path) {
    return device_file_is_current(self->fd, path);
}
