// SPDX-License-Identifier: Apache-2.0
// libgpiod 2: a request remains valid after its chip is closed.
#include <errno.h>
#include <gpiod.h>
#include <stdlib.h>

#include "core/invariant.h"
#include "daemon/backends/linux/gpiod_shim.h"

struct gpiod_shim {
    struct gpiod_line_request *request;
    unsigned offset;
};

const char *gpiod_shim_library(void) {
    return "libgpiod 2";
}

/// The line's settings, or NULL with errno.
static struct gpiod_line_config *configure(unsigned offset, bool active_low,
                                           enum gpiod_shim_use use) {
    struct gpiod_line_settings *settings = gpiod_line_settings_new();
    struct gpiod_line_config *config = gpiod_line_config_new();
    int failed = settings == NULL || config == NULL;
    if (!failed) {
        gpiod_line_settings_set_active_low(settings, active_low);
        failed =
            use == GPIOD_SHIM_INPUT
                ? gpiod_line_settings_set_direction(settings, GPIOD_LINE_DIRECTION_INPUT)
                : gpiod_line_settings_set_direction(settings, GPIOD_LINE_DIRECTION_OUTPUT) ||
                      gpiod_line_settings_set_output_value(
                          settings, use == GPIOD_SHIM_OUTPUT_ACTIVE ? GPIOD_LINE_VALUE_ACTIVE
                                                                    : GPIOD_LINE_VALUE_INACTIVE);
    }
    failed = failed || gpiod_line_config_add_line_settings(config, &offset, 1, settings);
    const int error_number = errno;
    gpiod_line_settings_free(settings);
    if (failed) {
        gpiod_line_config_free(config);
        config = NULL;
    }
    errno = error_number;
    return config;
}

static struct gpiod_line_request *request_line(const char *path, struct gpiod_line_config *line) {
    struct gpiod_request_config *config = gpiod_request_config_new();
    if (config == NULL) {
        return NULL;
    }
    gpiod_request_config_set_consumer(config, "vergence");
    struct gpiod_chip *chip = gpiod_chip_open(path);
    struct gpiod_line_request *request =
        chip == NULL ? NULL : gpiod_chip_request_lines(chip, config, line);
    const int error_number = errno;
    if (chip != NULL) {
        gpiod_chip_close(chip);
    }
    gpiod_request_config_free(config);
    errno = error_number;
    return request;
}

struct gpiod_shim *gpiod_shim_open(const char *chip, unsigned offset, bool active_low,
                                   enum gpiod_shim_use use) {
    struct gpiod_shim *self = calloc(1, sizeof *self);
    struct gpiod_line_config *line = configure(offset, active_low, use);
    bool good = self != NULL && line != NULL;
    if (good) {
        self->offset = offset;
        self->request = request_line(chip, line);
        good = self->request != NULL;
    }
    const int error_number = errno;
    gpiod_line_config_free(line);
    if (!good) {
        gpiod_shim_close(self);
        self = NULL;
    }
    errno = error_number;
    return self;
}

void gpiod_shim_close(struct gpiod_shim *self) {
    if (self != NULL && self->request != NULL) {
        gpiod_line_request_release(self->request);
    }
    free(self);
}

int gpiod_shim_set(struct gpiod_shim *self, bool active) {
    INVARIANT(self != NULL);
    return gpiod_line_request_set_value(
        self->request, self->offset, active ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE);
}

int gpiod_shim_get(struct gpiod_shim *self) {
    INVARIANT(self != NULL);
    const enum gpiod_line_value value = gpiod_line_request_get_value(self->request, self->offset);
    return value == GPIOD_LINE_VALUE_ERROR ? -1 : value == GPIOD_LINE_VALUE_ACTIVE;
}
