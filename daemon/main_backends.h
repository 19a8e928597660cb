// SPDX-License-Identifier: Apache-2.0
/// What the instrument hangs on, as the settings say it: devices of Linux, a simulated rig, or a
/// recorded session; in front of that the faults of a test, and in front of all the recorder.
#ifndef VERGENCE_DAEMON_MAIN_BACKENDS_H
#define VERGENCE_DAEMON_MAIN_BACKENDS_H

#include <stdbool.h>

#include "daemon/backends/fault/fault.h"
#include "daemon/backends/replay/replay.h"
#include "daemon/backends/sim/sim_backend.h"
#include "daemon/main_linux.h"
#include "daemon/session/record.h"
#include "daemon/settings/config.h"
#include "daemon/settings/fault_plan.h"

#ifdef __cplusplus
extern "C" {
#endif

/// All of them; static storage, as it is large and must not move.
struct main_backends {
    struct sim_backend sim;
    struct replay replay;
    struct main_linux devices;
    bool has_sim, has_replay;
    struct rig_opener replay_opener;  ///< opens nothing, but knows why a played part fails
    const struct hal_log *log;
    bool departure_told;  ///< why the play ended is in the log

    struct fault_plan plan;
    struct fault_i2c fault_i2c;
    struct fault_camera fault_camera[RIG_SIDES];
    struct fault_gpio fault_gpio;
    struct fault_uart fault_uart;
    struct fault_store fault_store;
    struct fault_watchdog fault_watchdog;
    const struct hal_clock *faults_clock;  ///< NULL: the plan has no rule

    struct record record;
    bool time_passes;  ///< by itself, and not by the rig's own waits alone
};

/// Opens what the settings name. `*ports` are the rig's. Of a recording that is played the profile
/// in the settings becomes what it was then. 0, or an error with a message; main_backends_close is
/// needed in any case.
int main_backends_open(struct main_backends *self, struct config *config, const struct hal_log *log,
                       struct rig_ports *ports, struct message *message);
/// What is no part of the rig, behind the same faults, once they are open: `real` (NULL: NULL),
/// which must not move, or what stands in front of it.
const struct hal_store *main_backends_store(struct main_backends *self,
                                            const struct hal_store *real);
const struct hal_watchdog *main_backends_watchdog(struct main_backends *self,
                                                  const struct hal_watchdog *real);
/// Puts into the log why the play of a recording ended, if it did, once.
void main_backends_tell_departure(struct main_backends *self);
void main_backends_close(struct main_backends *self);

#ifdef __cplusplus
}
#endif

#endif
