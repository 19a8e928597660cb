// SPDX-License-Identifier: Apache-2.0
// libgpiod 1.6: a line belongs to its chip and is closed with it.
#include <errno.h>
#include <gpiod.h>
#include <stdlib.h>

#include "core/invariant.h"
#include "daemon/backends/linux/gpiod_shim.h"

struct gpiod_shim {
    struct gpiod_chip *chip;
    struct gpiod_line *line;
};

static const char consumer[] = "vergence";

const char *gpiod_shim_library(void) {
    return "libgpiod 1";
}

static int request(struct gpiod_line *line, bool active_low, enum gpiod_shim_use use) {
    const int flags = active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
    if (use == GPIOD_SHIM_INPUT) {
        return gpiod_line_request_input_flags(line, consumer, flags);
    }
    return gpiod_line_request_output_flags(line, consumer, flags, use == GPIOD_SHIM_OUTPUT_ACTIVE);
}

struct gpiod_shim *gpiod_shim_open(const char *chip, unsigned offset, bool active_low,
                                   enum gpiod_shim_use use) {
    struct gpiod_shim *self = calloc(1, sizeof *self);
    if (self == NULL) {
        return NULL;
    }
    self->chip = gpiod_chip_open(chip);
    self->line = self->chip == NULL ? NULL : gpiod_chip_get_line(self->chip, offset);
    if (self->line == NULL || request(self->line, active_low, use) != 0) {
        const int error_number = errno;
        gpiod_shim_close(self);
        errno = error_number;
        return NULL;
    }
    return self;
}

void gpiod_shim_close(struct gpiod_shim *self) {
    if (self != NULL && self->chip != NULL) {
        gpiod_chip_close(self->chip);
    }
    free(self);
}

int gpiod_shim_set(struct gpiod_shim *self, bool active) {
    INVARIANT(self != NULL);
    return gpiod_line_set_value(self->line, active);
}

int gpiod_shim_get(struct gpiod_shim *self) {
    INVARIANT(self != NULL);
    return gpiod_line_get_value(self->line);
}
