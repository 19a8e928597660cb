// SPDX-License-Identifier: Apache-2.0
/// The simulated rig's lines as hal_gpio: the bridge's reset and its interrupt.
#ifndef VERGENCE_DAEMON_BACKENDS_SIM_SIM_GPIO_H
#define VERGENCE_DAEMON_BACKENDS_SIM_SIM_GPIO_H

#include "daemon/backends/sim/sim_connection.h"
#include "hal/gpio.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { SIM_GPIO_EDGES = 64 };

/// The lines. The caller owns them and the connection, which must outlive all users; initialise all
/// other fields to 0.
struct sim_gpio {
    struct sim_connection *connection;
    uint32_t outputs;                   ///< SIMRIG_OUT_*
    uint64_t edges_us[SIM_GPIO_EDGES];  ///< edges to active not yet waited for; the latest ones
    uint32_t edge_count;
};

struct hal_gpio sim_gpio_hal(struct sim_gpio *self);

#ifdef __cplusplus
}
#endif

#endif
