// SPDX-License-Identifier: Apache-2.0
/// Converts a connection's bytes to messages and back.
#ifndef VERGENCE_SIMRIG_WIRE_MESSAGE_HPP
#define VERGENCE_SIMRIG_WIRE_MESSAGE_HPP

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/simrig/protocol/simrig_protocol.h"

namespace simrig {

using Body = std::vector<uint8_t>;

struct Message {
    uint16_t type = 0, tag = 0;
    Body body;
};

/// Received bytes that are not yet a message. Holds at most one message and what arrived with it.
class Inbox {
  public:
    void add(const uint8_t *bytes, size_t count);
    /// The next whole message; empty: not complete, or too_long().
    std::optional<Message> next();
    /// The header of a message that is too long (body empty): the messages behind it cannot be
    /// separated. Empty: all messages so far are valid.
    std::optional<Message> too_long() const;
    /// No byte of a message has arrived.
    bool empty() const { return at_ == bytes_.size(); }

  private:
    size_t waiting() const { return bytes_.size() - at_; }
    size_t announced() const;  ///< length of the body; the header has arrived

    Body bytes_;
    size_t at_ = 0;
};

/// Header and body behind `output`.
void append(Body &output, const Message &message);

/// Files named by users: read whole, never blocking.

/// All bytes of a file. Throws std::runtime_error with one line: it cannot be read, is not a
/// regular file (a directory, a pipe, a device), or has more than `max` bytes.
Body whole_file(const std::string &path, size_t max);

}  // namespace simrig

#endif
