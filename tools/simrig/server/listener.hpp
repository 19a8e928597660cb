// SPDX-License-Identifier: Apache-2.0
/// The socket that accepts clients.
#ifndef VERGENCE_SIMRIG_SERVER_LISTENER_HPP
#define VERGENCE_SIMRIG_SERVER_LISTENER_HPP

#include <chrono>
#include <cstdint>
#include <string>

#include "tools/simrig/wire/request.hpp"

namespace simrig {

/// "unix:PATH" (for this user alone) or "tcp:PORT" (loopback only; port 0: any free one). Throws
/// std::runtime_error with one line that says what is wrong.
class Listener {
  public:
    explicit Listener(const std::string &where);
    /// Why `where` is not a valid address, in one line; empty: it is valid.
    static std::string wrong_place(const std::string &where);
    ~Listener();
    Listener(const Listener &) = delete;
    Listener &operator=(const Listener &) = delete;
    int socket() const { return socket_; }
    /// As a client writes it, with the actual port.
    const std::string &name() const { return name_; }
    /// Of a Unix socket; empty: none.
    const std::string &path() const { return path_; }

  private:
    void listen_unix(const std::string &path);
    void listen_tcp(uint16_t port);

    int socket_ = -1;
    std::string name_, path_;
};

/// A client's socket: messages in, replies out, never blocking.

class Connection {
  public:
    /// Takes ownership of the socket, which must be non-blocking.
    explicit Connection(int socket) : socket_(socket) {}
    ~Connection();
    Connection(const Connection &) = delete;
    Connection &operator=(const Connection &) = delete;

    int socket() const { return socket_; }
    /// Reads what has arrived. False: the client sends no more or disconnected.
    bool receive();
    /// The next whole message; empty: not complete yet.
    std::optional<Message> next() { return inbox_.next(); }
    std::optional<Message> too_long() const { return inbox_.too_long(); }
    void send(const Message &message) { append(output_, message); }
    /// Sends without blocking. False: the client disconnected.
    bool flush();
    bool has_output() const { return sent_ < output_.size(); }
    /// Too many replies are waiting to be fetched: no more requests are read until then.
    bool output_full() const { return output_.size() - sent_ > kOutputMax; }

    /// Stops receiving; the client has a second to read the replies sent so far.
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
