// SPDX-License-Identifier: Apache-2.0
/// The simulated rig's time as hal_clock. In virtual time a wait advances the rig's time.
#ifndef VERGENCE_DAEMON_BACKENDS_SIM_SIM_CLOCK_H
#define VERGENCE_DAEMON_BACKENDS_SIM_SIM_CLOCK_H

#include "daemon/backends/sim/sim_connection.h"
#include "hal/clock.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The clock; the connection must outlive it. Once the rig has gone, waits return at once and the
/// time is the one waited for.
struct hal_clock sim_clock_hal(struct sim_connection *connection);

#ifdef __cplusplus
}
#endif

#endif
