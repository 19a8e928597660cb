// SPDX-License-Identifier: Apache-2.0
#include "fake_i2c.h"

#include <errno.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <stdio.h>
#include <string.h>

#include "fake_file.h"

static struct fake_i2c state;

static void describe_messages(const struct i2c_rdwr_ioctl_data *data, char *line, size_t bytes) {
    for (unsigned i = 0; i < data->nmsgs; i++) {
        const struct i2c_msg *message = &data->msgs[i];
        const size_t used = strlen(line);
        const int head =
            snprintf(line + used, bytes - used,
                     " %c%02x:", (message->flags & I2C_M_RD) != 0 ? 'r' : 'w', message->addr);
        size_t at = used + (size_t)head;
        if ((message->flags & I2C_M_RD) != 0) {
            snprintf(line + at, bytes - at, "%u", message->len);
            continue;
        }
        for (unsigned j = 0; j < message->len && at + 3 < bytes; j++, at += 2) {
            snprintf(line + at, bytes - at, "%02x", message->buf[j]);
        }
    }
}

static void describe(struct fake_file *file, unsigned long request, const void *argument,
                     char *line, size_t bytes) {
    (void)file;
    switch (request) {
        case I2C_FUNCS:
            snprintf(line, bytes, "I2C_FUNCS");
            break;
        case I2C_RETRIES:
        case I2C_TIMEOUT:
            snprintf(line, bytes, "%s %lu", request == I2C_RETRIES ? "I2C_RETRIES" : "I2C_TIMEOUT",
                     (unsigned long)(uintptr_t)argument);
            break;
        case I2C_RDWR:
            snprintf(line, bytes, "I2C_RDWR");
            describe_messages(argument, line, bytes);
            break;
        default:
            break;
    }
}

static int transfer(struct fake_i2c *bus, const struct i2c_rdwr_ioctl_data *data) {
    if (data->nmsgs > I2C_RDWR_IOCTL_MAX_MSGS) {
        return -EINVAL;
    }
    bus->transfers++;
    static uint8_t index;
    for (unsigned i = 0; i < data->nmsgs; i++) {
        const struct i2c_msg *message = &data->msgs[i];
        if (message->addr != bus->address) {
            return -ENXIO;
        }
        for (unsigned j = 0; j < message->len; j++) {
            if ((message->flags & I2C_M_RD) != 0) {
                message->buf[j] = bus->registers[index++];
            } else if (j == 0) {
                index = message->buf[j];
            } else {
                bus->registers[index++] = message->buf[j];
            }
        }
    }
    return bus->only_messages >= 0 ? bus->only_messages : (int)data->nmsgs;
}

static int control(struct fake_file *file, unsigned long request, void *argument) {
    struct fake_i2c *bus = file->state;
    switch (request) {
        case I2C_FUNCS:
            *(unsigned long *)argument = bus->functions;
            return 0;
        case I2C_RETRIES:
            bus->retries = (unsigned long)(uintptr_t)argument;
            return 0;
        case I2C_TIMEOUT:
            bus->timeout_10ms = (unsigned long)(uintptr_t)argument;
            return 0;
        case I2C_RDWR:
            return transfer(bus, argument);
        default:
            return -ENOTTY;
    }
}

struct fake_i2c *fake_i2c_add(const char *path, uint8_t address) {
    static const struct fake_operations operations = {.describe = describe, .ioctl = control};
    state = (struct fake_i2c){.functions = I2C_FUNC_I2C | I2C_FUNC_SMBUS_EMUL,
                              .address = address,
                              .retries = 3,
                              .timeout_10ms = 100,
                              .only_messages = -1};
    fake_file_device(path, 89, 1, &operations, &state);
    return &state;
}
