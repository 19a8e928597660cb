// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/pty.hpp"

#include <fcntl.h>
#include <termios.h>
#include <unistd.h>

#include <cstdlib>
#include <stdexcept>
#include <vector>

namespace simrig {

Pty::Pty() {
    master_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    char name[128];
    if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0 ||
        ptsname_r(master_, name, sizeof name) != 0) {
        throw std::runtime_error("cannot create a pseudo terminal");
    }
    name_ = name;
    // Kept open here too, so that it survives a program closing it; raw mode, like a serial line.
    slave_ = open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
    termios settings{};
    if (slave_ < 0 || tcgetattr(slave_, &settings) != 0) {
        throw std::runtime_error("cannot open " + name_);
    }
    cfmakeraw(&settings);
    tcsetattr(slave_, TCSANOW, &settings);
}

Pty::~Pty() {
    if (slave_ >= 0) {
        close(slave_);
    }
    if (master_ >= 0) {
        close(master_);
    }
}

void Pty::exchange(SerialLine &line, uint64_t now_ps) {
    uint8_t buffer[256];
    const ssize_t count = read(master_, buffer, sizeof buffer);
    if (count > 0) {
        line.send(now_ps, std::vector<uint8_t>(buffer, buffer + count));
    }
    const std::vector<uint8_t> bytes = line.take(now_ps);
    // A program that does not read loses bytes, as on a real line.
    if (!bytes.empty() && write(master_, bytes.data(), bytes.size()) < 0) {
        return;
    }
}

}  // namespace simrig
