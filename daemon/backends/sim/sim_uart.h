// SPDX-License-Identifier: Apache-2.0
/// The simulated rig's serial line as hal_uart.
#ifndef VERGENCE_DAEMON_BACKENDS_SIM_SIM_UART_H
#define VERGENCE_DAEMON_BACKENDS_SIM_SIM_UART_H

#include "daemon/backends/sim/sim_connection.h"
#include "hal/uart.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The line. The caller owns it and the connection, which must outlive all users; initialise all
/// other fields to 0.
struct sim_uart {
    struct sim_connection *connection;
    uint8_t pending[SIMRIG_SERIAL_BYTES_MAX];  ///< received, not yet read; excess is dropped
    size_t pending_bytes;
};

struct hal_uart sim_uart_hal(struct sim_uart *self);

#ifdef __cplusplus
}
#endif

#endif
