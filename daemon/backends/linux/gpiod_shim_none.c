// SPDX-License-Identifier: Apache-2.0
// Used if libgpiod is not available.
#include <errno.h>
#include <stddef.h>

#include "daemon/backends/linux/gpiod_shim.h"

const char *gpiod_shim_library(void) {
    return "none";
}

struct gpiod_shim *gpiod_shim_open(const char *chip, unsigned offset, bool active_low,
                                   enum gpiod_shim_use use) {
    (void)chip;
    (void)offset;
    (void)active_low;
    (void)use;
    errno = ENOSYS;
    return NULL;
}

void gpiod_shim_close(struct gpiod_shim *self) {
    (void)self;
}

static int no_such_call(void) {
    errno = ENOSYS;
    return -1;
}

int gpiod_shim_set(struct gpiod_shim *self, bool active) {
    (void)self;
    (void)active;
    return no_such_call();
}

int gpiod_shim_get(struct gpiod_shim *self) {
    (void)self;
    return no_such_call();
}

int gpiod_shim_descriptor(struct gpiod_shim *self) {
    (void)self;
    return no_such_call();
}

int gpiod_shim_read_edge(struct gpiod_shim *self, uint64_t *time_us) {
    (void)self;
    (void)time_us;
    return no_such_call();
}
