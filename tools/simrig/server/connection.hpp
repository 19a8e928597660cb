// SPDX-License-Identifier: Apache-2.0
/// A client's socket: messages in, replies out, never blocking.
#ifndef VERGENCE_SIMRIG_SERVER_CONNECTION_HPP
#define VERGENCE_SIMRIG_SERVER_CONNECTION_HPP

#include <chrono>

#include "tools/simrig/wire/request.hpp"

namespace simrig {

class Connection {
  public:
    /// Takes over the socket, which must not block.
    explicit Connection(int socket) : socket_(socket) {}
    ~Connection();
    Connection(const Connection &) = delete;
    Connection &operator=(const Connection &) = delete;

    int socket() const { return socket_; }
    /// Reads what is there. False: the client sends no more, or has gone.
    bool receive();
    /// The next whole message; nothing: not there yet.
    std::optional<Message> next() { return inbox_.next(); }
    std::optional<Message> too_long() const { return inbox_.too_long(); }
    void send(const Message &message) { append(output_, message); }
    /// Sends what can be sent. False: the client has gone.
    bool flush();
    bool has_output() const { return sent_ < output_.size(); }
    /// Replies that nobody fetches pile up only so far; until then no more requests are read.
    bool clogged() const { return output_.size() - sent_ > kOutputMax; }

    /// No more is heard; the client gets what has been sent to it, and a second to read that.
    void finish();
    bool finished() const { return finished_; }
    bool overdue() const;

    std::optional<simrig_role> role;

  private:
    static constexpr size_t kOutputMax = size_t(2) * SIMRIG_BODY_MAX;

    int socket_;
    Inbox inbox_;
    Body output_;
    size_t sent_ = 0;
    bool finished_ = false;
    std::chrono::steady_clock::time_point finished_at_;
};

}  // namespace simrig

#endif
