// SPDX-License-Identifier: Apache-2.0
/// The devices' part of a rig file: servos, lens motors, sensors' clocks and the lens controller.
#ifndef VERGENCE_SIMRIG_RIG_SETTINGS_HPP
#define VERGENCE_SIMRIG_RIG_SETTINGS_HPP

#include <string>

#include "tools/simrig/rig/rig.hpp"

namespace simrig {

/// Throws world::BadFile with one line that says what is wrong and where.
RigSettings load_settings(const std::string &path);

}  // namespace simrig

#endif
