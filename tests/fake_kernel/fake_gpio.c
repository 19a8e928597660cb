// SPDX-License-Identifier: Apache-2.0
#include "fake_gpio.h"

#include <errno.h>
#include <linux/gpio.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fake_file.h"

enum { MAJOR = 254, MINOR = 0 };

static struct fake_gpio state;
static struct fake_device *chip_device;  // the lines are unplugged with it
// State of a line's open file: the number of the line.
static unsigned line_numbers[FAKE_GPIO_LINES] = {0, 1, 2, 3, 4, 5, 6, 7};

static unsigned line_of(const struct fake_file *file) {
    return *(const unsigned *)file->state;
}

static bool level(unsigned line) {
    return state.wire[line] != state.active_low[line];
}

static void set_level(unsigned line, bool active) {
    state.wire[line] = active != state.active_low[line];
    if (state.drive != NULL && state.is_output[line]) {
        state.drive(&state, line);
    }
}

static void describe(struct fake_file *file, unsigned long request, const void *argument,
                     char *line, size_t bytes) {
    (void)file;
    static const struct {
        unsigned long request;
        const char *name;
    } names[] = {
        {GPIO_GET_CHIPINFO_IOCTL, "CHIPINFO"},
        {GPIO_GET_LINEINFO_IOCTL, "LINEINFO"},
        {GPIO_GET_LINEHANDLE_IOCTL, "LINEHANDLE"},
        {GPIOHANDLE_GET_LINE_VALUES_IOCTL, "GET_VALUES"},
        {GPIO_V2_GET_LINEINFO_IOCTL, "V2_LINEINFO"},
        {GPIO_V2_GET_LINE_IOCTL, "V2_LINE"},
        {GPIO_V2_LINE_GET_VALUES_IOCTL, "V2_GET_VALUES"},
    };
    if (request == GPIOHANDLE_SET_LINE_VALUES_IOCTL) {
        snprintf(line, bytes, "SET_VALUES %u",
                 ((const struct gpiohandle_data *)argument)->values[0]);
    } else if (request == GPIO_V2_LINE_SET_VALUES_IOCTL) {
        snprintf(line, bytes, "V2_SET_VALUES %u",
                 (unsigned)((const struct gpio_v2_line_values *)argument)->bits);
    }
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        if (names[i].request == request) {
            snprintf(line, bytes, "%s", names[i].name);
        }
    }
}

static int control_line(struct fake_file *file, unsigned long request, void *argument) {
    const unsigned line = line_of(file);
    switch (request) {
        case GPIOHANDLE_GET_LINE_VALUES_IOCTL:
            ((struct gpiohandle_data *)argument)->values[0] = level(line);
            return 0;
        case GPIOHANDLE_SET_LINE_VALUES_IOCTL:
            set_level(line, ((const struct gpiohandle_data *)argument)->values[0] != 0);
            return 0;
        case GPIO_V2_LINE_GET_VALUES_IOCTL:
            ((struct gpio_v2_line_values *)argument)->bits = level(line);
            return 0;
        case GPIO_V2_LINE_SET_VALUES_IOCTL:
            set_level(line, (((const struct gpio_v2_line_values *)argument)->bits & 1) != 0);
            return 0;
        default:
            return -ENOTTY;
    }
}

static void close_line(struct fake_file *file) {
    state.requested[line_of(file)] = false;
}

static const struct fake_operations line_operations = {
    .close = close_line, .describe = describe, .ioctl = control_line};

/// A new descriptor for a line; -errno.
static int request_line(unsigned line, bool active_low, bool output, bool active,
                        const char *consumer) {
    if (line >= FAKE_GPIO_LINES) {
        return -EINVAL;
    }
    if (state.requested[line]) {
        return -EBUSY;
    }
    const int fd = fake_file_new("gpio-line", chip_device, &line_operations, &line_numbers[line]);
    if (fd < 0) {
        return fd;
    }
    state.requested[line] = true;
    state.active_low[line] = active_low;
    state.is_output[line] = output;
    snprintf(state.consumer[line], sizeof state.consumer[line], "%s", consumer);
    if (output) {
        set_level(line, active);
    }
    return fd;
}

static int answer(int fd, int *into) {
    *into = fd;
    return fd < 0 ? fd : 0;
}

static int first_line_info(struct gpioline_info *info) {
    if (info->line_offset >= FAKE_GPIO_LINES) {
        return -EINVAL;
    }
    const unsigned line = info->line_offset;
    memset(info, 0, sizeof *info);
    info->line_offset = line;
    info->flags = (state.requested[line] ? GPIOLINE_FLAG_KERNEL : 0U) |
                  (state.is_output[line] ? GPIOLINE_FLAG_IS_OUT : 0U) |
                  (state.active_low[line] ? GPIOLINE_FLAG_ACTIVE_LOW : 0U);
    return 0;
}

static int second_request(struct gpio_v2_line_request *request) {
    const uint64_t flags = request->config.flags;
    const struct gpio_v2_line_config *config = &request->config;
    bool active = false;
    for (unsigned i = 0; i < config->num_attrs; i++) {
        if (config->attrs[i].attr.id == GPIO_V2_LINE_ATTR_ID_OUTPUT_VALUES) {
            active = (config->attrs[i].attr.values & 1) != 0;
        }
    }
    return answer(request_line(request->offsets[0], (flags & GPIO_V2_LINE_FLAG_ACTIVE_LOW) != 0,
                               (flags & GPIO_V2_LINE_FLAG_OUTPUT) != 0, active, request->consumer),
                  &request->fd);
}

static int control_chip(struct fake_file *file, unsigned long request, void *argument) {
    (void)file;
    switch (request) {
        case GPIO_GET_CHIPINFO_IOCTL: {
            struct gpiochip_info *info = argument;
            memset(info, 0, sizeof *info);
            snprintf(info->name, sizeof info->name, "gpiochip0");
            info->lines = FAKE_GPIO_LINES;
            return 0;
        }
        case GPIO_GET_LINEINFO_IOCTL:
            return first_line_info(argument);
        case GPIO_GET_LINEHANDLE_IOCTL: {
            struct gpiohandle_request *handle = argument;
            return answer(request_line(handle->lineoffsets[0],
                                       (handle->flags & GPIOHANDLE_REQUEST_ACTIVE_LOW) != 0,
                                       (handle->flags & GPIOHANDLE_REQUEST_OUTPUT) != 0,
                                       handle->default_values[0] != 0, handle->consumer_label),
                          &handle->fd);
        }
        case GPIO_V2_GET_LINE_IOCTL:
            return second_request(argument);
        default:
            return -ENOTTY;
    }
}

static int read_numbers(struct fake_file *file, void *data, size_t bytes) {
    (void)file;
    char text[16];
    const int length = snprintf(text, sizeof text, "%d:%d\n", MAJOR, MINOR);
    if (length < 0 || (size_t)length > bytes) {
        return -EINVAL;
    }
    memcpy(data, text, (size_t)length);
    return length;
}

struct fake_gpio *fake_gpio_add(const char *path) {
    static const struct fake_operations chip = {.describe = describe, .ioctl = control_chip};
    static const struct fake_operations numbers = {.read = read_numbers};
    state = (struct fake_gpio){.drive = NULL};
    chip_device = fake_file_device(path, MAJOR, MINOR, &chip, &state);
    char sysfs[64];
    snprintf(sysfs, sizeof sysfs, "/sys/bus/gpio/devices/%s/dev", strrchr(path, '/') + 1);
    fake_file_device(sysfs, 0, 0, &numbers, NULL);
    return &state;
}
