// SPDX-License-Identifier: Apache-2.0
/// Files by the names that people give: scenes and rigs that come with simrig, and what it writes.
#ifndef VERGENCE_SIMRIG_SERVER_PLACE_HPP
#define VERGENCE_SIMRIG_SERVER_PLACE_HPP

#include <string>

#include "tools/simrig/wire/message.hpp"

namespace simrig {

/// `name` is a path when it has a slash or ends in .yaml, and else one of those in tools/simrig;
/// folder: "scenes" or "rigs". Throws std::runtime_error with one line when there is no such.
std::string place_of(const std::string &folder, const std::string &name);

/// All bytes of a scene's or rig's file; throws std::runtime_error with one line.
Body description_at(const std::string &path);

/// Where something is to be written: in `folder`, under a name without slashes. Throws
/// std::runtime_error when the name is not one, or no folder was named.
std::string place_for(const std::string &folder, const std::string &name);

/// Nothing in a message may break its line.
std::string one_line(std::string text);

}  // namespace simrig

#endif
