// SPDX-License-Identifier: Apache-2.0
/// A client's socket: messages in, replies out, never blocking.
#ifndef VERGENCE_SIMRIG_SERVER_CONNECTION_HPP
#define VERGENCE_SIMRIG_SERVER_CONNECTION_HPP

#include <cstdint>
#include <optional>
#include <vector>

#include "tools/simrig/protocol/simrig_protocol.h"

namespace simrig {

struct Message {
    uint16_t type = 0, tag = 0;
    std::vector<uint8_t> body;
};

class Connection {
  public:
    /// Takes over the socket, which must not block.
    explicit Connection(int socket) : socket_(socket) {}
    ~Connection();
    Connection(const Connection &) = delete;
    Connection &operator=(const Connection &) = delete;

    int socket() const { return socket_; }
    /// Reads what is there. False: the client has gone, or sends what cannot be a message.
    bool receive();
    /// The next whole message; nothing: not there yet.
    std::optional<Message> next();
    void send(const Message &message);
    /// Sends what can be sent. False: the client has gone.
    bool flush();
    bool has_output() const { return sent_ < output_.size(); }
    /// Replies that nobody fetches pile up only so far; until then no more requests are read.
    bool clogged() const { return output_.size() - sent_ > kOutputMax; }

    std::optional<simrig_role> role;

  private:
    static constexpr size_t kOutputMax = size_t(2) * SIMRIG_BODY_MAX;

    int socket_;
    std::vector<uint8_t> input_, output_;
    size_t sent_ = 0;
};

}  // namespace simrig

#endif
