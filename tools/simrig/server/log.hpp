// SPDX-License-Identifier: Apache-2.0
/// What a rig was asked, in order, with a sum of each answer: enough to run it again.
#ifndef VERGENCE_SIMRIG_SERVER_LOG_HPP
#define VERGENCE_SIMRIG_SERVER_LOG_HPP

#include <cstdint>
#include <string>
#include <vector>

#include "tools/simrig/server/board.hpp"

namespace simrig {

/// One request and its answer's CRC-32. Type 0: the board's client has gone.
struct LogEntry {
    uint16_t type = 0, role = 0;
    uint32_t answer = 0;
    Body body;
};

/// How the rig was made; a log fits no other.
struct LogHead {
    std::string rig, scene;
    uint64_t seed = 0;
};

uint32_t sum_of(const Body &body);

/// Throw std::runtime_error with one line when the file cannot be written, or is not a log.
void write_log(const std::string &path, const LogHead &head, const std::vector<LogEntry> &entries);
std::vector<LogEntry> read_log(const std::string &path, LogHead &head);

/// Asks the board all of it again. Throws std::runtime_error at the first answer that differs.
void replay(Board &board, const std::vector<LogEntry> &entries);

}  // namespace simrig

#endif
