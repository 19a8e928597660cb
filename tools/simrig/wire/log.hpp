// SPDX-License-Identifier: Apache-2.0
/// What a rig was asked, in order and with a sum of each answer: enough to run it again.
#ifndef VERGENCE_SIMRIG_WIRE_LOG_HPP
#define VERGENCE_SIMRIG_WIRE_LOG_HPP

#include <string>
#include <vector>

#include "tools/simrig/wire/message.hpp"

namespace simrig {

enum class Happened : uint8_t {
    kAnswered = 1,   ///< a request, with its answer
    kBegun = 2,      ///< a request that lets time pass; others may come before its answer
    kFinished = 3,   ///< the answer of the one that was begun
    kAbandoned = 4,  ///< its client has gone before the answer
    kReleased = 5,   ///< the board's client has gone
};

struct LogEntry {
    Happened happened = Happened::kReleased;
    uint8_t role = 0;     ///< of a request
    uint16_t type = 0;    ///< of a request
    uint32_t steps = 0;   ///< of time that were made since the entry before, just before this one
    uint32_t answer = 0;  ///< CRC-32 of the reply's body
    Body body;            ///< of a request
};

constexpr uint32_t kLatestBeginS = 1000000;

/// How the rig was made; a log fits no other. Sums: CRC-32 of the files.
struct LogHead {
    std::string rig, scene;
    uint32_t rig_sum = 0, scene_sum = 0;
    uint64_t seed = 0;
    uint32_t begin_s = 0;      ///< RigSettings::begin_s
    bool every_clock = false;  ///< RigSettings::every_clock
};

uint32_t sum_of(const Body &body);

/// A log file that grows entry by entry, so that a killed simrig leaves all but the last.
class LogFile {
  public:
    /// Throw std::runtime_error with one line when the file cannot be written.
    LogFile(const std::string &path, const LogHead &head);
    void add(const LogEntry &entry);
    ~LogFile();
    LogFile(const LogFile &) = delete;
    LogFile &operator=(const LogFile &) = delete;
    /// Where the next entry goes; everything behind can be taken back.
    long end() const { return end_; }
    void cut(long end);

  private:
    void write(const Body &bytes);

    std::string path_;
    int file_ = -1;
    long end_ = 0;
};

struct Log {
    LogHead head;
    std::vector<LogEntry> entries;
};

/// Throw std::runtime_error with one line: `name` cannot be read, or is not a log.
Log parse_log(const std::string &name, const Body &bytes);
Log read_log(const std::string &path);

}  // namespace simrig

#endif
