// SPDX-License-Identifier: Apache-2.0
/// All backends of a simulated rig.
#ifndef VERGENCE_DAEMON_BACKENDS_SIM_SIM_BACKEND_H
#define VERGENCE_DAEMON_BACKENDS_SIM_SIM_BACKEND_H

#include "daemon/backends/sim/sim_camera.h"
#include "daemon/backends/sim/sim_ports.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { SIM_BACKEND_WHERE = 320 };

/// The backends. The caller owns them; they must not move while open.
struct sim_backend {
    struct sim_connection connection;
    struct sim_i2c i2c_state;
    struct sim_camera camera_state;
    struct sim_gpio gpio_state;
    struct sim_uart uart_state;
    struct hal_clock clock;
    struct hal_i2c i2c;
    struct hal_camera camera;
    struct hal_gpio gpio;
    struct hal_uart uart;
    struct rig_devices devices;
    char where[SIM_BACKEND_WHERE];
};

/// Connects as the board (see sim_connection_open for `where`, `timeout_ms` and errors) and
/// allocates two full frames. On an error `connection.text` has the details; after ERROR_MISSING
/// and ERROR_TIMEOUT the backends are usable, as after a rig that has gone.
int sim_backend_open(struct sim_backend *self, const char *where, int timeout_ms);
void sim_backend_close(struct sim_backend *self);

/// The ports for a rig with the profile "rig", without a log. Each bring-up connects if the
/// simulated rig was not there or has gone, and waits for one that starts.
struct rig_ports sim_backend_ports(const struct sim_backend *self);

#ifdef __cplusplus
}
#endif

#endif
