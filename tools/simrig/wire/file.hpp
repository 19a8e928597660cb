// SPDX-License-Identifier: Apache-2.0
/// Files named by users: read whole, never blocking.
#ifndef VERGENCE_SIMRIG_WIRE_FILE_HPP
#define VERGENCE_SIMRIG_WIRE_FILE_HPP

#include <string>

#include "tools/simrig/wire/message.hpp"

namespace simrig {

/// All bytes of a file. Throws std::runtime_error with one line: it cannot be read, is not a
/// regular file (a directory, a pipe, a device), or has more than `max` bytes.
Body whole_file(const std::string &path, size_t max);

}  // namespace simrig

#endif
