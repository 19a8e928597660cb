// SPDX-License-Identifier: Apache-2.0
/// A written result as messages.
#ifndef VERGENCE_TOOLS_HOST_RECORDINGS_RECORDING_RESULT_HPP
#define VERGENCE_TOOLS_HOST_RECORDINGS_RECORDING_RESULT_HPP

#include <string>

#include "tools/host/recordings/ros_messages.hpp"

struct recording_result {
    unsigned pair = 0;  // of its session; 0: not stated
    ros_disparity disparity{};
    ros_points points{};             // lengths in m
    double rotation_rect_left[9]{};  // row-major
};

/// Reads a result directory. 0, or an error with `why`; a result whose lengths are assumed is one.
int recording_result_read(const std::string &directory, recording_result *result, std::string *why);

#endif
