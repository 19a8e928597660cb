// SPDX-License-Identifier: Apache-2.0
/// The command line of simrig.
#ifndef VERGENCE_SIMRIG_SERVER_OPTIONS_HPP
#define VERGENCE_SIMRIG_SERVER_OPTIONS_HPP

#include <cstdint>
#include <stdexcept>
#include <string>

namespace simrig {

struct Options {
    std::string scene, rig, listen, log, replay, from, files, script, view, hint;
    uint64_t seed = 1;
    uint32_t begin_s = 0;  ///< start of the rig's time
    int threads = 1;
    double until_s = -1;  ///< negative: to the end
    double zoom = 1, focus_mm = 1800;
    bool wall = false, pty = false, every_clock = false;
    bool help = false, help_control = false, version = false;
};

struct WrongUsage : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Throws WrongUsage with one line. Arguments after --help and the like are not checked.
Options parse_options(int count, char **arguments);

extern const char *const kUsage;

}  // namespace simrig

#endif
