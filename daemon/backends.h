// SPDX-License-Identifier: Apache-2.0
/// The backends that the settings select: Linux devices, a simulated rig, or a recorded session;
/// wrapped by a test's faults.
#ifndef VERGENCE_DAEMON_BACKENDS_H
#define VERGENCE_DAEMON_BACKENDS_H

#include <stdbool.h>

#include "daemon/backend_linux.h"
#include "daemon/backends/fault/fault.h"
#include "daemon/backends/replay/replay.h"
#include "daemon/backends/sim/sim_backend.h"
#include "daemon/settings/config.h"
#include "daemon/settings/fault_plan.h"

/// All backends. Use static storage: it is large and must not move.
struct backends {
    struct sim_backend sim;
    struct replay replay;
    struct backend_linux devices;
    bool has_sim, has_replay;
    bool awaited;                       ///< the simulated rig did not answer yet
    struct rig_devices replay_devices;  ///< opens nothing, but states why a replayed part fails
    const struct hal_log *log;
    bool mismatch_reported;  ///< the end of the replay was logged

    struct fault_plan plan;
    struct fault_i2c fault_i2c;
    struct fault_camera fault_camera[RIG_SIDES];
    struct fault_gpio fault_gpio;
    struct fault_uart fault_uart;
    struct fault_store fault_store;
    struct fault_watchdog fault_watchdog;
    const struct hal_clock *faults_clock;  ///< NULL: the plan has no rule
};

/// Opens the backends that the settings name; `*ports` are the rig's. For a replay the profile in
/// the settings is replaced by the recorded one. 0, or an error with a message; call
/// backends_close in any case.
int backends_open(struct backends *self, struct config *config, const struct hal_log *log,
                  struct rig_ports *ports, struct message *message);
/// Backends outside the rig, behind the same faults, once they are open: `real` (NULL: NULL), which
/// must not move, or a wrapper around it.
const struct hal_store *backends_store(struct backends *self, const struct hal_store *real);
const struct hal_watchdog *backends_watchdog(struct backends *self,
                                             const struct hal_watchdog *real);
/// Logs once why a replay ended, if it did.
void backends_report_mismatch(struct backends *self);
void backends_close(struct backends *self);

#endif
