// SPDX-License-Identifier: Apache-2.0
/// Bytes of a connection become messages, and messages bytes.
#ifndef VERGENCE_SIMRIG_WIRE_MESSAGE_HPP
#define VERGENCE_SIMRIG_WIRE_MESSAGE_HPP

#include <cstdint>
#include <optional>
#include <vector>

#include "tools/simrig/protocol/simrig_protocol.h"

namespace simrig {

using Body = std::vector<uint8_t>;

struct Message {
    uint16_t type = 0, tag = 0;
    Body body;
};

/// What has come and is not yet a message. It holds one message at most, and what came with it.
class Inbox {
  public:
    void add(const uint8_t *bytes, size_t count);
    /// The next whole message; nothing: not there yet, or too_long().
    std::optional<Message> next();
    /// The header of a message that is longer than any may be (body empty): from here on nothing
    /// can be told apart. Nothing: all is well.
    std::optional<Message> too_long() const;
    /// Nothing of a message is there.
    bool empty() const { return at_ == bytes_.size(); }

  private:
    size_t waiting() const { return bytes_.size() - at_; }
    size_t announced() const;  ///< length of the body; the header is there

    Body bytes_;
    size_t at_ = 0;
};

/// Header and body behind `output`.
void append(Body &output, const Message &message);

}  // namespace simrig

#endif
