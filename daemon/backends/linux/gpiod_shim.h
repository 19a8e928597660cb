// SPDX-License-Identifier: Apache-2.0
/// One line of a GPIO chip: the common subset of libgpiod 1.6 and 2. The build compiles one of
/// gpiod_shim_v1.c and gpiod_shim_v2.c, according to the system's header.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_GPIOD_SHIM_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_GPIOD_SHIM_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Use of a line.
enum gpiod_shim_use {
    GPIOD_SHIM_OUTPUT_INACTIVE,  ///< an output that starts inactive
    GPIOD_SHIM_OUTPUT_ACTIVE,
    GPIOD_SHIM_INPUT,
};

/// A requested line; owned by the library.
struct gpiod_shim;

/// "libgpiod 1" or "libgpiod 2". Static storage.
const char *gpiod_shim_library(void);

/// Requests a line of a chip ("/dev/gpiochip0"). NULL with errno: ENOENT, EBUSY (another program
/// has the line), EINVAL (the chip has no such line) ...
struct gpiod_shim *gpiod_shim_open(const char *chip, unsigned offset, bool active_low,
                                   enum gpiod_shim_use use);
/// Releases the line; NULL does nothing.
void gpiod_shim_close(struct gpiod_shim *self);

/// 0, or -1 with errno.
int gpiod_shim_set(struct gpiod_shim *self, bool active);
/// 0 or 1, or -1 with errno.
int gpiod_shim_get(struct gpiod_shim *self);

#ifdef __cplusplus
}
#endif

#endif
