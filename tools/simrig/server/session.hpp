// SPDX-License-Identifier: Apache-2.0
/// A rig with the requests since its start, so that it can be replayed up to any moment, in this
/// process (snapshots) or in another (logs). They are kept in memory up to a limit, beyond it only
/// in the log.
#ifndef VERGENCE_SIMRIG_SERVER_SESSION_HPP
#define VERGENCE_SIMRIG_SERVER_SESSION_HPP

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/simrig/server/board.hpp"
#include "tools/simrig/wire/log.hpp"

namespace simrig {

/// A rig with its stage, control side and board.
struct Setup {
    Stage stage;
    Rig rig;
    ControlServer control_connection;
    Board board;

    /// head: with paths, not names; files: see ControlServer.
    Setup(const LogHead &head, std::shared_ptr<world::Scene> scene, int threads,
          const std::string &files, WallClock clock);
};

class Session {
  public:
    using Make = std::function<std::unique_ptr<Setup>()>;
    /// make: builds the rig at its start, always the same.
    explicit Session(Make make);

    Board &board() { return setup_->board; }
    SerialLine &serial() { return setup_->rig.serial(); }
    /// As Board's functions of these names, recorded.
    std::optional<Body> begin(uint16_t type, const Body &body, simrig_role role);
    std::optional<Body> step();
    void abandon();
    void release();

    /// Also writes all entries from the start to a file. Throws std::runtime_error.
    void log_to(const std::string &path, const LogHead &head);
    /// Whether the log could not be written completely.
    bool log_failed() const { return log_failed_; }

    /// Saves this moment; returns to it. Throw std::runtime_error with one line, also when the
    /// requests exceeded the memory and there is no log.
    void save(const std::string &name);
    void restore(const std::string &name);

    /// Repeats all entries that begin before that time. Throws std::runtime_error at the first
    /// answer that differs.
    void replay(const std::vector<LogEntry> &entries, double until_us);

  private:
    struct Moment {
        size_t entries;
        long log_end;
    };
    void record(LogEntry entry);
    void keep(LogEntry entry);
    void require_past() const;
    std::vector<LogEntry> past(size_t count) const;
    std::optional<Body> make_steps(const LogEntry &entry, double until_us);
    bool repeat(const LogEntry &entry, const std::optional<Body> &stepped);

    Make make_;
    std::unique_ptr<Setup> setup_;
    std::vector<LogEntry> entries_;  ///< empty: see kept_
    size_t count_ = 0;               ///< entries since the start
    size_t kept_bytes_ = 0;          ///< size of `entries_`
    bool kept_ = true;               ///< false: the entries exceeded the memory
    std::string log_path_;
    uint32_t steps_ = 0;
    std::map<std::string, Moment> moments_;
    std::unique_ptr<LogFile> log_;
    bool log_failed_ = false;
};

}  // namespace simrig

#endif
