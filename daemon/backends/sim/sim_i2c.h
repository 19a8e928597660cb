// SPDX-License-Identifier: Apache-2.0
/// The simulated rig's bus as hal_i2c. Its lines cannot be driven individually.
#ifndef VERGENCE_DAEMON_BACKENDS_SIM_SIM_I2C_H
#define VERGENCE_DAEMON_BACKENDS_SIM_SIM_I2C_H

#include "daemon/backends/sim/sim_connection.h"
#include "hal/i2c.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The bus. The caller owns it and the connection, which must outlive all users.
struct sim_i2c {
    struct sim_connection *connection;
    uint32_t speed_hz;  ///< of SCL
};

struct hal_i2c sim_i2c_hal(struct sim_i2c *self);

/// The `begun` count of hal_i2c from a reply: `whole` messages were transferred, and `bytes` of the
/// next one (without its address). An upper bound if the reply is ambiguous.
size_t sim_i2c_begun(int32_t status, const struct hal_i2c_message *messages, size_t count,
                     size_t whole, size_t bytes);

#ifdef __cplusplus
}
#endif

#endif
