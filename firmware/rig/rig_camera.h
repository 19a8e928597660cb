// SPDX-License-Identifier: Apache-2.0
/// Frames of one camera, which has its own port or shares one behind the bridge. For rig/ only.
///
/// After an error `last_error` is set; the rig is not made safe here. ERROR_CANCELLED: by the
/// observer.
#ifndef VERGENCE_RIG_RIG_CAMERA_H
#define VERGENCE_RIG_RIG_CAMERA_H

#include "rig/base/rig_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// After this time the bridge switches to another source even if no frame of the old one ends.
enum { RIG_CAMERA_SWITCH_LIMIT_MS = 120 };

/// Largest part of a range (HAL_CAMERA_GAIN_PART, HAL_CAMERA_FOCUS_PART).
enum { RIG_CAMERA_PARTS = 1000 };

/// Frame period with the camera's settings. Where no sensor reports it, an upper bound: that of the
/// profile, or the exposure that was set or found, if that is longer.
uint64_t rig_camera_frame_us(const struct rig *self, unsigned side);

/// Starts frames of this size from both cameras. Does not change the sensors behind the bridge.
int rig_camera_start(struct rig *self, const struct hal_camera_format *format);
/// The same for one camera with its own port.
int rig_camera_start_side(struct rig *self, unsigned side, const struct hal_camera_format *format);
/// Switches off what a camera with its own port sets automatically, logs that, and reads its
/// exposure, gain and focus: frames may take as long as the exposure. What a camera does not report
/// is not known; whether it works shows in its frames.
void rig_camera_take_over(struct rig *self, unsigned side);
/// The gain that stands for a part of the range of a camera with its own port, which has a scale of
/// its own; gain_q3 as `rig_gain`.
uint16_t rig_camera_gain_of(int32_t part);
/// Stops the frames. Returns the first error.
int rig_camera_stop(struct rig *self);

/// Exposure and gain as set or found; 0: not known.
uint32_t rig_camera_exposure_us(const struct rig *self, unsigned side);
uint16_t rig_camera_gain_q3(const struct rig *self, unsigned side);

/// Sets the exposure of a camera behind the bridge to that of its sensor's rows.
void rig_camera_note_exposure(struct rig *self, unsigned side);

/// To be called after a settings change was sent: only frames with the new settings count from now
/// on. `before_us`: the frame period before the change.
void rig_camera_unsettle(struct rig *self, unsigned side, uint64_t before_us);

/// As rig_camera_take (rig/trigger.h), for cameras that do not wait for the trigger line.
int rig_camera_take_running(struct rig *self, unsigned side, uint64_t not_before_us,
                            struct hal_camera_frame *frame);
/// The steps of rig_camera_take_running. Makes the bridge pass frames of this camera.
int rig_camera_choose(struct rig *self, unsigned side);
/// Waits for the next frame of the chosen camera that counts, without the bridge's counters.
int rig_camera_wait(struct rig *self, unsigned side, uint64_t not_before_us,
                    struct hal_camera_frame *frame);
/// Faults (HAL_CAMERA_SHORT_LINE, HAL_CAMERA_SHORT) that the bridge counted between two readings.
uint32_t rig_camera_counted(const struct fpga_bridge_camera *before,
                            const struct fpga_bridge_camera *after);
/// The same for the first frame of a free-running camera with its own port: waits as long after its
/// start as webcams need, plus its exposure, however long the wait for the other camera took.
int rig_camera_take_first(struct rig *self, unsigned side, struct hal_camera_frame *frame);

/// ERROR_FRAME with its message if an image does not have the size of the format.
int rig_camera_check_size(struct rig *self, unsigned side, const struct raw_image *image);
/// The error ERROR_FRAME, with its message, of the second frame in a row that had faults.
int rig_camera_torn(struct rig *self, unsigned side, uint32_t faults);

/// Sets exposure or gain of a camera, whatever the state of the rig. `*applied_us` as rig_exposure.
int rig_camera_set_exposure(struct rig *self, unsigned side, uint32_t exposure_us,
                            uint32_t *applied_us);
int rig_camera_set_gain(struct rig *self, unsigned side, uint16_t gain_q3);

/// Handles the result of a settings change of a sensor behind the bridge: makes the rig safe after
/// an error. `before_us`: as above.
int rig_camera_sensor_was_set(struct rig *self, unsigned side, uint64_t before_us, int error);

/// Checks that each data line of a camera reaches the port and is not swapped with another. Makes
/// the sensor send two known values in a small window, and checks what arrives. Errors as
/// rig_camera_take; ERROR_VERIFY: a line is dead; ERROR_FRAME: damaged frames. `last_error` is set.
int rig_lines_check(struct rig *self, unsigned side);

#ifdef __cplusplus
}
#endif

#endif
