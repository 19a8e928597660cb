// SPDX-License-Identifier: Apache-2.0
/// The requests of the protocol, carried out on a rig: bytes in, bytes out, no sockets. Requests
/// that let time pass may take long; they run in steps so that a server can look after others.
#ifndef VERGENCE_SIMRIG_SERVER_BOARD_HPP
#define VERGENCE_SIMRIG_SERVER_BOARD_HPP

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/simrig/protocol/simrig_protocol.h"
#include "tools/simrig/rig/rig.hpp"
#include "tools/simrig/server/body.hpp"

namespace simrig {

using Body = std::vector<uint8_t>;

/// A reply that tells that something is wrong.
Body refusal(simrig_status status, const std::string &text);

/// Carries out commands of the control side: text in, text out; throws std::runtime_error with a
/// line that says what is wrong.
using Control = std::function<std::string(const std::string &command)>;

class Board {
  public:
    Board(Rig &rig, std::string rig_name, bool wall_time, Control control);

    /// Starts a request of a client that has greeted. Empty: it goes on in step().
    std::optional<Body> begin(uint16_t type, const Body &body, simrig_role role);
    bool busy() const { return pending_.has_value(); }
    /// Goes on for at most so much of the rig's time. Empty: not done yet.
    std::optional<Body> step(double slice_us);
    /// Whoever waits for step() has gone.
    void abandon() { pending_.reset(); }
    /// The board's client has gone.
    void release();

    /// The reply to SIMRIG_HELLO; role: what it asks for.
    Body greet(const Body &body, bool board_is_taken, std::optional<simrig_role> &role);

  private:
    struct Pending {
        uint16_t type;
        double until_us;
        uint32_t wake;
    };
    Body i2c(BodyReader body);
    Body gpio_get();
    Body frame(double deadline_us);
    std::optional<Body> begin_checked(uint16_t type, BodyReader body, simrig_role role);
    std::optional<Body> begin_board(uint16_t type, BodyReader body);

    Rig &rig_;
    std::string rig_name_;
    bool wall_time_;
    Control control_;
    std::optional<Pending> pending_;
};

}  // namespace simrig

#endif
