// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/session.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <utility>

#include "tools/simrig/rig/rig.hpp"

namespace simrig {

namespace {

// A rig under load receives some 3 MiB a minute.
constexpr size_t kPastBytesMax = size_t(32) << 20;
constexpr double kAlways = std::numeric_limits<double>::infinity();

RigSettings settings_of(const LogHead &head) {
    RigSettings settings = load_settings(head.rig);
    settings.seed = head.seed;
    settings.begin_s = head.begin_s;
    settings.every_clock = head.every_clock;
    return settings;
}

}  // namespace

Setup::Setup(const LogHead &head, std::shared_ptr<world::Scene> scene, int threads,
             const std::string &files, WallClock clock)
    : stage(std::move(scene), head.rig, head.seed, threads),
      rig(settings_of(head),
          [this](int camera, const SensorFrame &frame, double begin_us,
                 const std::function<CameraState(double)> &state) {
              return stage.picture(camera, frame, begin_us, state);
          }),
      control_connection(rig, stage, head.scene, files),
      board(rig, control_connection, std::move(clock)) {}

Session::Session(Make make) : make_(std::move(make)), setup_(make_()) {}

void Session::record(LogEntry entry) {
    if (board().has_wall_time()) {
        return;  // wall time is not reproducible: no replay
    }
    entry.steps = std::exchange(steps_, 0);
    if (log_) {
        try {
            log_->add(entry);
        } catch (const std::runtime_error &error) {
            std::fprintf(stderr, "simrig: %s; logging stops\n", error.what());
            log_.reset();
            log_failed_ = true;
        }
    }
    keep(std::move(entry));
}

void Session::keep(LogEntry entry) {
    count_++;
    kept_bytes_ += sizeof entry + entry.body.size();
    if (kept_ && kept_bytes_ <= kPastBytesMax) {
        entries_.push_back(std::move(entry));
    } else if (kept_) {
        kept_ = false;
        entries_ = {};
    }
}

void Session::require_past() const {
    if (!kept_ && !log_) {
        throw std::runtime_error(
            "too many requests since the start for snapshots: start simrig with --log FILE, which "
            "keeps them");
    }
}

/// The first entries since the start.
std::vector<LogEntry> Session::past(size_t count) const {
    require_past();
    std::vector<LogEntry> entries = kept_ ? entries_ : read_log(log_path_).entries;
    entries.resize(std::min(count, entries.size()));
    return entries;
}

std::optional<Body> Session::begin(uint16_t type, const Body &body, simrig_role role) {
    std::optional<Body> answer = board().begin(type, body, role);
    record({answer ? Happened::kAnswered : Happened::kBegun, uint8_t(role), type, 0,
            answer ? sum_of(*answer) : 0, body});
    return answer;
}

std::optional<Body> Session::step() {
    std::optional<Body> answer = board().step();
    steps_++;
    if (answer) {
        record({Happened::kFinished, 0, 0, 0, sum_of(*answer), {}});
    }
    return answer;
}

void Session::abandon() {
    board().abandon();
    record({Happened::kAbandoned, 0, 0, 0, 0, {}});
}

void Session::release() {
    board().release();
    record({Happened::kReleased, 0, 0, 0, 0, {}});
}

void Session::log_to(const std::string &path, const LogHead &head) {
    log_ = std::make_unique<LogFile>(path, head);
    log_path_ = path;
    for (const LogEntry &entry : entries_) {
        log_->add(entry);
    }
}

void Session::save(const std::string &name) {
    if (board().has_wall_time()) {
        throw std::runtime_error("snapshots require virtual time (no --wall)");
    }
    if (board().busy()) {
        throw std::runtime_error("another client is letting time pass");
    }
    require_past();
    moments_[name] = {count_, log_ ? log_->end() : 0};
}

void Session::restore(const std::string &name) {
    const auto found = moments_.find(name);
    if (found == moments_.end()) {
        throw std::runtime_error("unknown snapshot '" + name + "'");
    }
    if (board().busy()) {
        throw std::runtime_error("another client is letting time pass");
    }
    const Moment moment = found->second;
    const std::vector<LogEntry> entries = past(moment.entries);
    std::unique_ptr<LogFile> log = std::move(log_);
    setup_ = make_();
    entries_.clear();
    count_ = kept_bytes_ = 0;
    kept_ = true;
    steps_ = 0;
    replay(entries, kAlways);
    log_ = std::move(log);
    if (log_) {
        log_->cut(moment.log_end);
    }
    // Later entries are discarded.
    for (auto other = moments_.begin(); other != moments_.end();) {
        other = other->second.entries > moment.entries ? moments_.erase(other) : std::next(other);
    }
}

std::optional<Body> Session::make_steps(const LogEntry &entry, double until_us) {
    std::optional<Body> answer;
    for (uint32_t i = 0; i < entry.steps && !answer && board().now_us() < until_us; i++) {
        if (!board().busy()) {
            break;
        }
        answer = step();
    }
    return answer;
}

// False: the answer differs.
bool Session::repeat(const LogEntry &entry, const std::optional<Body> &stepped) {
    if (entry.happened == Happened::kFinished) {
        return stepped && sum_of(*stepped) == entry.answer;
    }
    if (stepped) {
        return false;
    }
    switch (entry.happened) {
        case Happened::kAnswered: {
            const std::optional<Body> answer =
                begin(entry.type, entry.body, simrig_role(entry.role));
            return answer && sum_of(*answer) == entry.answer;
        }
        case Happened::kBegun:
            return !board().busy() && !begin(entry.type, entry.body, simrig_role(entry.role));
        case Happened::kAbandoned:
            abandon();
            return true;
        default:
            release();
            return true;
    }
}

void Session::replay(const std::vector<LogEntry> &entries, double until_us) {
    for (size_t i = 0; i < entries.size(); i++) {
        const std::optional<Body> stepped = make_steps(entries[i], until_us);
        if (board().now_us() >= until_us) {
            if (board().busy()) {
                abandon();
            }
            return;
        }
        if (!repeat(entries[i], stepped)) {
            throw std::runtime_error("entry " + std::to_string(i + 1) + " of " +
                                     std::to_string(entries.size()) +
                                     " is not answered as in the log");
        }
    }
    // The log may end during a request that no client waits for now.
    if (board().busy()) {
        abandon();
    }
}

}  // namespace simrig
