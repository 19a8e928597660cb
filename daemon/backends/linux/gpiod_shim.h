// SPDX-License-Identifier: Apache-2.0
/// One line of a GPIO chip: the common subset of libgpiod 1.6 and 2. The build compiles one of
/// gpiod_shim_v1.c, gpiod_shim_v2.c and gpiod_shim_none.c, according to the system's header.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_GPIOD_SHIM_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_GPIOD_SHIM_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Use of a line.
enum gpiod_shim_use {
    GPIOD_SHIM_OUTPUT_INACTIVE,  ///< an output that starts inactive
    GPIOD_SHIM_OUTPUT_ACTIVE,
    GPIOD_SHIM_EDGES,  ///< an input that reports when it becomes active
};

/// A requested line; owned by the library.
struct gpiod_shim;

/// "libgpiod 1", "libgpiod 2", or "none" if built without. Static storage.
const char *gpiod_shim_library(void);

/// Requests a line of a chip ("/dev/gpiochip0"). NULL with errno: ENOENT, EBUSY (another program
/// has the line), EINVAL (the chip has no such line), ENOSYS (built without libgpiod) ...
struct gpiod_shim *gpiod_shim_open(const char *chip, unsigned offset, bool active_low,
                                   enum gpiod_shim_use use);
/// Releases the line; NULL does nothing.
void gpiod_shim_close(struct gpiod_shim *self);

/// 0, or -1 with errno.
int gpiod_shim_set(struct gpiod_shim *self, bool active);
/// 0 or 1, or -1 with errno.
int gpiod_shim_get(struct gpiod_shim *self);
/// A descriptor that becomes readable on an edge.
int gpiod_shim_descriptor(struct gpiod_shim *self);
/// Reads the oldest edge and the kernel's time of it in us. 0, or -1 with errno. Blocks while there
/// is not an edge.
int gpiod_shim_read_edge(struct gpiod_shim *self, uint64_t *time_us);

#ifdef __cplusplus
}
#endif

#endif
