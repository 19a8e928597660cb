// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/linux/gpiod_lines.h"

#include <errno.h>
#include <stddef.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/linux/device_file.h"

static const struct {
    const char *name;
    bool is_input;
} kinds[HAL_GPIO_LINES] = {
    [HAL_GPIO_BRIDGE_RESET] = {"the bridge's reset", false},
    [HAL_GPIO_BRIDGE_IRQ] = {"the bridge's interrupt", true},
    [HAL_GPIO_LENS_POWER] = {"the lenses' power", false},
    [HAL_GPIO_TRIGGER] = {"the cameras' trigger", false},
};

/// The chip may be a USB device, so it can disappear.
static int failed(struct gpiod_lines *self, int error_number) {
    const int error = device_file_error(error_number);
    self->gone = self->gone || error == ERROR_DEVICE;
    return error;
}

static int set(void *opaque, enum hal_gpio_line line, bool active) {
    struct gpiod_lines *self = opaque;
    INVARIANT((unsigned)line < HAL_GPIO_LINES);
    if (self->closed) {
        return ERROR_DEVICE;
    }
    if (self->lines[line] == NULL || kinds[line].is_input) {
        return ERROR_UNSUPPORTED;
    }
    return gpiod_shim_set(self->lines[line], active) == 0 ? ERROR_OK : failed(self, errno);
}

static int get(void *opaque, enum hal_gpio_line line, bool *active) {
    struct gpiod_lines *self = opaque;
    INVARIANT((unsigned)line < HAL_GPIO_LINES);
    if (self->closed) {
        return ERROR_DEVICE;
    }
    if (self->lines[line] == NULL) {
        return ERROR_UNSUPPORTED;
    }
    const int level = gpiod_shim_get(self->lines[line]);
    if (level < 0) {
        return failed(self, errno);
    }
    *active = level != 0;
    return ERROR_OK;
}

static int open_error(int error_number, const char **advice) {
    switch (error_number) {
        case EINVAL:
            *advice = "no such line on this chip (gpioinfo lists them)";
            return ERROR_UNSUPPORTED;
        case EBUSY:
            *advice = "in use by another program or driver (gpioinfo shows which)";
            return ERROR_REFUSED;
        case EACCES:
        case EPERM:
            *advice = "the user must be in the group that owns the chip";
            return ERROR_REFUSED;
        case ENOENT:
        case ENODEV:
        case ENXIO:
        case ENOTTY:
            *advice = "no such GPIO chip (gpiodetect lists them)";
            return ERROR_DEVICE;
        default:
            *advice = "see the kernel's messages (dmesg)";
            return ERROR_IO;
    }
}

static enum gpiod_shim_use choose_use(bool is_input, bool active_at_start) {
    if (is_input) {
        return GPIOD_SHIM_INPUT;
    }
    return active_at_start ? GPIOD_SHIM_OUTPUT_ACTIVE : GPIOD_SHIM_OUTPUT_INACTIVE;
}

void gpiod_lines_init(struct gpiod_lines *self) {
    static const struct hal_gpio_operations operations = {set, get};
    *self = (struct gpiod_lines){.hal = {&operations, self}, .closed = true};
}

int gpiod_lines_open(struct gpiod_lines *self, const struct gpiod_line_location *locations,
                     struct message *message) {
    gpiod_lines_init(self);
    for (int i = 0; i < HAL_GPIO_LINES; i++) {
        const struct gpiod_line_location *location = &locations[i];
        if (location->chip == NULL) {
            continue;
        }
        const enum gpiod_shim_use use = choose_use(kinds[i].is_input, location->active_at_start);
        // Before opening: a chip that changes meanwhile counts as another one.
        self->chips[i] = (struct device_file_identity){.number = 0};
        (void)device_file_identify(location->chip, &self->chips[i]);
        do {
            self->lines[i] =
                gpiod_shim_open(location->chip, location->offset, location->active_low, use);
        } while (self->lines[i] == NULL && errno == EINTR);
        if (self->lines[i] == NULL) {
            const int error_number = errno;
            const char *advice = "";
            const int error = open_error(error_number, &advice);
            gpiod_lines_close(self);
            return message_set(message, error, "line %u of %s for %s: %s; %s", location->offset,
                               location->chip, kinds[i].name, strerror(error_number), advice);
        }
    }
    self->closed = false;
    return ERROR_OK;
}

void gpiod_lines_close(struct gpiod_lines *self) {
    for (int i = 0; i < HAL_GPIO_LINES; i++) {
        gpiod_shim_close(self->lines[i]);
        self->lines[i] = NULL;
    }
    self->closed = true;
}

bool gpiod_lines_are_current(const struct gpiod_lines *self,
                             const struct gpiod_line_location *locations) {
    bool current = !self->closed && !self->gone;
    for (int i = 0; i < HAL_GPIO_LINES && current; i++) {
        struct device_file_identity there;
        current = self->lines[i] == NULL ||
                  (locations[i].chip != NULL && device_file_identify(locations[i].chip, &there) &&
                   device_file_is_same(&self->chips[i], &there));
    }
    return current;
}
