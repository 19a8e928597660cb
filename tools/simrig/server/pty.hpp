// SPDX-License-Identifier: Apache-2.0
/// A pseudo terminal at the end of a serial line, for programs that need a device.
#ifndef VERGENCE_SIMRIG_SERVER_PTY_HPP
#define VERGENCE_SIMRIG_SERVER_PTY_HPP

#include <string>

#include "tools/simrig/devices/serial_line.hpp"

namespace simrig {

class Pty {
  public:
    /// Throws std::runtime_error when the system has none.
    Pty();
    ~Pty();
    Pty(const Pty &) = delete;
    Pty &operator=(const Pty &) = delete;

    /// Path of the device that a program opens.
    const std::string &name() const { return name_; }
    /// Moves bytes both ways; never blocks.
    void exchange(SerialLine &line, uint64_t now_ps);

  private:
    int master_ = -1, slave_ = -1;
    std::string name_;
};

}  // namespace simrig

#endif
