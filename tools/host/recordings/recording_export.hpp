// SPDX-License-Identifier: Apache-2.0
/// `vergence export SESSION --mcap FILE`: a session as ROS 2 messages, one chunk a pair.
///
/// Topics: /left/image_raw (or /left/image_raw/compressed) and /left/camera_info, the same of the
/// right camera; /tf; /diagnostics; of a result /disparity and /points. Frames: `rig`, which does
/// not turn; left_camera and right_camera, x right, y down, z forward (REP 103's optical frames);
/// left_rectified. All messages of a pair have the time of its left frame, so that programs which
/// take only equal times find the pairs.
#ifndef VERGENCE_TOOLS_HOST_RECORDINGS_RECORDING_EXPORT_HPP
#define VERGENCE_TOOLS_HOST_RECORDINGS_RECORDING_EXPORT_HPP

#include "daemon/surface/export_command.h"

extern "C" export_recording_writer recording_export;

#endif
