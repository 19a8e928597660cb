// SPDX-License-Identifier: Apache-2.0
/// The control side of the simulated rig: scene, truth and faults, by lines of text.
#ifndef VERGENCE_SIMRIG_SERVER_CONTROL_HPP
#define VERGENCE_SIMRIG_SERVER_CONTROL_HPP

#include <functional>
#include <string>
#include <vector>

#include "tools/simrig/rig/scenery.hpp"

namespace simrig {

class ControlDesk {
  public:
    ControlDesk(Rig &rig, Stage &stage) : rig_(rig), stage_(stage) {}

    /// Carries out one command and gives its answer, which may have several lines. Throws
    /// std::runtime_error with one line that says what is wrong.
    std::string run(const std::string &command);

    /// The commands, a line each.
    static std::string help();

  private:
    using Words = std::vector<std::string>;
    std::string status();
    std::string truth(const Words &words);
    std::string view(const Words &words);
    std::string at(const Words &words);
    // Faults are checked when they are asked for, and done now or later.
    using Deed = std::function<void()>;
    Deed fault(const Words &words);
    Deed fault_servo(const Words &words);
    Deed fault_lens(const Words &words);
    Deed fault_camera(const Words &words);
    Deed fault_bus(const Words &words);
    Deed fault_serial(const Words &words);

    Rig &rig_;
    Stage &stage_;
};

}  // namespace simrig

#endif
