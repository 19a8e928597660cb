// SPDX-License-Identifier: Apache-2.0
/// The requests to a rig, in order and with a sum of each answer: enough to replay it.
#ifndef VERGENCE_SIMRIG_WIRE_LOG_HPP
#define VERGENCE_SIMRIG_WIRE_LOG_HPP

#include <string>
#include <vector>

#include "tools/simrig/wire/message.hpp"

namespace simrig {

enum class Happened : uint8_t {
    kAnswered = 1,   ///< a request, with its answer
    kBegun = 2,      ///< a request that advances time; others may come before its answer
    kFinished = 3,   ///< the answer of the begun one
    kAbandoned = 4,  ///< its client disconnected before the answer
    kReleased = 5,   ///< the board's client disconnected
};

struct LogEntry {
    Happened happened = Happened::kReleased;
    uint8_t role = 0;     ///< role of the client that sent a request
    uint16_t type = 0;    ///< type of a request
    uint32_t steps = 0;   ///< steps in time since the previous entry, made just before this one
    uint32_t answer = 0;  ///< CRC-32 of the reply's body
    Body body;            ///< body of a request
};

constexpr uint32_t kLatestBeginS = 1000000;

/// How the rig was built; a log fits no other. Sums: CRC-32 of the files.
struct LogHead {
    std::string rig, scene;
    uint32_t rig_sum = 0, scene_sum = 0;
    uint64_t seed = 0;
    uint32_t begin_s = 0;      ///< RigSettings::begin_s
    bool every_clock = false;  ///< RigSettings::every_clock
};

uint32_t sum_of(const Body &body);

/// A log file written entry by entry: a killed simrig loses at most the last one.
class LogFile {
  public:
    /// Throw std::runtime_error with one line when the file cannot be written.
    LogFile(const std::string &path, const LogHead &head);
    void add(const LogEntry &entry);
    ~LogFile();
    LogFile(const LogFile &) = delete;
    LogFile &operator=(const LogFile &) = delete;
    /// Position of the next entry; everything behind it can be removed.
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
