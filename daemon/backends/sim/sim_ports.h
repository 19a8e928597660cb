// SPDX-License-Identifier: Apache-2.0
/// The simulated rig's clock, I2C bus, lines and serial line as interfaces of hal/. The caller owns
/// each struct, initialised to 0 but for its connection; both must outlive all users.
#ifndef VERGENCE_DAEMON_BACKENDS_SIM_SIM_PORTS_H
#define VERGENCE_DAEMON_BACKENDS_SIM_SIM_PORTS_H

#include "daemon/backends/sim/sim_connection.h"
#include "hal/clock.h"
#include "hal/gpio.h"
#include "hal/i2c.h"
#include "hal/uart.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The rig's time. In virtual time a wait advances it. Once the rig has gone, waits return at once
/// and the time is the one waited for.
struct hal_clock sim_clock_hal(struct sim_connection *connection);

/// The bus. Its lines cannot be driven individually.
struct sim_i2c {
    struct sim_connection *connection;
    uint32_t speed_hz;  ///< clock rate of SCL
};

struct hal_i2c sim_i2c_hal(struct sim_i2c *self);

/// The `begun` count of hal_i2c from a reply: `whole` messages were transferred, and `bytes` of the
/// next one (without its address). An upper bound if the reply is ambiguous.
size_t sim_i2c_begun(int32_t status, const struct hal_i2c_message *messages, size_t count,
                     size_t whole, size_t bytes);

/// The bridge's reset and its interrupt.
struct sim_gpio {
    struct sim_connection *connection;
    uint32_t outputs;  ///< SIMRIG_OUT_*
};

struct hal_gpio sim_gpio_hal(struct sim_gpio *self);

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
