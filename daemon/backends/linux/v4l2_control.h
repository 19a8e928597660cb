// SPDX-License-Identifier: Apache-2.0
/// Exposure, gain and focus of a V4L2 camera. Each call that sets one first disables the camera's
/// automatic control: measuring requires a camera that does not change between two frames.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_V4L2_CONTROL_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_V4L2_CONTROL_H

#include <stdint.h>

#include "hal/camera.h"

#ifdef __cplusplus
extern "C" {
#endif

/// As `control` of hal_camera. ERROR_UNSUPPORTED: the camera has no such control (exposure: or not
/// in known units); ERROR_RANGE; ERROR_DEVICE; ERROR_IO.
int v4l2_control_set(int fd, enum hal_camera_control control, int32_t value, int32_t *applied);

#ifdef __cplusplus
}
#endif

#endif
