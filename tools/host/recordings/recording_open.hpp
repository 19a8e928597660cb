// SPDX-License-Identifier: Apache-2.0
#ifndef VERGENCE_TOOLS_HOST_RECORDINGS_RECORDING_OPEN_HPP
#define VERGENCE_TOOLS_HOST_RECORDINGS_RECORDING_OPEN_HPP

#include <memory>
#include <string>

#include "tools/host/recordings/recording_reader.hpp"

/// Opens an MCAP file or a bag of ROS 1, by its first bytes. Throws import_failure.
std::unique_ptr<recording_reader> recording_open(const std::string &path);

#endif
