// SPDX-License-Identifier: Apache-2.0
/// The simulated rig's single parallel port as hal_camera: frames of the selected camera.
///
/// The port takes one frame at a time, the next that begins while it is armed. Gaps in the sequence
/// numbers are therefore unrequested frames, not losses. A take that times out leaves the port
/// armed for the next one.
#ifndef VERGENCE_DAEMON_BACKENDS_SIM_SIM_CAMERA_H
#define VERGENCE_DAEMON_BACKENDS_SIM_SIM_CAMERA_H

#include "daemon/backends/sim/sim_connection.h"
#include "hal/camera.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The port. The caller owns it and the connection, which must outlive all users.
struct sim_camera {
    struct sim_connection *connection;
    size_t max_px;  ///< largest frame that the port can deliver
    bool started, armed;
    struct hal_camera_format format;
    struct hal_camera_counts counts;
};

struct hal_camera sim_camera_hal(struct sim_camera *self);

#ifdef __cplusplus
}
#endif

#endif
