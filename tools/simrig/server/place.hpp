// SPDX-License-Identifier: Apache-2.0
/// Resolves names of files: scenes and rigs that come with simrig, and files that it writes.
#ifndef VERGENCE_SIMRIG_SERVER_PLACE_HPP
#define VERGENCE_SIMRIG_SERVER_PLACE_HPP

#include <string>

#include "tools/simrig/wire/message.hpp"

namespace simrig {

/// `name` is a path when it has a slash or ends in .yaml, and else one of those in tools/simrig;
/// folder: "scenes" or "rigs". Throws std::runtime_error with one line when it does not exist.
std::string place_of(const std::string &folder, const std::string &name);

/// All bytes of a scene's or rig's file; throws std::runtime_error with one line.
Body description_at(const std::string &path);

/// The path of an output file in `folder`. Throws std::runtime_error when the name is invalid or
/// `folder` is empty.
std::string place_for(const std::string &folder, const std::string &name);

/// Replaces characters that would break a one-line message.
std::string one_line(std::string text);

}  // namespace simrig

#endif
