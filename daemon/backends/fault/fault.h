// SPDX-License-Identifier: Apache-2.0
/// Fault injection for any part of hal/: a wrapper that passes calls to the real part except those
/// that the plan makes fail. Callers cannot distinguish this from a real failure: an injected
/// ERROR_TIMEOUT comes at the deadline, outputs are untouched, and `begun` of a bus counts the
/// address that was not acknowledged.
///
/// The plan and the wrapped part must outlive the wrapper; `hal` points to it, so it must not move.
/// Operations that the real part does not have (`lines`, `control`) are missing in the wrapper too.
#ifndef VERGENCE_DAEMON_BACKENDS_FAULT_FAULT_H
#define VERGENCE_DAEMON_BACKENDS_FAULT_FAULT_H

#include "daemon/settings/fault_plan.h"
#include "hal/camera.h"
#include "hal/clock.h"
#include "hal/gpio.h"
#include "hal/i2c.h"
#include "hal/store.h"
#include "hal/uart.h"
#include "hal/watchdog.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What all wrappers share.
struct fault_common {
    struct fault_plan *plan;
    const struct hal_clock *clock;  ///< used to wait for deadlines
    const char *part;               ///< its name in the script: "i2c", "left", ...
};

struct fault_i2c {
    struct hal_i2c hal;
    struct hal_i2c_operations operations;
    struct fault_common common;
    const struct hal_i2c *real;
};

struct fault_camera {
    struct hal_camera hal;
    struct hal_camera_operations operations;
    struct fault_common common;
    const struct hal_camera *real;
};

struct fault_gpio {
    struct hal_gpio hal;
    struct fault_common common;
    const struct hal_gpio *real;
};

struct fault_uart {
    struct hal_uart hal;
    struct fault_common common;
    const struct hal_uart *real;
};

struct fault_store {
    struct hal_store hal;
    struct fault_common common;
    const struct hal_store *real;
};

struct fault_watchdog {
    struct hal_watchdog hal;
    struct fault_common common;
    const struct hal_watchdog *real;
};

/// Operations: transfer, lines.
void fault_i2c_wrap(struct fault_i2c *self, const struct fault_common *common,
                    const struct hal_i2c *real);
/// Operations: start, stop, take, control.
void fault_camera_wrap(struct fault_camera *self, const struct fault_common *common,
                       const struct hal_camera *real);
/// Operations: set, get.
void fault_gpio_wrap(struct fault_gpio *self, const struct fault_common *common,
                     const struct hal_gpio *real);
/// Operations: write, read, discard.
void fault_uart_wrap(struct fault_uart *self, const struct fault_common *common,
                     const struct hal_uart *real);
/// Operations: load, save, remove.
void fault_store_wrap(struct fault_store *self, const struct fault_common *common,
                      const struct hal_store *real);
/// Operations: feed.
void fault_watchdog_wrap(struct fault_watchdog *self, const struct fault_common *common,
                         const struct hal_watchdog *real);

#ifdef __cplusplus
}
#endif

#endif
