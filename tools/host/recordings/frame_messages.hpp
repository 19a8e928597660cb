// SPDX-License-Identifier: Apache-2.0
/// Frames and cameras as ROS's messages, without header.
#ifndef VERGENCE_TOOLS_HOST_RECORDINGS_FRAME_MESSAGES_HPP
#define VERGENCE_TOOLS_HOST_RECORDINGS_FRAME_MESSAGES_HPP

#include <string>

#include "core/raw_image.h"
#include "stereo/develop.h"
#include "stereo/geometry/lens.h"
#include "tools/host/recordings/ros_messages.hpp"

/// Thrown, with the exit code and the message of the command.
struct frame_failure {
    int exit_code;
    std::string text;
};

/// The pixels of a frame, unchanged but for their place in words of 16 bits, which ROS fills from
/// the top.
ros_image frame_raw_message(const raw_image &image);

/// The developed picture of a frame as a PNG. Throws frame_failure.
ros_image frame_compressed_message(const raw_image &image, const develop_balance &balance);

/// A camera with its part of the rectified pair, P in m.
ros_camera_info frame_camera_info(const lens &camera, const double R[9], const double P[12]);

#endif
